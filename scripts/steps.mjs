// @ts-check
/**
 * What `npm start`, `npm test`, `npm run build` and `npm run bench` have in common: say what is being done and how long
 * it took, install what is missing inside the clone, build the WebAssembly module.
 *
 * Nothing here may import a package: it runs before `npm ci` has.
 */
import { AsyncLocalStorage } from 'node:async_hooks';
import { spawn, spawnSync } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, renameSync, statSync, writeFileSync } from 'node:fs';
import { delimiter, dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';

/** The root of the clone. */
export const ROOT = fileURLToPath(new URL('..', import.meta.url));

/** Cargo's output folder; the tools built from `crate/xtask` lie in `tools` within. */
export const TARGET_DIR = join(ROOT, process.env.CARGO_TARGET_DIR ?? 'target');

const WASM_TARGET = 'wasm32-unknown-unknown';
const OLDEST_NODE = 20;

/** A problem the person at the keyboard can mend: printed as it is, without a stack. */
export class StepError extends Error {}

/**
 * Where a piece of work writes, and what its commands have cost, where several pieces are done at a time.
 * @typedef {{ write: (text: string | Uint8Array) => void, cpuSeconds: number }} Account
 */
/** @type {AsyncLocalStorage<Account>} */
export const account = new AsyncLocalStorage();

/** @param {string | Uint8Array} text */
function write(text) {
  const { write } = account.getStore() ?? {};
  if (write) write(text);
  else process.stdout.write(text);
}

/** A line to the person at the keyboard. @param {string} line */
export function say(line) {
  write(`${line}\n`);
}

/**
 * Processor time (s) of all commands that have ended, with those that they started and waited for; null where the system
 * does not tell it as Linux does. Of a browser it is a part: nobody waits for some of its processes.
 */
export function commandSeconds() {
  const TICKS_PER_SECOND = 100;
  if (!existsSync('/proc/self/stat')) return null;
  // proc(5): the fields after the name in brackets begin with the third; the 16th and 17th are those of children.
  const fields = readFileSync('/proc/self/stat', 'utf8').split(') ').at(-1)?.split(' ') ?? [];
  return (Number(fields[13]) + Number(fields[14])) / TICKS_PER_SECOND;
}

/** What of `commandSeconds` has been put down to an account. */
let accountedSeconds = 0;

/** @param {number} milliseconds */
export function duration(milliseconds) {
  return milliseconds < 60_000
    ? `${(milliseconds / 1000).toFixed(1)} s`
    : `${Math.floor(milliseconds / 60_000)} min ${Math.round((milliseconds % 60_000) / 1000)} s`;
}

/**
 * Says what it is about to do, does it, says how long it took.
 * @template T
 * @param {string} title
 * @param {() => T | Promise<T>} work
 * @returns {Promise<T>}
 */
export async function step(title, work) {
  say(`\n> ${title}`);
  const start = performance.now();
  const result = await work();
  say(`  done in ${duration(performance.now() - start)}`);
  return result;
}

/**
 * Runs a command with its output passed through.
 * @param {string} command
 * @param {string[]} args
 * @param {{ env?: NodeJS.ProcessEnv, cwd?: string, remedy?: string }} [options]
 * @returns {Promise<void>}
 */
export async function run(command, args, options = {}) {
  const { code } = await capture(command, args, { env: options.env, cwd: options.cwd, echo: true });
  if (code !== 0) {
    const remedy = options.remedy ? ` ${options.remedy}` : '';
    throw new StepError(`\`${[command, ...args].join(' ')}\` failed (exit code ${code}).${remedy}`);
  }
}

/**
 * Runs a command and returns its exit code and everything it printed.
 * @param {string} command
 * @param {string[]} args
 * @param {{ env?: NodeJS.ProcessEnv, cwd?: string, echo?: boolean }} [options] echo: print it as it comes
 * @returns {Promise<{ code: number, output: string }>}
 */
export function capture(command, args, { env = {}, cwd = ROOT, echo = false } = {}) {
  const own = account.getStore();
  return new Promise((resolve, reject) => {
    const child = spawn(command, args, { cwd, env: { ...process.env, ...env }, stdio: ['ignore', 'pipe', 'pipe'] });
    /** @type {Buffer[]} */
    const chunks = [];
    for (const [from, to] of /** @type {const} */ ([
      [child.stdout, process.stdout],
      [child.stderr, process.stderr],
    ])) {
      from.on('data', (chunk) => {
        chunks.push(chunk);
        if (echo && own) own.write(chunk);
        else if (echo) to.write(chunk);
      });
    }
    child.on('exit', () => {
      const used = (commandSeconds() ?? 0) - accountedSeconds;
      accountedSeconds += used;
      if (own) own.cpuSeconds += used;
    });
    child.on('error', (error) => reject(new StepError(`\`${command}\` could not be started: ${error.message}.`)));
    child.on('close', (code) => resolve({ code: code ?? 1, output: Buffer.concat(chunks).toString() }));
  });
}

/**
 * Whether a command runs at all.
 * @param {string} command
 * @param {string[]} [args]
 */
export function answers(command, args = ['--version']) {
  return spawnSync(command, args, { stdio: 'ignore' }).status === 0;
}

/**
 * The path of the first of these programs that is on the PATH.
 * @param {string[]} names
 */
export function findProgram(names) {
  const folders = (process.env.PATH ?? '').split(delimiter);
  return names.flatMap((name) => folders.map((folder) => join(folder, name))).find((path) => existsSync(path));
}

/** The Chromium of the system; nothing is downloaded. CHROMIUM_PATH names one that is not on the PATH. */
export function findChromium() {
  const names = ['chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable'];
  return process.env.CHROMIUM_PATH ?? findProgram(names);
}

/** Chromium without its windows, where it is installed: it opens a page in two thirds of the time. */
export function findHeadlessChromium() {
  return process.env.CHROMIUM_PATH ?? findProgram(['chromium-headless-shell']) ?? findChromium();
}

/**
 * Node's parseArgs, its complaints as a StepError with the usage.
 * @template {import('node:util').ParseArgsConfig} T
 * @param {T} config
 * @param {string} usage
 * @returns {ReturnType<typeof parseArgs<T>>}
 */
export function readArguments(config, usage) {
  try {
    return parseArgs(config);
  } catch (error) {
    throw new StepError(`${/** @type {Error} */ (error).message}\n${usage}`);
  }
}

/** Puts a folder first on the PATH of everything started from here. @param {string} folder */
export function prependPath(folder) {
  process.env.PATH = `${folder}${delimiter}${process.env.PATH}`;
}

/** Fails, saying what to install, where Node is too old or Rust is missing. */
export function requireToolchain() {
  const node = process.versions.node;
  if (Number.parseInt(node, 10) < OLDEST_NODE) {
    throw new StepError(
      `Node ${node} is too old: Scanstitch needs Node ${OLDEST_NODE} or newer. See https://nodejs.org.`,
    );
  }
  if (!answers('cargo')) {
    throw new StepError(
      'Rust is not installed, or `cargo` is not on the PATH. Install it with rustup (https://rustup.rs), open a new ' +
        'terminal and run the same command again.',
    );
  }
  if (!answers('cc')) {
    throw new StepError(
      'Rust links with a C compiler, and `cc` is not on the PATH. On Debian: sudo apt-get install build-essential',
    );
  }
  const cargo = spawnSync('cargo', ['--version'], { encoding: 'utf8' }).stdout.trim();
  console.log(`Node ${node}, ${cargo}`);
}

/** Adds the WebAssembly target to the Rust toolchain when it lacks it. */
export async function ensureWasmTarget() {
  const sysroot = spawnSync('rustc', ['--print', 'sysroot'], { cwd: ROOT, encoding: 'utf8' }).stdout.trim();
  if (existsSync(join(sysroot, 'lib', 'rustlib', WASM_TARGET))) return;
  await step(`Adding the Rust target ${WASM_TARGET}`, () =>
    run('rustup', ['target', 'add', WASM_TARGET], {
      remedy: 'Without rustup, install the rust-std component of your toolchain for this target.',
    }),
  );
}

/** Adds rustfmt and clippy to a Rust toolchain that was installed without them. */
export async function ensureRustLinters() {
  if (answers('cargo', ['fmt', '--version']) && answers('cargo', ['clippy', '--version'])) return;
  await step('Adding rustfmt and clippy to the Rust toolchain', () =>
    run('rustup', ['component', 'add', 'rustfmt', 'clippy'], {
      remedy: 'Without rustup, install rustfmt and clippy of your toolchain.',
    }),
  );
}

/** Installs the locked node modules when they are missing or older than the lock. */
export async function ensureNodeModules() {
  const installed = join(ROOT, 'node_modules', '.package-lock.json');
  const lock = join(ROOT, 'package-lock.json');
  if (existsSync(installed) && statSync(installed).mtimeMs >= statSync(lock).mtimeMs) return;
  await step('Installing the node modules of package-lock.json (npm ci)', () =>
    run('npm', ['ci', '--no-audit', '--no-fund', '--loglevel=error'], {
      remedy: 'Is the network there? The same command alone says more: npm ci',
    }),
  );
}

const TOOLS = ['--profile', 'tools', '--package', 'xtask'];

const TEST_TOOLS = ['build', ...TOOLS, '--features', 'test-tools', '--bins'];

/** Builds the tools that tests need: wasm-bindgen and its test runner, into `tools` under the target folder. */
export async function buildTestTools() {
  await step('Building the test tools of crate/xtask', () => run('cargo', TEST_TOOLS));
}

/** The same, and what cargo says. @param {NodeJS.ProcessEnv} env */
export function captureTestTools(env) {
  return capture('cargo', TEST_TOOLS, { env, echo: true });
}

/**
 * Builds the tool of crate/xtask that makes WebAssembly; returns the arguments of cargo that run it.
 * @returns {Promise<string[]>}
 */
async function buildWasmTool() {
  // Where the tools for tests are built as well: without their features, cargo would compile what both need anew.
  const hasTestTools = existsSync(join(TARGET_DIR, 'tools', 'wasm-bindgen-test-runner'));
  const tools = [...TOOLS, ...(hasTestTools ? ['--features', 'test-tools'] : [])];
  await step('Building the tool that makes WebAssembly (crate/xtask)', () => run('cargo', ['build', ...tools]));
  return ['run', '--quiet', ...tools, '--bin', 'wasm', '--'];
}

/**
 * Compiles a package to WebAssembly; cargo skips what is up to date.
 * @param {string} packageName
 * @param {string} outDir
 * @param {string[]} options of cargo
 */
export async function buildWasm(packageName, outDir, ...options) {
  const tool = await buildWasmTool();
  await step(`Compiling ${packageName} to WebAssembly, into ${outDir}`, () =>
    run('cargo', [...tool, packageName, outDir, packageName.replaceAll('-', '_'), ...options]),
  );
}

/** What the page begins with: planar scans alone, compiled for size. What is done often is done by the full engine. */
const FIRST_ENGINE = ['scanstitch_planar', '--no-default-features', '--', '-C', 'opt-level=s'];

/** Compiles the engine into pkg/: everything, and what the page begins with. */
export async function buildEngine() {
  const tool = await buildWasmTool();
  await step('Compiling the engine to WebAssembly, into pkg', () =>
    run('cargo', [...tool, 'scanstitch', 'pkg', 'scanstitch']),
  );
  await step('Compiling the part of it that the page begins with', () =>
    run('cargo', [...tool, 'scanstitch', 'pkg', ...FIRST_ENGINE]),
  );
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

/**
 * Runs a script's main function: a StepError is one plain paragraph and exit code 1.
 * @param {() => Promise<void>} main
 */
export async function runMain(main) {
  try {
    await main();
  } catch (error) {
    if (!(error instanceof StepError)) throw error;
    console.error(`\n${error.message}`);
    process.exitCode = 1;
  }
}
