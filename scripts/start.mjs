// @ts-check
/**
 * `npm start`: from a fresh clone to the page in the browser. Installs what is missing, builds, serves, prints the address.
 * `npm start -- --port 8080` chooses the port. The page is served as soon as the part of the engine that it begins with is
 * compiled; the full engine follows, and terminal and page say when it is there.
 */
import { join } from 'node:path';
import { buildPackage, buildPart, buildTools } from './engine.mjs';
import { fullEngineLater } from './full_engine.mjs';
import { describe, say } from './progress.mjs';
import {
  duration,
  ensureNodeModules,
  ensureWasmTarget,
  ROOT,
  readArguments,
  requireToolchain,
  runMain,
  StepError,
} from './steps.mjs';

const USAGE = 'Usage: npm start [-- --port NUMBER]';

/** @returns {number} the port asked for, 0 to 65535 */
function readPort() {
  const { values } = readArguments({ options: { port: { type: 'string', default: '5173' } } }, USAGE);
  const port = Number(values.port);
  if (!Number.isInteger(port) || port < 0 || port > 65_535) {
    throw new StepError(`--port ${values.port} is not a port: give a whole number from 0 to 65535.\n${USAGE}`);
  }
  return port;
}

/**
 * @param {number} port
 * @param {Promise<void>} fullEngine
 */
async function serve(port, fullEngine) {
  const { createServer } = await import('vite');
  const server = await createServer({
    root: join(ROOT, 'www'),
    logLevel: 'warn',
    clearScreen: false,
    plugins: [fullEngineLater(fullEngine, describe)],
    // The page reads the compiled engine from pkg/, beside its own root.
    server: { host: 'localhost', port, fs: { allow: [ROOT] } },
  });
  await server.listen();
  return server.resolvedUrls?.local[0];
}

await runMain(async () => {
  const started = performance.now();
  const sinceStart = () => duration(performance.now() - started);
  const port = readPort();
  requireToolchain();
  const [tools, modules] = [buildTools(), ensureNodeModules()];
  const planar = ensureWasmTarget().then(() => buildPart('planar', 'quick', tools));
  const full = planar.then(() => buildPart('formats', 'quick', tools)).then(() => buildPart('full', 'quick', tools));
  full.catch(() => undefined); // reported where it is awaited; until then something before it may fail
  await Promise.all([tools, modules, planar]);
  const address = await serve(port, full);
  say(`\nReady after ${sinceStart()}. Open this address in a browser:\n\n    ${address}\n`);
  say('Planar PLY scans work at once; the full engine, for everything else, is being compiled.');
  await full;
  await buildPackage(); // for the command line
  say(`\nThe full engine is there after ${sinceStart()}: everything works.`);
  say('Ctrl+C stops the server. Changes under www/src show at once; after a change under crate/, start again.');
});
