/** The view's side of the evaluation's worker: one question at a time, the latest wins. */
import wasm_url from '../../../pkg/scanstitch_bg.wasm?url';
import { compile, startWorker } from '../engine/start.js';
import type { Answer, FromWorker, Question, ToWorker } from './protocol.js';
import worker_url from './worker.ts?worker&url';

export class EvaluationClient {
  #worker: Worker | null = null;
  #is_ready = false;
  #is_busy = false;
  #waiting: Question | null = null;
  #next_id = 0;

  constructor(
    private readonly answered: (answer: Answer) => void,
    private readonly failed: (message: string) => void,
  ) {
    this.#start();
  }

  /** Asks; an older question that has not been begun is dropped, and the answer to it never comes. */
  ask(question: Omit<Question, 'id'>): void {
    this.#waiting = { ...question, id: ++this.#next_id };
    this.#next();
  }

  dispose(): void {
    this.#worker?.terminate();
    this.#worker = null;
  }

  #start(): void {
    const worker = startWorker(worker_url);
    this.#worker = worker;
    this.#is_ready = false;
    this.#is_busy = false;
    worker.onmessage = ({ data }: MessageEvent<FromWorker>) => this.#receive(data);
    worker.onerror = (event) => {
      event.preventDefault();
      this.#crashed(event.message || 'The worker could not be loaded.');
    };
    compile(wasm_url).then(
      (module) => worker.postMessage({ type: 'start', module } satisfies ToWorker),
      (error: unknown) => this.failed(error instanceof Error ? error.message : String(error)),
    );
  }

  #receive(message: FromWorker): void {
    if (message.type === 'crashed') return this.#crashed(message.message);
    if (message.type === 'ready') this.#is_ready = true;
    else {
      this.#is_busy = false;
      if (message.answer.id === this.#next_id) this.answered(message.answer);
    }
    this.#next();
  }

  #next(): void {
    if (!this.#is_ready || this.#is_busy || !this.#waiting || !this.#worker) return;
    this.#worker.postMessage({ type: 'ask', question: this.#waiting } satisfies ToWorker);
    this.#waiting = null;
    this.#is_busy = true;
  }

  #crashed(message: string): void {
    if (!this.#worker) return;
    this.#worker.terminate();
    this.failed(`The evaluation stopped: ${message} It was started anew; please report this.`);
    this.#start();
  }
}
