/** How the engine's module and the workers that run it are started. */
import { type EngineFile, fetchEngine } from './engine-files.js';

const compiled = new Map<EngineFile, Promise<WebAssembly.Module>>();
const ready = new Set<EngineFile>();

/** Whether a file has been fetched and compiled. */
export function isCompiled(file: EngineFile): boolean {
  return ready.has(file);
}

/** Downloads that are under way. */
const attempts = new Map<EngineFile, AbortController>();

/** Restarts the current downloads, since one that hangs may never fail. */
export function fetchAgain(): void {
  for (const attempt of attempts.values()) attempt.abort();
}

/** The compiled engine, which can be posted to any number of workers. Each file is fetched and compiled once. */
export function compileEngine(file: EngineFile): Promise<WebAssembly.Module> {
  const known = compiled.get(file);
  if (known) return known;
  const module = fetchAndCompile(file);
  module.then(
    () => ready.add(file),
    () => compiled.delete(file), // the next try may succeed
  );
  compiled.set(file, module);
  return module;
}

/** Longest wait for an idle page (ms), and the delay in browsers without idle callbacks. */
const IDLE_PATIENCE_MS = 2000;

/** Fetches the full engine while the page is idle, so that later uses start without delay. The package's modules fetch only what is asked for. */
export function compileFullWhenIdle(): void {
  if (import.meta.env.MODE === 'module') return;
  const { connection } = navigator as Navigator & { connection?: { saveData?: boolean } };
  if (connection?.saveData || compiled.has('full')) return;
  // A failure is ignored here: the files are fetched again when they are needed, with a message if that fails.
  const begin = (): void => void compileEngine('full').catch(() => undefined);
  if ('requestIdleCallback' in window) requestIdleCallback(begin, { timeout: IDLE_PATIENCE_MS });
  else setTimeout(begin, IDLE_PATIENCE_MS);
}

async function fetchAndCompile(file: EngineFile): Promise<WebAssembly.Module> {
  for (;;) {
    const attempt = new AbortController();
    attempts.set(file, attempt);
    try {
      return await compile(await fetchEngine(file, attempt.signal));
    } catch (error) {
      if (!attempt.signal.aborted) throw error;
    } finally {
      attempts.delete(file);
    }
  }
}

async function compile(response: Response): Promise<WebAssembly.Module> {
  // Hosts that do not know the type application/wasm are common: compile the bytes there.
  const isWasm = response.headers.get('Content-Type')?.startsWith('application/wasm') ?? false;
  return isWasm ? WebAssembly.compileStreaming(response) : WebAssembly.compile(await response.arrayBuffer());
}

/** Workers that were started and have nothing to do, by their script. */
const idle = new Map<string, Worker[]>();
/** A worker that is idle for so long ends, and its memory is freed (ms). */
const IDLE_MS = 60_000;

/** Keeps a worker for whoever starts the next one of this script; nobody else may hold it. */
export function keepWorker(workerUrl: string, worker: Worker): void {
  const kept = idle.get(workerUrl) ?? [];
  idle.set(workerUrl, kept);
  kept.push(worker);
  setTimeout(() => {
    if (!kept.includes(worker)) return;
    kept.splice(kept.indexOf(worker), 1);
    worker.terminate();
  }, IDLE_MS);
}

/**
 * A browser starts workers only from the page's own host. Where the element is embedded from another one, a line of
 * our own there imports the worker's script. One that was kept is taken first.
 */
export function startWorker(workerUrl: string): Worker {
  const kept = idle.get(workerUrl)?.pop();
  if (kept) return kept;
  const url = new URL(workerUrl, import.meta.url);
  // In the single-file element. A frame with an opaque origin cannot start a module from a blob.
  if (url.protocol === 'blob:') return new Worker(url);
  if (url.origin === location.origin) return new Worker(url, { type: 'module' });
  const script = new Blob([`import ${JSON.stringify(url.href)};`], { type: 'text/javascript' });
  const scriptUrl = URL.createObjectURL(script);
  const worker = new Worker(scriptUrl, { type: 'module' });
  worker.addEventListener('message', () => URL.revokeObjectURL(scriptUrl), { once: true });
  return worker;
}
