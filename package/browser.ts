/** The `scanstitch` package in browsers and for their bundlers: as `index.ts`, without anything of Node. */
import { type Engine, loadOnce } from './api/load.js';

export * from './api/api.js';

/** As in `index.ts`. */
export function load(engine?: Engine): Promise<void> {
  return loadOnce(engine, async () => new URL('../pkg/scanstitch_bg.wasm', import.meta.url));
}
