/** Calls across threads, the page's side. */
import { WorkerDied } from '../../../npm/spatial_run.js';
import type { Problem } from './protocol.js';
import type { Answer, Call } from './serve.js';

/** What is wrong with the input, as the engine says it. */
export class EngineProblem extends Error {
  constructor(readonly problem: Problem & { message: string }) {
    super(problem.message);
    this.name = 'ScanstitchError';
  }
}

/** On the page: a worker and the calls that wait for it. */
export class Remote<T extends object> {
  #worker: Worker | null;
  #waiting = new Map<number, { resolve(value: unknown): void; reject(error: Error): void }>();
  #next = 0;
  #onDeath: (message: string) => void;

  constructor(worker: Worker, onDeath: (message: string) => void = () => undefined) {
    this.#worker = worker;
    this.#onDeath = onDeath;
    worker.onmessage = ({ data }: MessageEvent<Answer>) => {
      if ('crash' in data) {
        this.kill(data.crash);
        return;
      }
      const waiting = this.#waiting.get(data.id);
      this.#waiting.delete(data.id);
      if ('error' in data) waiting?.reject(new EngineProblem(data.error));
      else waiting?.resolve(data.value);
    };
    worker.onerror = (event) => {
      event.preventDefault();
      this.kill(event.message || 'it could not be loaded');
    };
  }

  get is_alive(): boolean {
    return this.#worker !== null;
  }

  /** The buffers of arguments are not moved, but copied: whoever calls may need them again. */
  call<K extends keyof T & string>(
    method: K,
    ...args: T[K] extends (...given: infer A) => unknown ? A : never
  ): Promise<T[K] extends (...given: never[]) => infer R ? R : never> {
    return this.send(method, args, []) as never;
  }

  /** As `call`, with buffers that are given away. */
  give<K extends keyof T & string>(
    method: K,
    transfer: Transferable[],
    ...args: T[K] extends (...given: infer A) => unknown ? A : never
  ): Promise<T[K] extends (...given: never[]) => infer R ? R : never> {
    return this.send(method, args, transfer) as never;
  }

  /** Ends the worker; every call that waits fails. */
  kill(message: string): void {
    if (!this.#worker) return;
    this.end(message);
    this.#onDeath(message);
  }

  /** As `kill`, on purpose: nobody is told. */
  end(message = 'it was ended'): void {
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
    worker.onmessage = null;
    worker.onerror = null;
    return worker;
  }

  private send(method: string, args: unknown[], transfer: Transferable[]): Promise<unknown> {
    const worker = this.#worker;
    if (!worker) return Promise.reject(new WorkerDied('it has ended'));
    const id = this.#next++;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject });
      worker.postMessage({ id, method, args } satisfies Call, { transfer });
    });
  }
}
