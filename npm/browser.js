// @ts-check
/** The `scanstitch` package in browsers and for their bundlers: as `index.js`, without anything of Node. */
import { loadOnce } from './load.js';

export * from './api.js';

/** @type {typeof import('./index.js').load} */
export function load(engine) {
  return loadOnce(engine, async () => new URL('../pkg/scanstitch_bg.wasm', import.meta.url));
}
