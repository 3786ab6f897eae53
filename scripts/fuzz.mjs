// @ts-check
/**
 * `npm run fuzz -- [--time SECONDS] [--seed N] [TARGET]...`: gives every reader damaged input for that time, each target in a
 * process of its own with limited memory. A damaged file must lead to an error about the file. A fault is printed with its seed and
 * kept under target/fuzz, and the exit code is 1.
 */
import { spawnSync } from 'node:child_process';
import { existsSync, mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { MemoryPeak } from './fuzz/memory.mjs';
import { Random } from './fuzz/random.mjs';
import { say } from './progress.mjs';
import { answers, readArguments, ROOT, runMain, StepError } from './steps.mjs';

/** Targets in Node, by their modules. @type {Record<string, [module: string, name: string]>} */
const NODE_TARGETS = {
  messages: ['./fuzz/bags.mjs', 'messages'],
  bags: ['./fuzz/bags.mjs', 'bags'],
  zips: ['./fuzz/files.mjs', 'zips'],
  classification: ['./fuzz/files.mjs', 'classification'],
  conversion: ['./fuzz/conversion.mjs', 'conversion'],
  arguments: ['./fuzz/arguments.mjs', 'commandLine'],
  signals: ['./fuzz/signals.mjs', 'signals'],
};
/** Targets that are scripts of their own. */
const SCRIPT_TARGETS = { page: 'fuzz_page.mjs' };
const NATIVE_TARGETS = ['ply', 'pcd', 'images', 'trajectory', 'laser_log'];
/** A single allocation of the native targets, for inputs of 4 KiB; a packed image may have as many pixels as a screen (MB). */
const MOST_AT_ONCE = { others: 1, images: 64 };
/** Of the processor, for an input of a few kilobytes, also while the machine is busy. */
const MOST_SECONDS = 5;
const FOUND = join(ROOT, 'target', 'fuzz');
/** Environment variable that gives a child process its target, seconds and seed. */
const CHILD = 'SCANSTITCH_FUZZ';

/** Runs one target in this process. @param {string} target @param {number} seconds @param {number} seed */
async function fuzz(target, seconds, seed) {
  const [module, name] = NODE_TARGETS[target] ?? ['', ''];
  const round = (await import(module))[name];
  const memory = new MemoryPeak();
  const end = performance.now() + 1000 * seconds;
  let [rounds, largest] = [0, 0];
  for (; performance.now() < end; rounds += 1) {
    const random = new Random(seed + rounds);
    const before = process.cpuUsage();
    try {
      const { length } = await round(random);
      largest = Math.max(largest, length);
      memory.check(length, seed + rounds);
      const { user, system } = process.cpuUsage(before);
      const spent = 1e-6 * (user + system);
      if (spent > MOST_SECONDS) throw new Error(`it took ${spent.toFixed(1)} s of the processor`);
    } catch (error) {
      mkdirSync(FOUND, { recursive: true });
      const kept = join(FOUND, `${target}-${seed + rounds}.txt`);
      const { stack, cause } = /** @type {Error} */ (error);
      writeFileSync(kept, `${stack}\n${cause instanceof Error ? cause.stack : ''}\n`);
      console.log(`${target}: seed ${seed + rounds}\n${stack}\n${cause instanceof Error ? cause.stack : ''}`);
      process.exitCode = 1;
      return;
    }
  }
  console.log(
    `${target}: ${rounds} inputs of at most ${largest} bytes in ${seconds} s, from seed ${seed} on: clean; ${memory.told()}`,
  );
}

/** Whether it found nothing. @param {string} target @param {number} seconds @param {number} seed */
function inNode(target, seconds, seed) {
  const env = { ...process.env, [CHILD]: JSON.stringify([target, seconds, seed]) };
  const timeout = 1000 * (2 * seconds + 60);
  const { status, signal } = spawnSync(process.execPath, ['--expose-gc', join(ROOT, 'scripts', 'fuzz.mjs')], {
    env,
    stdio: 'inherit',
    timeout,
  });
  if (signal) say(`${target}: it hung and was ended by ${signal}; from seed ${seed} on`);
  return status === 0;
}

/** Whether it found nothing. @param {string} target @param {number} seconds */
function native(target, seconds) {
  const folder = join(ROOT, 'crate', 'fuzz');
  if (!existsSync(join(folder, 'corpus'))) spawnSync(process.execPath, ['seeds.mjs'], { cwd: folder });
  const most = target === 'images' ? MOST_AT_ONCE.images : MOST_AT_ONCE.others;
  const limits = ['-max_len=4096', `-malloc_limit_mb=${most}`, '-rss_limit_mb=1024', `-max_total_time=${seconds}`];
  // The decoder of JPEG pictures does not wait for its threads; what these still hold would count as leaked.
  if (target === 'images') limits.push('-detect_leaks=0');
  const dictionary = existsSync(join(folder, `${target}.dict`)) ? [`-dict=${target}.dict`] : [];
  const { status } = spawnSync(
    'cargo',
    ['+nightly', 'fuzz', 'run', target, '--fuzz-dir', '.', '--', ...limits, ...dictionary],
    {
      cwd: folder,
      stdio: 'inherit',
      // The trace of a panic takes more memory at once than the limit allows, and would be told as that.
      env: { ...process.env, RUST_BACKTRACE: '0' },
    },
  );
  return status === 0;
}

async function main() {
  const options = /** @type {const} */ ({
    time: { type: 'string', default: '60' },
    seed: { type: 'string', default: '1' },
  });
  const { values, positionals } = readArguments(
    { options, allowPositionals: true },
    'Usage: npm run fuzz -- [--time SECONDS a target] [--seed N] [TARGET]...',
  );
  const scripts = new Map(Object.entries(SCRIPT_TARGETS));
  const all = [...Object.keys(NODE_TARGETS), ...scripts.keys(), ...NATIVE_TARGETS];
  const unknown = positionals.find((name) => !all.includes(name));
  if (unknown !== undefined) throw new StepError(`No target is called ${unknown}. There are: ${all.join(', ')}.`);
  const [seconds, seed] = [Number(values.time), Number(values.seed)];
  if (!(seconds > 0) || !Number.isInteger(seed))
    throw new StepError('--time is a number of seconds, --seed a whole number.');
  const hasNative = answers('cargo', ['+nightly', 'fuzz', '--version']);
  for (const target of positionals.length > 0 ? positionals : all) {
    const script = scripts.get(target);
    if (script !== undefined) {
      const args = [join(ROOT, 'scripts', script), '--time', values.time, '--seed', values.seed];
      if (spawnSync(process.execPath, args, { stdio: 'inherit' }).status !== 0) process.exitCode = 1;
    } else if (!NATIVE_TARGETS.includes(target)) {
      if (!inNode(target, seconds, seed)) process.exitCode = 1;
    } else if (!hasNative)
      say(`${target}: skipped; it needs a nightly compiler and: cargo install cargo-fuzz --locked`);
    else if (!native(target, seconds)) process.exitCode = 1;
  }
}

const order = process.env[CHILD];
if (order === undefined) await runMain(main);
else await fuzz(.../** @type {[string, number, number]} */ (JSON.parse(order)));
