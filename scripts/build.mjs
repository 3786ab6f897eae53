// @ts-check
/** `npm run build`: the WebAssembly module into pkg/, the page into www/dist, which any static host can serve, and beside
 * it the element for bundlers and in one file. */
import { writeBillOfMaterials } from './sbom.mjs';
import {
  buildEngine,
  buildModules,
  buildPage,
  buildStandalone,
  ensureNodeModules,
  ensureWasmTarget,
  requireToolchain,
  runMain,
} from './steps.mjs';

await runMain(async () => {
  requireToolchain();
  await ensureWasmTarget();
  await ensureNodeModules();
  await buildEngine();
  await buildPage();
  await buildModules();
  await buildStandalone();
  writeBillOfMaterials();
});
