// @ts-check
/** The `scanstitch` package in Node: the typed API of the engine. Types and documentation are in `index.d.ts`. */
import { readFile } from 'node:fs/promises';
import { loadOnce } from './load.js';

export * from './api.js';

/** @type {typeof import('./index.js').load} */
export function load(engine) {
  // Node's fetch reads no files.
  return loadOnce(engine, () => readFile(new URL('../pkg/scanstitch_bg.wasm', import.meta.url)));
}
