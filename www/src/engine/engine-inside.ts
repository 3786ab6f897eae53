/** The engine within the element of one file: the full one, which serves for everything; what `engine-files.ts` is elsewhere. */
import packed from '../../../pkg/scanstitch_bg.wasm?packed';
import type { first as elsewhere } from './engine-files.js';
import worker_url from './planar-worker.ts?worker&url';

export const first: typeof elsewhere = { file: 'full', worker_url };

/** The WebAssembly module, unpacked. */
export async function fetchEngine(): Promise<Response> {
  const bytes = Uint8Array.from(atob(packed), (character) => character.charCodeAt(0));
  const module = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Response(module, { headers: { 'Content-Type': 'application/wasm' } });
}
