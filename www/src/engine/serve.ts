/**
 * Calls across threads, the worker's side: it serves the methods of an object, which the page calls by name. Results are
 * transferred where they can be. An error of the engine's own is passed on as it is; any other one means that the worker
 * is in an unknown state and must be replaced.
 */
import type { Problem } from './protocol.js';

type Api = Record<string, (...args: never[]) => unknown>;

export interface Call {
  id: number;
  method: string;
  args: unknown[];
}

export type Answer =
  { id: number; value: unknown } | { id: number; error: Problem & { message: string } } | { id: number; crash: string };

/** In the worker: serves `api`. */
export function serve(api: object): void {
  self.onmessage = async ({ data: { id, method, args } }: MessageEvent<Call>) => {
    try {
      const value = await (api as Api)[method]?.(...(args as never[]));
      self.postMessage({ id, value } satisfies Answer, { transfer: buffersOf(value) });
    } catch (error) {
      const message = error instanceof Error ? error.message : String(error);
      if (error instanceof Error && error.name === 'ScanstitchError') {
        const { file = '', place = null, problem = message, remedy = '' } = error as Error & Partial<Problem>;
        self.postMessage({ id, error: { file, place, problem, remedy, message } } satisfies Answer);
      } else {
        self.postMessage({ id, crash: message } satisfies Answer);
      }
    }
  };
}

/** The buffers of typed arrays in a value or one or two levels within it. */
function buffersOf(value: unknown, depth = 2): Transferable[] {
  if (ArrayBuffer.isView(value)) return value.byteLength > 0 ? [value.buffer as ArrayBuffer] : [];
  if (depth === 0 || value === null || typeof value !== 'object' || Array.isArray(value)) return [];
  return [...new Set(Object.values(value).flatMap((part) => buffersOf(part, depth - 1)))];
}
