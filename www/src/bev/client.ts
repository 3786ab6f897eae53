/** The view's side of the worker of the bird's-eye view. */
import wasm_url from '../../../pkg/scanstitch_bg.wasm?url';
import { compile, startWorker } from '../engine/start.js';
import type { Answer, BevScene, Call, Calls, FromWorker, Question, Strip, ToWorker } from './protocol.js';
import worker_url from './worker.ts?worker&url';

/** Bad input, in words for the user. */
export class Refusal extends Error {}

interface Waiting {
  resolve: (answer: unknown) => void;
  reject: (error: Error) => void;
}

export class BevClient {
  #worker: Worker;
  #next_id = 0;
  #waiting = new Map<number, Waiting>();
  #generation = 0;
  #is_projecting = false;
  #next_question: { question: Question; answered: (answer: Answer | Refusal) => void } | null = null;

  constructor(
    private readonly on_strip: (strip: Strip) => void,
    private readonly on_crash: (message: string) => void,
  ) {
    this.#worker = startWorker(worker_url);
    this.#worker.onmessage = ({ data }: MessageEvent<FromWorker>) => this.#receive(data);
    this.#worker.onerror = (event) => {
      event.preventDefault();
      this.on_crash(event.message || 'The worker could not be loaded.');
    };
    compile(wasm_url).then(
      (module) => this.#post({ type: 'start', module }),
      (error: unknown) => this.on_crash(error instanceof Error ? error.message : String(error)),
    );
  }

  /** Asks the engine; rejects with a Refusal where the input is bad. */
  call<K extends Call>(call: K, given: Calls[K][0], transfer: Transferable[] = []): Promise<Calls[K][1]> {
    const id = this.#next_id++;
    const answer = new Promise<unknown>((resolve, reject) => this.#waiting.set(id, { resolve, reject }));
    this.#post({ type: 'call', id, call, given }, transfer);
    return answer as Promise<Calls[K][1]>;
  }

  /** Projects; while a question is being answered only the latest one after it waits. */
  project(question: Question, answered: (answer: Answer | Refusal) => void): void {
    this.#next_question = { question, answered };
    if (!this.#is_projecting) this.#projectNext();
  }

  /** Warps the kept picture anew; strips of an older scene no longer come. */
  warp(scene: BevScene): number {
    this.#post({ type: 'warp', generation: ++this.#generation, scene });
    return this.#generation;
  }

  /** Strips of a scene before no longer come. */
  unwarp(): void {
    this.#generation++;
  }

  dispose(): void {
    this.#worker.terminate();
    this.#waiting.clear();
  }

  async #projectNext(): Promise<void> {
    const next = this.#next_question;
    if (!next) return;
    this.#next_question = null;
    this.#is_projecting = true;
    try {
      next.answered(await this.call('project', next.question));
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      next.answered(error);
    } finally {
      this.#is_projecting = false;
    }
    this.#projectNext();
  }

  #receive(message: FromWorker): void {
    if (message.type === 'crashed') return this.on_crash(message.message);
    if (message.type === 'strip') {
      if (message.strip.generation === this.#generation) this.on_strip(message.strip);
      return;
    }
    const waiting = this.#waiting.get(message.id);
    this.#waiting.delete(message.id);
    if (message.type === 'answer') waiting?.resolve(message.answer);
    else waiting?.reject(new Refusal(message.message));
  }

  #post(message: ToWorker, transfer: Transferable[] = []): void {
    this.#worker.postMessage(message, transfer);
  }
}
