/** The engine within the element of one file: the full one, which serves for everything; what `engine-files.ts` is elsewhere. */
import packed from '../../../pkg/scanstitch_bg.wasm?packed';
import type * as elsewhere from './engine-files.js';
import worker_url from './planar-worker.ts?worker&url';
import { unpacked } from './unpack.js';

export const first: typeof elsewhere.first = { file: 'full', worker_url };

export const fullWorker: typeof elsewhere.fullWorker = async () => worker_url;

export const fetchEngine: typeof elsewhere.fetchEngine = async () => unpacked(packed);
