/** The part of the engine that unpacks files, loaded with the first that needs it. */
export type FormatsEngine = typeof import('#formats-engine');

let loading: Promise<FormatsEngine> | undefined;

function load() {
  loading ??= import('#formats-engine')
    .then(async (module) => {
      await module.start();
      return module;
    })
    .catch((error) => {
      loading = undefined; // a failed download may succeed at the next try
      throw error;
    });
  return loading;
}

/**
 * What it makes of a file.
 * @param damaged the error to throw where the file is damaged, from what the engine says
 */
export async function byFormatsEngine<T>(use: (engine: FormatsEngine) => T, damaged: (reason: string) => Error) {
  const engine = await load();
  try {
    return use(engine);
  } catch (error) {
    if (error instanceof WebAssembly.RuntimeError) loading = undefined; // it cannot go on
    throw damaged((error as Error).message);
  }
}
