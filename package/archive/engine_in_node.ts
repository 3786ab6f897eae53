/** The part of the engine that unpacks E57, LAZ and bzip2, in Node. */
import { readFile } from 'node:fs/promises';
import { initSync } from '../../pkg/scanstitch_formats.js';

export { Bzip2, read_e57, unpack_laz } from '../../pkg/scanstitch_formats.js';

/** Makes it ready. */
export async function start() {
  initSync({ module: await readFile(new URL('../../pkg/scanstitch_formats_bg.wasm', import.meta.url)) });
}
