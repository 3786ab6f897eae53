/** Packs files, beside the page: a map of a million points takes a second. */
import { zipSync } from 'fflate';
import { serve } from '../engine/serve.js';

const api = {
  zip: (files: Record<string, Uint8Array>): Uint8Array => zipSync(files, { level: 6 }),
};

export type ZipApi = typeof api;

serve<ZipApi>(api);
