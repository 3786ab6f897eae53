// @ts-check
/**
 * The page of `npm start` is served while the full engine is still being compiled. What needs that engine waits here for it,
 * and the page is told how far it is (www/dev/engine-status.ts).
 */
import { join } from 'node:path';
import { ROOT } from './steps.mjs';

/** @typedef {import('../www/dev/engine-status.js').EngineStatus} EngineStatus */

const STATUS = 'scanstitch:engine';
const STATUS_ASKED = 'scanstitch:engine?';
const STATUS_INTERVAL_MS = 1000;
const STATUS_SCRIPT = '/dev/engine-status.ts';
/** The engine's files, as the page imports them; they may not be there yet. */
const ENGINE_FILE = /^(?:\.\.\/)+pkg\/(scanstitch\w*\.(?:js|wasm))(\?.*)?$/;
/** What asks for the full engine, or for what unpacks E57, LAZ and bzip2: the modules that import them, and the WebAssembly itself. */
const FULL_ONLY = /\/(?:src\/engine\/package|archive\/engine_in_browser)\.ts$|\/pkg\/scanstitch(?:_formats)?_bg\.wasm$/;

/**
 * @param {Promise<unknown>} compiled the full engine, and what unpacks
 * @param {() => string} progress what is being compiled
 * @returns {import('vite').Plugin}
 */
export function fullEngineLater(compiled, progress) {
  /** @type {EngineStatus['state']} */
  let state = 'compiling';
  const settled = compiled.then(
    () => (state = 'there'),
    () => (state = 'failed'),
  );
  /** @returns {EngineStatus} */
  const status = () => ({ state, progress: progress() });
  return {
    name: 'full-engine-later',
    enforce: 'pre',
    // Vite would load what a module imports ahead of the request for it, and so ahead of the engine.
    config: () => ({ server: { preTransformRequests: false } }),
    resolveId(source) {
      const [, file, query = ''] = source.match(ENGINE_FILE) ?? [];
      return file === undefined ? null : join(ROOT, 'pkg', file) + query;
    },
    transformIndexHtml: () => [{ tag: 'script', attrs: { type: 'module', src: STATUS_SCRIPT } }],
    configureServer(server) {
      server.ws.on(STATUS_ASKED, (_, client) => client.send(STATUS, status()));
      const timer = setInterval(() => server.ws.send(STATUS, status()), STATUS_INTERVAL_MS);
      void settled.then(() => {
        clearInterval(timer);
        server.ws.send(STATUS, status());
      });
      server.middlewares.use((request, response, next) => {
        const { pathname, searchParams } = new URL(request.url ?? '/', 'http://localhost');
        if (!FULL_ONLY.test(pathname) || searchParams.has('import')) {
          next();
          return;
        }
        void settled.then(() => {
          if (state === 'there') next();
          else response.writeHead(503, 'The full engine could not be compiled').end();
        });
      });
    },
  };
}
