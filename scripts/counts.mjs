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
  const failures = [...output.matchAll(/^---- (\S+) stdout ----\n([^]*?)(?=^---- |^failures:)/gm)];
  return {
    passed: counts.passed - lacking,
    failed: counts.failed,
    skipped: counts.skipped + lacking,
    failures: failures.map(([, name = '', reason = '']) => failure(name, reason)),
  };
}

/**
 * One check: that a compilation ends well and warns of nothing. That cargo asks the network again is no warning of the compiler.
 * @param {{ code: number, output: string }} compilation
 * @returns {Counts}
 */
export function noWarnings({ code, output }) {
  const found = output.match(/^(?:warning(?!: spurious network error)|error).*(?:\n +--> .*)?/gm) ?? [];
  const isClean = code === 0 && !found.some((text) => text.startsWith('warning'));
  const failures = isClean ? [] : [failure(`${found.length} warnings and errors`, found.join('\n'))];
  return { passed: Number(isClean), failed: Number(!isClean), skipped: 0, failures };
}

/**
 * Of `node --test` with the reporter `spec`.
 * @param {string} output
 * @returns {Counts}
 */
export function countNode(output) {
  const count = (/** @type {string} */ word) => Number(output.match(new RegExp(`^ℹ ${word} (\\d+)$`, 'm'))?.[1] ?? 0);
  const [, told = ''] = output.split(/^✖ failing tests:$/m);
  const failures = [...told.matchAll(/^test at (\S+)\n✖ (.*?)(?: \([\d.]+ms\))?\n([^]*?)(?=^test at |(?![^]))/gm)];
  return {
    passed: count('pass'),
    failed: count('fail') + count('cancelled'),
    skipped: count('skipped') + count('todo'),
    failures: failures.map(([, place = '', name = '', reason = '']) => failure(`${place} ${name}`, reason)),
  };
}

/**
 * Of Playwright's reporter `json`.
 * @param {string} report
 * @returns {Counts}
 */
export function countPlaywright(report) {
  const { stats, suites } = JSON.parse(report);
  const { expected, unexpected, flaky, skipped } = stats;
  return { passed: expected, failed: unexpected + flaky, skipped, failures: playwrightFailures({ suites }) };
}

/**
 * @typedef {object} Suite as Playwright reports a file or a group of tests
 * @property {Suite[]} [suites]
 * @property {{ file: string, line: number, title: string, ok: boolean, tests: { results: Try[] }[] }[]} [specs]
 */
/** @typedef {{ errors?: { message?: string }[] }} Try */

/** @param {Suite} suite @returns {string[]} */
function playwrightFailures({ suites = [], specs = [] }) {
  const own = specs
    .filter(({ ok }) => !ok)
    .map(({ file, line, title, tests }) => {
      const errors = tests.flatMap(({ results }) => results.at(-1)?.errors ?? []);
      return failure(`${file}:${line} ${title}`, errors.map(({ message = '' }) => message).join('\n'));
    });
  return [...own, ...suites.flatMap(playwrightFailures)];
}

/** The colours that runners print, and what else a terminal alone understands. */
const ESCAPES = /\u001B\[[\d;?]*[A-Za-z]/g;
/** What went wrong stands in the first lines: the stage's own output has the rest. */
const LINES_OF_FAILURE = 12;

/** @param {string} name @param {string} reason */
function failure(name, reason) {
  const lines = reason
    .replace(ESCAPES, '')
    .split('\n')
    .filter((line) => line.trim() !== '' && !/^ +at .*node:/.test(line));
  return [name, ...lines.slice(0, LINES_OF_FAILURE).map((line) => `    ${line}`)].join('\n');
}

/**
 * The counts after the tests that failed have been run a second time: one that passes then is unsteady, which is reported and does
 * not fail the run.
 * @param {Counts} first
 * @param {Counts} second
 * @returns {Counts}
 */
export function afterSecondTry(first, second) {
  if (second.passed + second.failed !== first.failed) return first; // it tried something else
  const { failures: again = [] } = second;
  const nameOf = (/** @type {string} */ text) => text.split('\n')[0];
  const stay = new Set(again.map(nameOf));
  return {
    ...first,
    passed: first.passed + second.passed,
    failed: second.failed,
    failures: again,
    unsteady: (first.failures ?? []).filter((text) => !stay.has(nameOf(text))),
  };
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
