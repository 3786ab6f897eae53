/**
 * Calls across threads, the worker's side: it serves the functions of an object, which the page calls by name, and sends
 * events of its own accord. An error of the engine's own is passed on as it is; any other one means that the worker is in
 * an unknown state and must be replaced.
 */
import type { Problem } from './protocol.js';
import { messageOf } from './message-of.js';

/** What serves the calls of `Api`: each function at once or later. */
export type Served<Api> = {
  [K in keyof Api]: Api[K] extends (...args: infer A) => infer R ? (...args: A) => R | Promise<R> : never;
};

export interface Call {
  id: number;
  method: string;
  args: unknown[];
}

export type Message =
  | { id: number; value: unknown }
  | { id: number; error: Problem & { message: string } }
  | { event: unknown }
  | { crash: string };

/** Buffers to be transferred with a result, where they lie deeper in it than `serve` looks. */
const deepBuffers = new WeakMap<object, Transferable[]>();

/** In the worker: a result whose `buffers` are transferred. */
export function transferred<T extends object>(result: T, buffers: Transferable[]): T {
  deepBuffers.set(result, buffers);
  return result;
}

/** In the worker: serves `api`. */
export function serve<Api extends object>(api: Served<Api>): void {
  const functions = api as Record<string, (...args: unknown[]) => unknown>;
  self.onmessage = async ({ data: { id, method, args } }: MessageEvent<Call>) => {
    try {
      const value = await functions[method]?.(...args);
      post({ id, value }, deepBuffers.get(value as object) ?? buffersOf(value));
    } catch (error) {
      const message = messageOf(error);
      if (!isInputError(error)) {
        post({ crash: message });
        return;
      }
      // The engine has null for no file.
      const { file, place = null, problem = message, remedy = '' } = error as Error & Partial<Problem>;
      post({ id, error: { file: file ?? '', place, problem, remedy, message } });
    }
  };
}

/** In the worker: sends the page an event. */
export function emit(event: unknown, transfer: Transferable[] = []): void {
  post({ event }, transfer);
}

/** In the worker: this one can no longer be trusted, and is to be replaced. */
export function reportCrash(error: unknown): void {
  post({ crash: messageOf(error) });
}

/** Whether the engine refuses its input. After any other error it is in an unknown state. */
export function isInputError(error: unknown): error is Error & Partial<Problem> {
  return error instanceof Error && error.name === 'ScanstitchError';
}

/** The value, or the input error; other exceptions, which are defects of the engine, are passed on. */
export function attempt<T>(action: () => T): { value: T } | { problem: string } {
  try {
    return { value: action() };
  } catch (error) {
    if (isInputError(error)) return { problem: error.message };
    throw error;
  }
}

/** An error as the engine throws it, where there is nothing yet to work on. */
export function nothingLoaded(): Error {
  return Object.assign(new Error('Nothing is loaded.'), { name: 'ScanstitchError' });
}

function post(message: Message, transfer: Transferable[] = []): void {
  self.postMessage(message, { transfer });
}

/** The buffers of typed arrays in a value or one or two levels within it. */
function buffersOf(value: unknown, depth = 2): Transferable[] {
  if (ArrayBuffer.isView(value)) return value.byteLength > 0 ? [value.buffer as ArrayBuffer] : [];
  if (depth === 0 || value === null || typeof value !== 'object' || Array.isArray(value)) return [];
  return [...new Set(Object.values(value).flatMap((part) => buffersOf(part, depth - 1)))];
}
