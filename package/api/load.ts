/** Makes the engine ready, once. */
import init, { initSync } from '../../pkg/scanstitch.js';

/** Where the engine comes from. */
export type Engine = string | URL | Request | Response | BufferSource | WebAssembly.Module;

let loading: Promise<void> | undefined;

/** @param findEngine where it comes from when nothing is given */
export function loadOnce(engine: Engine | undefined, findEngine: () => Promise<Engine>): Promise<void> {
  loading ??= instantiate(engine, findEngine).catch((error) => {
    loading = undefined; // a failed download may succeed at the next try
    throw error;
  });
  return loading;
}

async function instantiate(given: Engine | undefined, findEngine: () => Promise<Engine>): Promise<void> {
  const engine = given ?? (await findEngine());
  if (engine instanceof WebAssembly.Module || engine instanceof ArrayBuffer || ArrayBuffer.isView(engine)) {
    initSync({ module: engine });
  } else {
    await init({ module_or_path: engine });
  }
}
