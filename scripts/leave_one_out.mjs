// @ts-check
/**
 * How much the laser pipeline depends on each of its thresholds, and what each log would get had its thresholds been chosen without
 * it: `node scripts/leave_one_out.mjs [--thresholds 1,2,...] [--scratch FOLDER] [--data FOLDER]`.
 *
 * In a copy of the sources each threshold below is multiplied by a factor from the environment: 0.7 and 1.4, one threshold at a time.
 * `laser_scores` runs all logs with odometry. Then, for each log, every threshold gets the factor with which the other logs score best together (fewest falsely good
 * pairs, then fewest wrong pairs, then most good frames; 1 where nothing is better), and that log runs with all of them at once.
 * Printed as tables in Markdown. With `--scratch` the copy and the results stay in that folder, and a run that was stopped goes on.
 *
 * The thresholds are those that decide whether a registration is good, doubtful or lost, which loops are accepted, which scans are
 * matched in the joint solution, and what is certain enough for one piece. A share of agreement is scaled by what is left to 1: that is
 * what may disagree. Not among them are budgets (they bound time), thresholds that only choose where to look (a search that ends
 * earlier loses good frames, and accepts nothing more) and limits of what is detected before a run (mirror images, clocks, units).
 */
import { execFileSync } from 'node:child_process';
import { cpSync, existsSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { parseArgs } from 'node:util';

const FACTORS = [0.7, 1.4];
/** What cargo needs to build the program. */
const SOURCES = ['Cargo.toml', 'Cargo.lock', '.cargo', 'README.md', 'crate'];

/**
 * @typedef {{ file: string, name: string, field?: string, as?: 'share' | 'scaled' }} Constant A `share` is scaled by what is left to 1.
 * @typedef {{ means: string, constants: Constant[] }} Threshold
 */

const ASSESSMENT = 'odometry/planar/assess.rs';
const MEASURED = 'odometry/planar/measured.rs';
const MODEL = 'odometry/planar/odometry_model.rs';
const LOOPS = 'graph/loops/planar';

/** @type {Threshold[]} */
const THRESHOLDS = [
  {
    means: 'disagreement that makes a registration doubtful',
    constants: [{ file: ASSESSMENT, name: 'PLANAR_LIMITS', field: 'doubtful_agreement', as: 'share' }],
  },
  {
    means: 'disagreement that makes it lost',
    constants: [{ file: ASSESSMENT, name: 'PLANAR_LIMITS', field: 'lost_agreement', as: 'share' }],
  },
  {
    means: 'difference of ranges that agree',
    constants: [
      { file: 'registration/free_space/beams.rs', name: 'MIN_TOLERANCE' },
      { file: 'registration/free_space/beams.rs', name: 'RELATIVE_TOLERANCE' },
    ],
  },
  {
    means: 'slip beyond the gate',
    constants: [
      { file: MEASURED, name: 'MAX_SLIP' },
      { file: MEASURED, name: 'SLIP_SHARE' },
    ],
  },
  {
    means: 'difference by which another pose fits as well',
    constants: [{ file: 'odometry/planar/hypothesis.rs', name: 'RIVAL_DISAGREEMENT' }],
  },
  {
    means: 'steps and stretches that contradict the odometry',
    constants: [{ file: MODEL, name: 'CONTRADICTS' }],
  },
  {
    means: 'what is certain enough for one piece',
    constants: [{ file: 'odometry/planar/information.rs', name: 'CERTAIN_SIGMA' }],
  },
  {
    means: 'noise of normals',
    constants: [{ file: 'odometry/planar/information.rs', name: 'NORMALS_NOISE' }],
  },
  {
    means: 'disagreement of a loop',
    constants: [{ file: `${LOOPS}/trial.rs`, name: 'MIN_AGREEMENT', as: 'share' }],
  },
  {
    means: 'score of a loop',
    constants: [{ file: `${LOOPS}/matching.rs`, name: 'MIN_SCORE' }],
  },
  {
    means: 'windows in which a loop needs support',
    constants: [
      { file: `${LOOPS}/acceptance.rs`, name: 'MAX_WINDOW_ALONE' },
      { file: `${LOOPS}/acceptance.rs`, name: 'MAX_WINDOW_IN_PAIRS' },
    ],
  },
  {
    means: 'cycles by which loops support each other',
    constants: [{ file: `${LOOPS}/consistency.rs`, name: 'MAX_CYCLE_SIGMA' }],
  },
  {
    means: 'overlap of a registration, of a match and of scans in the joint solution',
    constants: [{ file: ASSESSMENT, name: 'MIN_OVERLAP' }],
  },
];

/** What is added to the copy. */
const FACTORS_OF_ENVIRONMENT = `
/// Factors of thresholds.
pub mod factors {
    use std::sync::OnceLock;

    static FACTORS: OnceLock<Vec<f64>> = OnceLock::new();

    fn factor(threshold: usize) -> f64 {
        let read = || std::env::var("FACTORS").map(|all| all.split(' ').map(|word| word.parse().unwrap()).collect());
        FACTORS.get_or_init(|| read().unwrap_or_default()).get(threshold).copied().unwrap_or(1.0)
    }

    /// A value times the factor.
    pub fn scaled(threshold: usize, value: f64) -> f64 {
        value * factor(threshold)
    }

    /// A share whose rest to 1 is multiplied by the factor.
    pub fn share(threshold: usize, value: f64) -> f64 {
        1.0 - (1.0 - value) * factor(threshold)
    }
}
`;

/** What has to be there. @template T @param {T | undefined} value @returns {T} */
function known(value) {
  if (value === undefined) throw new Error('Neither the sources nor laser_scores are as this script expects them.');
  return value;
}

/** The declaration of a constant: visibility, name, type, value. @param {string} name */
const declaration = (name) => new RegExp(`^(pub(?:\\([a-z]+\\))? |)const (${name}): ([^=]+) =(\\s[^;]*);$`, 'm');

/**
 * The text of a file in which the value of a constant, or of a field of it, is multiplied by the factor of a threshold.
 * @param {string} text @param {Constant} constant @param {number} threshold
 */
function multiplied(text, { name, field, as = 'scaled' }, threshold) {
  const times = (/** @type {string} */ value) => {
    // A name stands for a number that others share; what is computed is multiplied as a whole, each of a pair.
    const whole = (/** @type {string} */ part) => ` crate::factors::${as}(${threshold}, ${part.trim()})`;
    const [, pair] = value.match(/^\s*\(([^{}]*)\)$/) ?? [];
    if (/^[^{}]*\b[A-Z][A-Z_]+\b/.test(value))
      return pair ? ` (${pair.split(',').map(whole).join(',')})` : whole(value);
    return value.replace(/\d+(?:\.\d+)?/g, (number) => {
      const isWhole = !number.includes('.');
      const scaled = `crate::factors::${as}(${threshold}, ${number}${isWhole ? '.0' : ''})`;
      return isWhole ? `${scaled}.round() as usize` : scaled;
    });
  };
  const [all, visibility, , type, whole] = text.match(declaration(name))?.map(String) ?? [];
  const ofField = new RegExp(`(\\b${field}: )([\\w.]+)`);
  const value = field
    ? known(whole).replace(ofField, (_, before, number) => before + times(number))
    : times(known(whole));
  return text.replace(known(all), () => `${visibility}const ${name}: ${type} =${value};`);
}

/** The text of a file with a constant as a function, for its value is no constant any more. @param {string} text @param {string} name */
function asFunction(text, name) {
  const uses = new RegExp(`(?<!//.*|^use .*|const )\\b${name}\\b`, 'gm');
  return text.replace(uses, `${name}()`).replace(declaration(name), '$1fn $2() -> $3 {$4}');
}

/**
 * @typedef {{ pairs: number, wrong: number, believed: number, falsely: number, mean: number }} Score
 * @typedef {{ scans: number, good: number, scores: Score[] }} LogScore
 * @typedef {Record<string, LogScore>} Scores by log
 */

/** What `laser_scores` prints. @param {string} text @returns {Scores} */
function parsed(text) {
  /** @type {Scores} */
  const scores = {};
  let log = '';
  for (const line of text.split('\n')) {
    const head = line.match(/^(\S+) +odometry +(\d+) scans.* good (\d+) doubtful/);
    const row = line.match(
      /(\d+) pairs, wrong +([\d.]+) %.* mean ([\d.]+) \+- [\d.]+ m .*; good pairs (\d+), false ([\d.]+) %/,
    );
    if (head) {
      log = known(head[1]);
      scores[log] = { scans: Number(head[2]), good: Number(head[3]), scores: [] };
    } else if (row) {
      const [pairs = NaN, wrong = NaN, mean = NaN, believed = NaN, falsely = NaN] = row.slice(1).map(Number);
      const count = (/** @type {number} */ share, /** @type {number} */ of) => Math.round((share * of) / 100);
      known(scores[log]).scores.push({
        pairs,
        wrong: count(wrong, pairs),
        believed,
        falsely: count(falsely, believed),
        mean,
      });
    }
  }
  return scores;
}

const { values } = parseArgs({
  options: {
    scratch: { type: 'string' },
    thresholds: { type: 'string' },
    data: { type: 'string', default: '../shared/data/laser' },
  },
});
const scratch = values.scratch ?? mkdtempSync(join(tmpdir(), 'leave-one-out-'));
mkdirSync(scratch, { recursive: true });
const resultsFile = join(scratch, 'results.json');
/** @type {Record<string, Scores>} */
const results = existsSync(resultsFile) ? JSON.parse(readFileSync(resultsFile, 'utf8')) : {};
const program = join(scratch, 'target/quick/scanstitch-measure');
if (!existsSync(program)) {
  for (const file of SOURCES) cpSync(file, join(scratch, file), { recursive: true });
  const source = (/** @type {string} */ file) => join(scratch, 'crate/src', file);
  const edit = (/** @type {string} */ file, /** @type {(text: string) => string} */ edited) =>
    writeFileSync(source(file), edited(readFileSync(source(file), 'utf8')));
  edit('lib.rs', (text) => `#![allow(non_snake_case)]\n${text}${FACTORS_OF_ENVIRONMENT}`);
  const files = readdirSync(source('.'), { recursive: true, encoding: 'utf8' }).filter((path) => path.endsWith('.rs'));
  THRESHOLDS.forEach(({ constants }, threshold) => {
    for (const constant of constants) edit(constant.file, (text) => multiplied(text, constant, threshold));
  });
  const constants = THRESHOLDS.flatMap(({ constants }) => constants);
  for (const { file, name } of new Map(constants.map((one) => [`${one.file} ${one.name}`, one])).values()) {
    const isOpen = Boolean(readFileSync(source(file), 'utf8').match(declaration(name))?.[1]);
    // Others of the same name are something else.
    for (const other of isOpen ? files : [file]) {
      edit(other, (text) =>
        other === file || !new RegExp(`const ${name}:`).test(text) ? asFunction(text, name) : text,
      );
    }
  }
  const build = ['build', '--quiet', '--profile', 'quick', '--package', 'scanstitch-measure'];
  execFileSync('cargo', build, { cwd: scratch, stdio: ['ignore', process.stderr, 'inherit'] });
}

/**
 * Scores of the logs with a factor for each threshold. @param {number[]} factors @param {string} [only] a log
 * @returns {Scores}
 */
function scored(factors, only) {
  const key = `${only ?? 'all'} ${factors.join(' ')}`;
  if (!results[key]) {
    const run = ['laser_scores', '--mode', 'odometry', '--data', values.data, ...(only ? ['--only', only] : [])];
    const env = { ...process.env, FACTORS: factors.join(' ') };
    results[key] = parsed(execFileSync(program, run, { encoding: 'utf8', maxBuffer: 1 << 26, env }));
    writeFileSync(resultsFile, JSON.stringify(results));
    console.error(`${Object.keys(results).length} runs: ${key}`);
  }
  return results[key];
}

/** @param {LogScore} score */
function cell({ scans, good, scores }) {
  const pairs = scores.map(({ wrong, pairs, falsely }) => `${wrong}/${falsely} of ${pairs}`);
  return `${good} of ${scans}; ${pairs.join(', ')}; ${known(scores[0]).mean.toFixed(3)} m`;
}

/** Falsely good pairs, wrong pairs and frames that are not good, over some logs: less is better, the first first. @param {LogScore[]} scores */
function faults(scores) {
  const sum = (/** @type {(score: Score) => number} */ of) =>
    scores.flatMap((score) => score.scores.map(of)).reduce((a, b) => a + b, 0);
  const left = scores.reduce((all, { scans, good }) => all + scans - good, 0);
  return [sum((score) => score.falsely), sum((score) => score.wrong), left];
}

/** @param {number[]} a @param {number[]} b */
function isLess(a, b) {
  const at = a.findIndex((value, index) => value !== b[index]);
  return at >= 0 && known(a[at]) < known(b[at]);
}

const wanted = values.thresholds?.split(',').map((number) => Number(number) - 1) ?? [...THRESHOLDS.keys()];
if (wanted.some((index) => !THRESHOLDS[index])) throw new Error(`--thresholds: numbers from 1 to ${THRESHOLDS.length}`);
const usual = THRESHOLDS.map(() => 1);
const asItIs = scored(usual);
const logs = Object.keys(asItIs);
/** For each threshold its scores by factor. @type {Map<number, Scores>[]} */
const byFactor = THRESHOLDS.map((_, index) => {
  if (!wanted.includes(index)) return new Map([[1, asItIs]]);
  const one = (/** @type {number} */ factor) => usual.map((usually, at) => (at === index ? factor : usually));
  return new Map([[1, asItIs], ...FACTORS.map((factor) => /** @type {const} */ ([factor, scored(one(factor))]))]);
});

const row = (/** @type {string[]} */ cells) => console.log(`| ${cells.join(' | ')} |`);
const rule = (/** @type {number} */ count) => row(Array.from({ length: count }, () => '---'));
console.log('Good frames; wrong/falsely good of all pairs, by places and by stretches; mean error of the first.\n');
row(['threshold', 'factor', ...logs]);
rule(logs.length + 2);
row(['as it is', '1', ...logs.map((log) => cell(known(asItIs[log])))]);
for (const index of wanted) {
  for (const factor of FACTORS) {
    const scores = byFactor[index]?.get(factor) ?? asItIs;
    const cells = logs.map((log) => {
      const [now, before] = [cell(known(scores[log])), cell(known(asItIs[log]))];
      return now === before ? '=' : now;
    });
    row([known(THRESHOLDS[index]).means, `${factor}`, ...cells]);
  }
}

console.log('\nEach log with every threshold chosen on the other logs:\n');
row(['log', 'as it is', 'chosen on the others', 'factors other than 1']);
rule(4);
for (const log of logs) {
  const others = (/** @type {Scores} */ scores) =>
    logs.filter((other) => other !== log).map((other) => known(scores[other]));
  const factors = byFactor.map((scores) => {
    let best = 1;
    for (const factor of scores.keys()) {
      const faultsBy = (/** @type {number} */ of) => faults(others(scores.get(of) ?? asItIs));
      if (isLess(faultsBy(factor), faultsBy(best))) best = factor;
    }
    return best;
  });
  const changed = THRESHOLDS.flatMap(({ means }, index) =>
    factors[index] === 1 ? [] : [`${means} x ${factors[index]}`],
  );
  row([log, cell(known(asItIs[log])), cell(known(scored(factors, log)[log])), changed.join(', ') || 'none']);
}
if (!values.scratch) rmSync(scratch, { recursive: true });
