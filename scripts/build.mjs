// @ts-check
/** `npm run build`: the WebAssembly module into pkg/, the package into npm/, the page into www/dist, which any static host can serve, and beside
 * it the element for bundlers and in one file. With `--quick` the engine is compiled as for `npm start`, for tests. */
import { writeBillOfMaterials } from './sbom.mjs';
import { buildEngine, buildModules, buildPackage, buildPage, buildStandalone } from './engine.mjs';
import { ensureNodeModules, ensureWasmTarget, readArguments, requireToolchain, runMain } from './steps.mjs';

const USAGE = 'Usage: npm run build [-- --quick]';

await runMain(async () => {
  const { values } = readArguments({ options: { quick: { type: 'boolean' } } }, USAGE);
  requireToolchain();
  await Promise.all([ensureWasmTarget(), ensureNodeModules()]);
  await buildEngine(values.quick ? 'quick' : 'release');
  await buildPackage();
  await buildPage();
  await buildModules();
  await buildStandalone();
  writeBillOfMaterials();
});
