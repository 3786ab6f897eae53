// @ts-check
/** `npm run build`: the WebAssembly module into pkg/, the page into www/dist, which any static host can serve. */
import { join } from 'node:path';
import { buildWasm, ensureNodeModules, ensureWasmTarget, ROOT, requireToolchain, runMain, step } from './steps.mjs';

await runMain(async () => {
  requireToolchain();
  await ensureWasmTarget();
  await ensureNodeModules();
  await buildWasm();
  await step('Building the page into www/dist', async () => {
    const { build } = await import('vite');
    await build({ root: join(ROOT, 'www'), logLevel: 'info', clearScreen: false });
  });
});
