/** The engine within the element of one file: the full one, which serves for everything; what `engine-files.ts` is elsewhere. */
import packed from '../../../pkg/scanstitch_bg.wasm?packed';
import type * as elsewhere from './engine-files.js';
import workerUrl from './planar-worker.ts?worker&url';
import { unpacked } from './unpack.js';

export const first: typeof elsewhere.first = { file: 'full', workerUrl };

export const fullWorker: typeof elsewhere.fullWorker = async () => workerUrl;

export const fetchEngine: typeof elsewhere.fetchEngine = async () => unpacked(packed);
