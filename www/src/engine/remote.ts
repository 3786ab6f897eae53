/** Calls across threads, the page's side: one worker and the calls that wait for it. What becomes of it after a crash is
 * for `WorkerHost` to say. */
import { WorkerDied } from '../../../package/base/worker_died.js';
import type { Problem } from './protocol.js';
import type { Call, Message } from './serve.js';

export { WorkerDied };

/** What is wrong with the input, as the engine says it. */
export class EngineProblem extends Error {
  constructor(readonly problem: Problem & { message: string }) {
    super(problem.message);
    this.name = 'ScanstitchError';
  }
}

export type Arguments<F> = F extends (...given: infer A) => unknown ? A : never;
export type Result<F> = F extends (...given: never[]) => infer R ? R : never;

export interface RemoteHooks<Event> {
  /** The worker has sent an event. */
  event?(event: Event): void;
  /** The worker died, or could not be loaded; the calls that waited for it have failed. */
  died?(message: string): void;
}

export class Remote<Api extends object, Event = never> {
  #worker: Worker | null;
  #waiting = new Map<number, { resolve(value: unknown): void; reject(error: Error): void }>();
  #next = 0;
  #hooks: RemoteHooks<Event>;

  constructor(worker: Worker, hooks: RemoteHooks<Event> = {}) {
    this.#worker = worker;
    this.#hooks = hooks;
    worker.onmessage = ({ data }: MessageEvent<Message>) => this.#receive(data);
    worker.onerror = (event) => {
      event.preventDefault();
      this.kill(event.message || 'the worker could not be loaded');
    };
    worker.onmessageerror = () => this.kill('a message of the worker could not be read');
  }

  /** The buffers of arguments are not moved, but copied: whoever calls may need them again. */
  call<K extends keyof Api & string>(method: K, ...args: Arguments<Api[K]>): Promise<Result<Api[K]>> {
    return this.give(method, [], ...args);
  }

  /** As `call`, with buffers that are given away. */
  give<K extends keyof Api & string>(
    method: K,
    transfer: Transferable[],
    ...args: Arguments<Api[K]>
  ): Promise<Result<Api[K]>> {
    const worker = this.#worker;
    if (!worker) return Promise.reject(new WorkerDied('the worker has ended'));
    const id = this.#next++;
    const answer = new Promise<unknown>((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject });
      worker.postMessage({ id, method, args } satisfies Call, { transfer });
    });
    return answer as Promise<Result<Api[K]>>;
  }

  /** Ends the worker as one that died: every call that waits fails, and `died` is called. */
  kill(message: string): void {
    if (!this.#worker) return;
    this.end(message);
    this.#hooks.died?.(message);
  }

  /** As `kill`, but intended: `died` is not called. */
  end(message = 'the worker was ended'): void {
    this.#worker?.terminate();
    this.#worker = null;
    for (const { reject } of this.#waiting.values()) reject(new WorkerDied(message));
    this.#waiting.clear();
  }

  /** Gives its worker away, if nobody waits for it; otherwise it ends. */
  release(): Worker | null {
    const worker = this.#waiting.size === 0 ? this.#worker : null;
    if (!worker) {
      this.end();
      return null;
    }
    this.#worker = null;
    worker.onmessage = worker.onerror = worker.onmessageerror = null;
    return worker;
  }

  #receive(message: Message): void {
    if (!this.#worker) return;
    if ('crash' in message) {
      this.kill(message.crash);
    } else if ('event' in message) {
      this.#hooks.event?.(message.event as Event);
    } else {
      const waiting = this.#waiting.get(message.id);
      this.#waiting.delete(message.id);
      if ('error' in message) waiting?.reject(new EngineProblem(message.error));
      else waiting?.resolve(message.value);
    }
  }
}
