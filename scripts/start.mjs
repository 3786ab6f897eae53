// @ts-check
/**
 * `npm start`: from a fresh clone to the page in the browser. Installs what is missing, builds, serves, prints the
 * address. `npm start -- --port 8080` chooses the port.
 */
import { join } from 'node:path';
import {
  buildEngine,
  duration,
  ensureNodeModules,
  ensureWasmTarget,
  ROOT,
  readArguments,
  requireToolchain,
  runMain,
  StepError,
  step,
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

await runMain(async () => {
  const started = performance.now();
  const port = readPort();
  requireToolchain();
  await ensureWasmTarget();
  await ensureNodeModules();
  await buildEngine();
  const server = await step('Starting the server', async () => {
    const { createServer } = await import('vite');
    const server = await createServer({
      root: join(ROOT, 'www'),
      logLevel: 'warn',
      clearScreen: false,
      // The page reads the compiled engine from pkg/, beside its own root.
      server: { host: 'localhost', port, fs: { allow: [ROOT] } },
    });
    return server.listen();
  });
  const address = server.resolvedUrls?.local[0];
  console.log(
    `\nReady after ${duration(performance.now() - started)}. Open this address in a browser:\n\n    ${address}\n`,
  );
  console.log('Ctrl+C stops the server. Changes under www/src show at once; after a change under crate/, start again.');
});
