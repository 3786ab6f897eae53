// @ts-check
/**
 * Runs the stages of `npm test` and what they need: each begins when what it needs is there and a processor is free. What a
 * stage writes is shown when it has ended, so that no two mix. A stage that fails does not stop the others.
 */
import { availableParallelism } from 'node:os';
import { print, say, track } from './progress.mjs';
import { duration, StepError } from './steps.mjs';

/**
 * What became of a stage's tests.
 * @typedef {object} Counts
 * @property {number} passed
 * @property {number} failed
 * @property {number} skipped
 * @property {string[]} [failures] for each that failed, its name and below it the first lines of the reason
 * @property {string[]} [unsteady] the same of those that passed when they were tried again
 */
/**
 * A stage, or something that stages need.
 * @typedef {object} Task
 * @property {string} name
 * @property {string} about
 * @property {readonly Task[]} [needs] what has to be done before it
 * @property {number} [busy] how many processors it keeps busy: 1 if not told, 0 for what goes on beside everything else
 * @property {string} [folder] cargo's folder, which it locks: tasks of one folder go one after the other
 * @property {() => Promise<Counts | void>} run what a stage returns is counted
 */
/** @typedef {Task & { lint?: boolean, run: () => Promise<Counts> }} Stage lint: it runs no test */
/**
 * @typedef {object} Outcome
 * @property {Counts | null} counts null for what is not counted
 * @property {boolean} failed
 * @property {number} milliseconds
 * @property {number} cpuSeconds processor time of its commands
 * @property {string} waited for what, and how long
 */

/** So much goes on at a time, in processors that it keeps busy: one more than there are, for each task waits now and then. */
export const NUM_AT_A_TIME = availableParallelism() + 1;
/** Waiting for less is not told (ms). */
const TOLD_WAIT_MS = 500;

/**
 * The tasks and all that they need, each once and after what it needs itself.
 * @param {readonly Task[]} tasks
 * @param {Set<Task>} [found]
 */
function withNeeds(tasks, found = new Set()) {
  for (const task of tasks) {
    withNeeds(task.needs ?? [], found);
    found.add(task);
  }
  return found;
}

/**
 * Does a task; what it writes is shown when it has ended.
 * @param {Task} task
 * @param {Task | undefined} lacking a need that failed
 * @returns {Promise<Omit<Outcome, 'waited'>>}
 */
async function perform({ name, about, run }, lacking) {
  /** @type {(string | Uint8Array)[]} */
  const written = [`\n=== ${name}: ${about}\n`];
  const start = performance.now();
  const action = async () => {
    try {
      if (lacking) throw new StepError(`Not run: ${lacking.name} failed.`);
      return { counts: (await run()) ?? null, failed: false };
    } catch (error) {
      say(error instanceof StepError ? error.message : String(error instanceof Error ? error.stack : error));
      return { counts: null, failed: true };
    }
  };
  const { result, work } = await track(name, action, (text) => written.push(text));
  written.forEach(print);
  return { ...result, milliseconds: performance.now() - start, cpuSeconds: work.cpuSeconds };
}

/**
 * Runs stages, those that are named first sooner, with all that they need.
 * @param {readonly Stage[]} stages
 * @returns {Promise<Map<Task, Outcome>>}
 */
