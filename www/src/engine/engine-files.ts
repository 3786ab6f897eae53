/** The engine's files beside the page. In the package's element `engine-in-one-file.ts` or `engine-in-modules.ts` replaces this module. */
import fullUrl from '../../../pkg/scanstitch_bg.wasm?url';
import planarUrl from '../../../pkg/scanstitch_planar_bg.wasm?url';
import firstWorkerUrl from './first-planar-worker.ts?worker&url';
import workerUrl from './planar-worker.ts?worker&url';

/** Planar scans alone, small and not as fast; and everything. */
export type EngineFile = 'planar' | 'full';

/** What the first planar scans are computed by. */
export const first: { file: EngineFile; workerUrl: string } = { file: 'planar', workerUrl: firstWorkerUrl };

/** The script of the worker that computes planar scans by the full engine. */
export const fullWorker = async (): Promise<string> => workerUrl;

/** The WebAssembly module of a file. */
export async function fetchEngine(file: EngineFile, signal: AbortSignal): Promise<Response> {
  const url = file === 'full' ? fullUrl : planarUrl;
  const response = await fetch(url, { signal });
  if (!response.ok) throw new Error(`${url} could not be loaded: ${response.status} ${response.statusText}`);
  return response;
}
