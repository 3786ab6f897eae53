/** The part of the engine that unpacks E57, LAZ and bzip2, within the element; what `package/archive/engine_in_browser.ts` is elsewhere. */
import { initSync } from '../../../pkg/scanstitch_formats.js';
import packed from '../../../pkg/scanstitch_formats_bg.wasm?packed';
import { unpacked } from './unpack.js';

export { Bzip2, read_e57, unpack_laz } from '../../../pkg/scanstitch_formats.js';

/** Makes it ready. */
export async function start(): Promise<void> {
  initSync({ module: await WebAssembly.compileStreaming(unpacked(packed)) });
}
