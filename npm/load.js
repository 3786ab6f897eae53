// @ts-check
/** Makes the engine ready, once. */
import init, { initSync } from '../pkg/scanstitch.js';

/** @typedef {Parameters<typeof import('./index.js').load>[0]} Engine where it comes from */

/** @type {Promise<void> | undefined} */
let loading;

/**
 * @param {Engine} engine
 * @param {() => Promise<NonNullable<Engine>>} findEngine where it comes from when nothing is given
 */
export function loadOnce(engine, findEngine) {
  loading ??= instantiate(engine, findEngine).catch((error) => {
    loading = undefined; // a failed download may succeed at the next try
    throw error;
  });
  return loading;
}

/**
 * @param {Engine} given
 * @param {() => Promise<NonNullable<Engine>>} findEngine
 */
async function instantiate(given, findEngine) {
  /** @type {any} */
  const engine = given ?? (await findEngine());
  if (engine instanceof WebAssembly.Module || engine instanceof ArrayBuffer || ArrayBuffer.isView(engine)) {
    initSync({ module: engine });
  } else {
    await init({ module_or_path: engine });
  }
}
