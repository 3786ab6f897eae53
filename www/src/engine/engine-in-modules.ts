/** The engine within the modules for bundlers, each file in one that is imported when it is needed; what `engine-files.ts` is elsewhere. */
import type * as elsewhere from './engine-files.js';
import workerUrl from './first-planar-worker.ts?worker&url';
import { unpacked } from './unpack.js';

export const first: typeof elsewhere.first = { file: 'planar', workerUrl };

export const fullWorker: typeof elsewhere.fullWorker = async () =>
  (await import('./planar-worker.ts?worker&url')).default;

export const fetchEngine: typeof elsewhere.fetchEngine = async (file) => {
  const { default: packed } = await (file === 'full'
    ? import('../../../pkg/scanstitch_bg.wasm?packed')
    : import('../../../pkg/scanstitch_planar_bg.wasm?packed'));
  return unpacked(packed);
};
