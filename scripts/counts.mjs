// @ts-check
/** Counts of passed, failed and skipped tests, from the output of the test runners. */
import { say } from './progress.mjs';

/** @typedef {import('./stages.mjs').Counts} Counts */

/**
 * Of `cargo test` and `wasm-pack test`. A Rust test that lacks a recording passes for cargo and prints a line by which it counts as
 * skipped (tests/native/common.rs). What is ignored is skipped as well.
 * @param {string} output
 * @returns {Counts}
 */
export function countCargo(output) {
  const counts = { passed: 0, failed: 0, skipped: 0 };
  for (const [, passed, failed, ignored] of output.matchAll(
    /^test result: .*?(\d+) passed; (\d+) failed; (?:(\d+) ignored;)?/gm,
  )) {
    counts.passed += Number(passed);
    counts.failed += Number(failed);
    counts.skipped += Number(ignored ?? 0);
  }
  const lacking = output.match(/skipped: \S+ is absent$/gm)?.length ?? 0;
  return { ...counts, passed: counts.passed - lacking, skipped: counts.skipped + lacking };
}

/**
 * One check: that a compilation ends well and warns of nothing. That cargo asks the network again is no warning of the compiler.
 * @param {{ code: number, output: string }} compilation
 * @returns {Counts}
 */
export function noWarnings({ code, output }) {
  const isClean = code === 0 && !/^warning(?!: spurious network error)/m.test(output);
  return { passed: Number(isClean), failed: Number(!isClean), skipped: 0 };
}

/**
 * Of `node --test` with the reporter `spec`.
 * @param {string} output
 * @returns {Counts}
 */
export function countNode(output) {
  const count = (/** @type {string} */ word) => Number(output.match(new RegExp(`^ℹ ${word} (\\d+)$`, 'm'))?.[1] ?? 0);
  return {
    passed: count('pass'),
    failed: count('fail') + count('cancelled'),
    skipped: count('skipped') + count('todo'),
  };
}

/**
 * Of Playwright's reporter `json`.
 * @param {string} report
 * @returns {Counts}
 */
export function countPlaywright(report) {
  const { expected, unexpected, flaky, skipped } = JSON.parse(report).stats;
  return { passed: expected, failed: unexpected + flaky, skipped };
}

/**
 * A runner that failed without naming a test, or ran none, has failed once.
 * @param {Counts} counts
 * @param {number} code the runner's exit code
 * @returns {Counts}
 */
export function believe(counts, code) {
  if (counts.failed > 0 || (code === 0 && counts.passed > 0)) return counts;
  if (code === 0) say('No test was run.');
  return { ...counts, failed: 1 };
}
