// @ts-check
/**
 * Runs the stages of `npm test`: some one after the other, some side by side, each with its counts, its duration and the
 * processor time of its commands. A stage that fails does not stop the others.
 */
import { account, duration, StepError, say } from './steps.mjs';

/** @typedef {{ passed: number, failed: number, skipped: number }} Counts */
/**
 * @typedef {object} Stage
 * @property {string} name
 * @property {string} about
 * @property {boolean} [lint] it runs no test
 * @property {boolean} [beside] it may go on beside the stages that compile Rust: it uses nothing that they write
 * @property {boolean} [last] it needs both processors to itself
 * @property {(() => Promise<void>)[]} [needs] each is done once, by the first stage that needs it
 * @property {() => Promise<Counts>} run
 */
/** @typedef {Counts & { milliseconds: number, cpuSeconds: number }} Outcome */

/** @type {Map<() => Promise<void>, Promise<void>>} */
const met = new Map();

/**
 * @param {Stage} stage
 * @returns {Promise<Counts>}
 */
async function countsOf(stage) {
  try {
    for (const need of stage.needs ?? []) {
      const done = met.get(need) ?? need();
      met.set(need, done);
      await done;
    }
    return await stage.run();
  } catch (error) {
    say(error instanceof StepError ? error.message : String(error instanceof Error ? error.stack : error));
    return { passed: 0, failed: 1, skipped: 0 };
  }
}

/**
 * @param {Stage} stage
 * @param {(text: string | Uint8Array) => void} write
 * @returns {Promise<Outcome>}
 */
async function runStage(stage, write) {
  const own = { write, cpuSeconds: 0 };
  return account.run(own, async () => {
    say(`\n=== ${stage.name}: ${stage.about}`);
    const start = performance.now();
    const counts = await countsOf(stage);
    const outcome = { ...counts, milliseconds: performance.now() - start, cpuSeconds: own.cpuSeconds };
    say(row(stage.name, outcome));
    return outcome;
  });
}

/**
 * Runs stages and tells what each came to, in the order in which they were given.
 * @param {readonly Stage[]} stages
 * @param {Map<string, Outcome>} outcomes filled as stages end
 */
export async function runStages(stages, outcomes) {
  const live = (/** @type {string | Uint8Array} */ text) => process.stdout.write(text);
  const first = stages.filter(({ beside, last }) => !beside && !last);
  const beside = stages.filter(({ beside }) => beside);
  const run = async (/** @type {readonly Stage[]} */ lane, /** @type {boolean} */ isLive) => {
    for (const stage of lane) {
      /** @type {(string | Uint8Array)[]} */
      const written = [];
      const write = isLive ? live : (/** @type {string | Uint8Array} */ text) => written.push(text);
      outcomes.set(stage.name, await runStage(stage, write));
      for (const text of written) live(text);
    }
  };
  // What goes on beside others is shown when it is over, so that no two mix.
  await Promise.all([run(first, true), run(beside, first.length === 0)]);
  await run(
    stages.filter(({ last }) => last),
    true,
  );
  return stages.flatMap(({ name }) => {
    const outcome = outcomes.get(name);
    return outcome ? [row(name, outcome)] : [];
  });
}

/** @param {string} name @param {Outcome} outcome */
function row(name, { passed, failed, skipped, milliseconds, cpuSeconds }) {
  const cells = [
    `${passed} passed`.padStart(12),
    `${failed} failed`.padStart(10),
    (skipped > 0 ? `${skipped} skipped` : '').padStart(12),
    duration(milliseconds).padStart(13),
    cpuSeconds > 0 ? `${cpuSeconds.toFixed(0)} s of processor time`.padStart(26) : '',
  ];
  return `${name.padEnd(12)}${cells.join('')}`.trimEnd();
}

/** The last line: `N passed, N failed`, and `N skipped` where there are such. @param {Iterable<Outcome>} outcomes */
export function sumOf(outcomes) {
  const sum = { passed: 0, failed: 0, skipped: 0 };
  for (const { passed, failed, skipped } of outcomes) {
    sum.passed += passed;
    sum.failed += failed;
    sum.skipped += skipped;
  }
  const { passed, failed, skipped } = sum;
  return { failed, line: `${passed} passed, ${failed} failed${skipped > 0 ? `, ${skipped} skipped` : ''}` };
}
