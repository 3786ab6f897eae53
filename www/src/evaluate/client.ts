/** The view's side of a worker of the evaluation: one question at a time, the latest wins. */
import wasm_url from '../../../pkg/scanstitch_bg.wasm?url';
import { compile, startWorker } from '../engine/start.js';
import type { FromWorker, ToWorker } from './protocol.js';

export interface ClientHooks<Told, Given> {
  answered(answer: Given): void;
  failed(message: string): void;
  /** All that a worker has to be told before its first question, also after a crash. */
  greet?(): Told;
}

export class WorkerClient<Told, Asked, Given> {
  #worker: Worker | null = null;
  #is_ready = false;
  #is_busy = false;
  #waiting: ToWorker<Told, Asked>[] = [];
  #next_id = 0;

  constructor(
    private readonly worker_url: string,
    private readonly hooks: ClientHooks<Told, Given>,
  ) {
    this.#start();
  }

  /** Said before all questions that follow. */
  tell(told: Told): void {
    this.#waiting.push({ type: 'tell', told });
    this.#next();
  }

  /** Asks; an older question that has not been begun is dropped, and the answer to it never comes. */
  ask(question: Asked): void {
    this.#waiting = this.#waiting.filter(({ type }) => type !== 'ask');
    this.#waiting.push({ type: 'ask', id: ++this.#next_id, question });
    this.#next();
  }

  dispose(): void {
    this.#worker?.terminate();
    this.#worker = null;
  }

  #start(): void {
    const worker = startWorker(this.worker_url);
    this.#worker = worker;
    this.#is_ready = false;
    this.#is_busy = false;
    worker.onmessage = ({ data }: MessageEvent<FromWorker<Given>>) => this.#receive(data);
    worker.onerror = (event) => {
      event.preventDefault();
      this.#crashed(event.message || 'The worker could not be loaded.');
    };
    compile(wasm_url).then(
      (module) => worker.postMessage({ type: 'start', module } satisfies ToWorker<Told, Asked>),
      (error: unknown) => this.hooks.failed(error instanceof Error ? error.message : String(error)),
    );
  }

  #receive(message: FromWorker<Given>): void {
    if (message.type === 'crashed') return this.#crashed(message.message);
    if (message.type === 'ready') this.#is_ready = true;
    else {
      this.#is_busy = false;
      if (message.id === this.#next_id) this.hooks.answered(message.answer);
    }
    this.#next();
  }

  #next(): void {
    while (this.#is_ready && !this.#is_busy && this.#worker) {
      const message = this.#waiting.shift();
      if (!message) return;
      this.#worker.postMessage(message);
      this.#is_busy = message.type === 'ask';
    }
  }

  #crashed(message: string): void {
    if (!this.#worker) return;
    this.#worker.terminate();
    this.hooks.failed(`The evaluation stopped: ${message} It was started anew; please report this.`);
    const told = this.hooks.greet?.();
    this.#waiting = told === undefined ? [] : [{ type: 'tell', told }];
    this.#start();
  }
}