export async function runStages(stages) {
  const start = performance.now();
  /** @type {Map<Task, Outcome>} */
  const outcomes = new Map();
  const waiting = withNeeds(stages);
  /** When all that a task needs was there (ms), and what came last of it. @type {Map<Task, { at: number, last: string }>} */
  const ready = new Map();
  /** @type {Map<Task, Promise<void>>} */
  const running = new Map();
  let last = '';

  const isLocked = (/** @type {Task} */ { folder }) =>
    folder !== undefined && [...running.keys()].some((other) => other.folder === folder);
  const numBusy = () => [...running.keys()].reduce((sum, { busy = 1 }) => sum + busy, 0);
  const fits = (/** @type {number} */ busy) => busy === 0 || numBusy() === 0 || numBusy() + busy <= NUM_AT_A_TIME;
  const begin = (/** @type {Task} */ task, /** @type {{ at: number, last: string }} */ { at, last }) => {
    waiting.delete(task);
    const waits = [waitFor(last, at - start), waitFor('a free processor', performance.now() - at)];
    const lacking = task.needs?.find((need) => outcomes.get(need)?.failed);
    return perform(task, lacking).then((outcome) => {
      outcomes.set(task, { ...outcome, waited: waits.filter(Boolean).join(', ') });
      running.delete(task);
    });
  };

  for (;;) {
    // One that finds too few processors free keeps later ones from taking them.
    let isFull = false;
    for (const task of waiting) {
      if (!(task.needs ?? []).every((need) => outcomes.has(need))) continue;
      const since = ready.get(task) ?? { at: performance.now(), last };
      ready.set(task, since);
      const { busy = 1 } = task;
      if (isLocked(task) || (isFull && busy > 0)) continue;
      if (fits(busy)) running.set(task, begin(task, since));
      else isFull = true;
    }
    if (running.size === 0) return outcomes;
    await Promise.race(running.values());
    last = [...outcomes.keys()].at(-1)?.name ?? '';
  }
}

/**
 * What failed, each with its stage and reason, and what failed once: the last pages of a long output are what people see.
 * @param {ReadonlyMap<Task, Outcome>} outcomes
 */
export function failuresOf(outcomes) {
  return [...outcomes].flatMap(([{ name }, { counts, failed }]) => {
    const { failures = [], unsteady = [], failed: numFailed } = counts ?? { failed: Number(failed) };
    const own = failures.length === 0 && numFailed > 0 ? ['see its output above'] : failures;
    return [
      ...own.map((text) => `failed: ${name}: ${text}`),
      ...unsteady.map((text) => `unsteady, passed when it was tried again: ${name}: ${text}`),
    ];
  });
}

/** @param {string} what @param {number} milliseconds */
function waitFor(what, milliseconds) {
  return milliseconds < TOLD_WAIT_MS ? '' : `${duration(milliseconds)} for ${what}`;
}

/**
 * The table of what was done, stages first and in their order.
 * @param {readonly Stage[]} stages
 * @param {ReadonlyMap<Task, Outcome>} outcomes
 */
export function tableOf(stages, outcomes) {
  const others = [...outcomes.keys()].filter((task) => !stages.some((stage) => stage === task));
  return [...stages, ...others].flatMap((task) => {
    const outcome = outcomes.get(task);
    return outcome ? [row(task.name, outcome)] : [];
  });
}

/** @param {string} name @param {Outcome} outcome */
function row(name, { counts, failed, milliseconds, cpuSeconds, waited }) {
  const { passed, skipped, failed: numFailed } = counts ?? { passed: null, failed: Number(failed), skipped: 0 };
  const cells = [
    passed === null ? '' : `${passed} passed`,
    passed === null && !failed ? '' : `${numFailed} failed`,
    skipped > 0 ? `${skipped} skipped` : '',
    duration(milliseconds),
    cpuSeconds > 0 ? `${cpuSeconds.toFixed(0)} s of processor time` : '',
  ];
  const widths = [12, 11, 12, 13, 26];
  const line = `${name.padEnd(14)}${cells.map((cell, index) => cell.padStart(widths[index] ?? 0)).join('')}`;
  return (waited === '' ? line : `${line}  waited ${waited}`).trimEnd();
}

/** The last line: `N passed, N failed`, and `N skipped`, `N unsteady` where there are such. @param {Iterable<Outcome>} outcomes */
export function sumOf(outcomes) {
  const sum = { passed: 0, failed: 0, skipped: 0, unsteady: 0 };
  for (const { counts, failed: hasFailed } of outcomes) {
    const { passed, failed, skipped, unsteady = [] } = counts ?? { passed: 0, failed: Number(hasFailed), skipped: 0 };
    sum.passed += passed;
    sum.failed += failed;
    sum.skipped += skipped;
    sum.unsteady += unsteady.length;
  }
  const { passed, failed, ...rare } = sum;
  const told = Object.entries(rare).flatMap(([word, count]) => (count > 0 ? [`, ${count} ${word}`] : []));
  return { failed, line: `${passed} passed, ${failed} failed${told.join('')}` };
}
