// @ts-check
/**
 * What `npm start`, `npm test`, `npm run build` and `npm run bench` have in common: say what is being done and how long
 * it took, install what is missing inside the clone.
 *
 * Nothing here may import a package: it runs before `npm ci` has.
 */
import { spawn, spawnSync } from 'node:child_process';
import { existsSync, readFileSync, statSync } from 'node:fs';
import { constants, setPriority } from 'node:os';
import { delimiter, join } from 'node:path';
import { createInterface } from 'node:readline';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';
import { CARGO_TELLS, currentWork, isProgress, print, say, track } from './progress.mjs';

/** The root of the clone. */
export const ROOT = fileURLToPath(new URL('..', import.meta.url));

/** Cargo's output folder; the tools built from `crate/xtask` lie in `tools` within. */
export const TARGET_DIR = join(ROOT, process.env.CARGO_TARGET_DIR ?? 'target');

export const WASM_TARGET = 'wasm32-unknown-unknown';
const OLDEST_NODE = 20;

/** A problem the person at the keyboard can mend: printed as it is, without a stack. */
export class StepError extends Error {}

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
 * @param {() => T | Promise<T>} action
 * @returns {Promise<T>}
 */
export async function step(title, action) {
  say(`> ${title}`);
  const start = performance.now();
  const result = currentWork() ? await action() : (await track(title, action)).result;
  say(`  ${title}: done in ${duration(performance.now() - start)}`);
  return result;
}

/**
 * Runs a command with its output passed through, but for what tells only how far it is.
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

/** Runs a command and writes the processor time of it, and of what it started and waited for, to the fourth stream. */
const TIMED = ['sh', '-c', '"$@" 3>&-; code=$?; times >&3; exit $code', 'sh'];

/**
 * Runs a command and returns its exit code and everything it printed.
 * @param {string} command
 * @param {string[]} args
 * @param {{ env?: NodeJS.ProcessEnv, cwd?: string, echo?: boolean, isUrgent?: boolean }} [options] echo: print it as it comes; what is
 * not urgent leaves the processors to the others
 * @returns {Promise<{ code: number, output: string }>}
 */
export function capture(command, args, { env = {}, cwd = ROOT, echo = false, isUrgent = true } = {}) {
  const work = currentWork();
  const isTimed = work !== undefined && process.platform !== 'win32';
  const [program = '', ...rest] = [...(isTimed ? TIMED : []), command, ...args];
  const tells = command === 'cargo' ? CARGO_TELLS : {};
  return new Promise((resolve, reject) => {
    const child = spawn(program, rest, {
      cwd,
      env: { ...process.env, ...tells, ...env },
      stdio: ['ignore', 'pipe', 'pipe', 'pipe'],
    });
    if (!isUrgent && child.pid !== undefined) setPriority(child.pid, constants.priority.PRIORITY_BELOW_NORMAL);
    /** @type {string[]} */
    const lines = [];
    let times = '';
    for (const from of [child.stdout, child.stderr]) {
      createInterface({ input: /** @type {import('node:stream').Readable} */ (from) }).on('line', (line) => {
        if (isProgress(line, work)) return;
        lines.push(line);
        if (echo) (work?.write ?? print)(`${line}\n`);
      });
    }
    child.stdio[3]?.on('data', (text) => (times += text));
    child.on('error', (error) => reject(new StepError(`\`${command}\` could not be started: ${error.message}.`)));
    child.on('close', (code) => {
      if (work) work.cpuSeconds += secondsOf(times);
      resolve({ code: code ?? 1, output: lines.map((line) => `${line}\n`).join('') });
    });
  });
}

/**
 * Of what the shell's `times` writes: a line for the shell, one for its commands, each user and system time as `0m1.50s`.
 * @param {string} times
 */
function secondsOf(times) {
  const commands = times.split('\n')[1] ?? '';
  return [...commands.matchAll(/(\d+)m([\d.]+)s/g)].reduce((sum, [, m, s]) => sum + Number(m) * 60 + Number(s), 0);
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
  say(`Node ${node}, ${cargo}`);
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
