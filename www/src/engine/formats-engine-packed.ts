/** The part of the engine that unpacks E57 and LAZ, within the element; what `package/formats/engine_in_browser.ts` is elsewhere. */
import { initSync } from '../../../pkg/scanstitch_formats.js';
import packed from '../../../pkg/scanstitch_formats_bg.wasm?packed';
import { unpacked } from './unpack.js';

export { read_e57, unpack_laz } from '../../../pkg/scanstitch_formats.js';

/** Makes it ready. */
export async function start(): Promise<void> {
  initSync({ module: await WebAssembly.compileStreaming(unpacked(packed)) });
}
