// @ts-check
/** Compiles the engine to WebAssembly, and builds package and page from it. */
import { copyFileSync, existsSync, mkdirSync, readdirSync, renameSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { manifest } from './manifest.mjs';
import { capture, ROOT, run, step, StepError, TARGET_DIR, WASM_TARGET } from './steps.mjs';

/**
 * How Rust is optimised: `release` is what is published; `quick` compiles in half of the time, for the page of `npm start`
 * and for tests. Both compute the same bytes.
 * @typedef {'release' | 'quick'} Profile
 */

const TOOLS = ['build', '--profile', 'tools', '--package', 'xtask'];
const WASM_TOOL = join(TARGET_DIR, 'tools', 'wasm');
const TEST_RUNNER = join(TARGET_DIR, 'tools', 'wasm-bindgen-test-runner');

/**
 * Builds the tool of crate/xtask that makes JavaScript modules of compiled ones; for `wasm-pack test` wasm-pack, wasm-bindgen and its
 * test runner as well.
 * @param {{ withTestRunner?: boolean, env?: NodeJS.ProcessEnv, isUrgent?: boolean }} [options] not urgent: compiling the engine takes
 * longer, and the tools fill its gaps
 * @returns {Promise<string>} what cargo says
 */
export function buildTools({ withTestRunner = false, env = {}, isUrgent = false } = {}) {
  // Where all were built once: without their features, cargo would compile what they share anew.
  const all = withTestRunner || existsSync(TEST_RUNNER) ? ['--features', 'test-tools', '--bins'] : [];
  return step('Building the tool that makes WebAssembly modules (crate/xtask)', async () => {
    const { code, output } = await capture('cargo', [...TOOLS, ...all], { env, echo: true, isUrgent });
    if (code !== 0) throw new StepError('The tools of crate/xtask could not be built.');
    return output;
  });
}

/**
 * What is small inlines seldom even what asks for it, which is else inlined up to a cost of 325: a twelfth less over the wire, for a
 * twelfth more time. It stands in the place of the flags of .cargo/config.toml.
 */
const SMALL_FLAGS =
  '-C target-feature=+simd128 -C llvm-args=-inlinehint-threshold=25 -C llvm-args=-inline-threshold=25';

/**
 * Compiles the library of a package to WebAssembly; cargo skips what is up to date.
 * @param {string} packageName
 * @param {string} name of the module
 * @param {Profile | 'small'} profile
 * @param {string[]} options of `cargo rustc`
 * @returns {Promise<string>} the path of the module
 */
async function compileWasm(packageName, name, profile, options) {
  // As a `cdylib` alone: beside an `rlib`, cargo would leave link-time optimisation out.
  const library = ['--lib', '--crate-type', 'cdylib', '--target', WASM_TARGET, '--package', packageName];
  // Without it cargo keeps one module of a package, and compiles both engines anew, each in the place of the other, at every
  // build. What Rust's own build uses; where cargo no longer knows it, builds take longer and are the same.
  const flags = profile === 'small' ? { CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS: SMALL_FLAGS } : {};
  const env = { __CARGO_DEFAULT_LIB_METADATA: 'scanstitch', ...flags };
  await run('cargo', ['rustc', '--profile', profile, ...library, ...options], { env });
  const folder = join(TARGET_DIR, WASM_TARGET, profile);
  // Cargo gives what is compiled of one package one name, whatever its features are; and this one keeps the names of functions, by
  // which scripts/sizes.mjs tells what takes how much.
  const linked = join(folder, `${name}.linked.wasm`);
  copyFileSync(join(folder, `${packageName.replaceAll('-', '_')}.wasm`), linked);
  return linked;
}

/**
 * Compiles the benchmarks to WebAssembly.
 * @param {string} outDir
 * @param {string[]} options of `cargo rustc`
 */
export async function buildBench(outDir, ...options) {
  await buildTools();
  await step('Compiling the benchmarks to WebAssembly', async () => {
    const linked = await compileWasm('scanstitch-bench', 'scanstitch_bench', 'release', options);
    await run(WASM_TOOL, [linked, outDir, 'scanstitch_bench']);
  });
}

/** The engine's parts: what the page begins with, planar scans alone; everything; and what unpacks E57, LAZ and bzip2. */
const PARTS = {
  planar: { title: 'what the page begins with (planar scans)', name: 'scanstitch_planar', package: 'scanstitch-wasm' },
  full: { title: 'the full engine', name: 'scanstitch', package: 'scanstitch-wasm' },
  formats: { title: 'what unpacks E57, LAZ and bzip2', name: 'scanstitch_formats', package: 'scanstitch-formats' },
};

/**
 * Compiles a part of the engine into pkg/.
 * @param {keyof typeof PARTS} part
 * @param {Profile} profile
 * @param {Promise<unknown>} tools what `buildTools` returned
 */
export function buildPart(part, profile, tools) {
  const { title, name, package: packageName } = PARTS[part];
  return step(`Compiling ${title}`, async () => {
    const options = part === 'planar' ? ['--no-default-features'] : [];
    const isSmall = profile === 'release' && part !== 'full';
    const linked = await compileWasm(packageName, name, isSmall ? 'small' : profile, options);
    await tools;
    await run(WASM_TOOL, [linked, join(ROOT, 'pkg'), name]);
  });
}

/** Compiles the engine into pkg/. @param {Profile} profile */
export async function buildEngine(profile) {
  const tools = buildTools();
  await Promise.all([
    tools,
    buildPart('planar', profile, tools)
      .then(() => buildPart('full', profile, tools))
      .then(() => buildPart('formats', profile, tools)),
  ]);
}

/** Emits the package into npm/, with its types, from the sources in package/; what has no source any more goes. */
export function buildPackage() {
  return step('Emitting the package into npm/', async () => {
    const [from, to] = [join(ROOT, 'package'), join(ROOT, 'npm')];
    const filesOf = (/** @type {string} */ folder) => readdirSync(folder, { recursive: true, encoding: 'utf8' });
    const sources = filesOf(from).filter((path) => path.endsWith('.ts'));
    const emitted = new Set(sources.flatMap((path) => ['.js', '.d.ts'].map((end) => path.replace(/\.ts$/, end))));
    // tsc leaves out what it has emitted before, even where it is gone.
    if ([...emitted].some((path) => !existsSync(join(to, path)))) rmSync(to, { recursive: true, force: true });
    await run(process.execPath, [join('node_modules', 'typescript', 'bin', 'tsc'), '--project', 'package']);
    const others = filesOf(to).filter((path) => /\.(js|d\.ts)$/.test(path) && !emitted.has(path));
    for (const path of others) rmSync(join(to, path));
    writeFileSync(join(to, 'custom-elements.json'), manifest());
  });
}

/**
 * Builds the page into www/dist from pkg/.
 * @param {import('vite').LogLevel} [logLevel]
 */
export function buildPage(logLevel = 'info') {
  return step('Building the page into www/dist', async () => {
    const { build } = await import('vite');
    await build({ root: join(ROOT, 'www'), logLevel, clearScreen: false });
  });
}

/** @satisfies {import('vite').InlineConfig} */
const OF_ELEMENT = { configFile: join(ROOT, 'www', 'vite.element.ts'), logLevel: 'error', clearScreen: false };

/** Builds the element as modules for bundlers. */
export function buildModules() {
  return step('Building the element for bundlers into www/dist/module', async () => {
    const { build } = await import('vite');
    await build({ ...OF_ELEMENT, mode: 'module' });
  });
}

/** The element in one file. */
export const ELEMENT = join(ROOT, 'www', 'dist', 'standalone', 'scanstitch-app.js');

/** Builds it. */
export function buildStandalone() {
  return step('Building the element in one file into www/dist/standalone', async () => {
    const { build } = await import('vite');
    // Rolldown warns of what Vite's own helper does in a classic script.
    const built = await build({ ...OF_ELEMENT, mode: 'standalone', build: { write: false } });
    const [script] = 'output' in built ? built.output : [];
    if (script?.type !== 'chunk') throw new Error('the element was not built');
    mkdirSync(dirname(ELEMENT), { recursive: true });
    // Renamed when it is complete: `npm pack` may read it meanwhile.
    writeFileSync(`${ELEMENT}.new`, script.code);
    renameSync(`${ELEMENT}.new`, ELEMENT);
  });
}
