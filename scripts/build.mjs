// @ts-check
/** `npm run build`: the WebAssembly module into pkg/, the page into www/dist, which any static host can serve. */
import { writeBillOfMaterials } from './sbom.mjs';
import { buildPage, buildEngine, ensureNodeModules, ensureWasmTarget, requireToolchain, runMain } from './steps.mjs';

await runMain(async () => {
  requireToolchain();
  await ensureWasmTarget();
  await ensureNodeModules();
  await buildEngine();
  await buildPage();
  writeBillOfMaterials();
});
