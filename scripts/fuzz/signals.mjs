// @ts-check
/** SIGINT and SIGTERM at random times, over every command: whatever file exists afterwards is whole, and no other is left. */
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { existsSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { setTimeout as sleep } from 'node:timers/promises';
import { bev_presets, load } from '../../npm/index.js';
import { walkFiles } from '../../tests/cli/depth_room.mjs';
import { DEADLINE_MS, roomScan, ROOT, SAMPLES } from '../../tests/cli/support.mjs';

/** @typedef {import('./random.mjs').Random} Random */
/** `args`: for a folder to write into; `writes`: the files that it then holds. @typedef {{ args: (out: string) => string[], writes: string[] }} Run */

const CLI = join(ROOT, 'npm', 'cli.js');
const RECONSTRUCTED = ['map.ply', 'report.html', 'report.json', 'trajectory.tum'];
/** Done, nothing, partly; and as a shell tells of SIGINT and SIGTERM. */
const EXIT_CODES = [0, 1, 2, 130, 143];
/** A second signal, which ends the program at once, comes so much later at most (ms). */
const SECOND_MS = 300;

/** Checks that a file is complete, by its name. @param {string} path */
export function assertWhole(path) {
  const bytes = readFileSync(path);
  const text = bytes.toString('latin1');
  const ending = path.slice(path.lastIndexOf('.') + 1);
  const lines = text.trimEnd().split('\n');
  if (ending === 'json') JSON.parse(text);
  else if (ending === 'html') assert.match(text, /^<!doctype html>[^]*<\/html>\n$/i, path);
  else if (ending === 'png') assert.equal(bytes.toString('latin1', bytes.length - 8, bytes.length - 4), 'IEND', path);
  else if (ending === 'ply') {
    const [header = ''] = text.split('end_header\n');
    const count = Number(header.match(/element vertex (\d+)/)?.[1]);
    const types = [...header.matchAll(/property (\w+)/g)].map(([, type]) => (type === 'uchar' ? 1 : 4));
    const bytesEach = types.reduce((sum, size) => sum + size, 0);
    assert.equal(bytes.length, header.length + 'end_header\n'.length + bytesEach * count, path);
  } else if (ending === 'pgm') {
    const [head = '', width, height] = text.match(/^P5\n(?:#.*\n)*(\d+) (\d+)\n255\n/) ?? [];
    assert.equal(bytes.length, head.length + Number(width) * Number(height), path);
  } else {
    assert.ok(text.endsWith('\n'), `${path} is cut off`);
    const columns = { tum: [' ', 8], kitti: [' ', 12], csv: [',', lines[0]?.split(',').length] }[ending];
    const [separator = '', count] = /** @type {[string, number] | undefined} */ (columns) ?? [];
    const rows = lines.filter((line) => line !== '' && !line.startsWith('#'));
    if (columns)
      assert.ok(
        rows.every((row) => row.split(separator).length === count),
        path,
      );
  }
}

/** The files of a folder, each of them whole. @param {string} folder @returns {string[]} their names */
export function wholeFiles(folder) {
  const names = existsSync(folder) ? readdirSync(folder).sort() : [];
  for (const name of names) assertWhole(join(folder, name));
  return names;
}

/** What the commands work on: so small that a round takes a second. @param {string} folder */
function prepareInputs(folder) {
  const write = (/** @type {string} */ name, /** @type {string | Uint8Array} */ contents) => {
    mkdirSync(dirname(join(folder, name)), { recursive: true });
    writeFileSync(join(folder, name), contents);
  };
  for (let i = 0; i < 40; i += 1) write(`scans/${i}.ply`, roomScan([0.015 * i, 0.02 * i, 0.003 * i]));
  for (const [name, contents] of Object.entries(walkFiles())) write(`walk/${name}`, contents);
  const poses = Array.from({ length: 20_000 }, (_, i) => `${i / 10} ${i / 100} ${Math.sin(i / 50)} 0 0 0 0 1\n`);
  write('long.tum', poses.join(''));
  write('short.tum', poses.slice(0, 6).join(''));
  const points = Array.from({ length: 2000 }, (_, i) => `${i % 100} ${(i * 7) % 90}\n`).join('');
  write('points.csv', points);
  write('scene.json', JSON.stringify(bev_presets()[0]?.scene));
}

/** Every command, with what it writes. @param {string} folder that of the inputs @returns {Record<string, Run>} */
function runsOf(folder) {
  const at = (/** @type {string} */ name) => join(folder, name);
  const [source, target] = ['3.ply', '2.ply'].map((name) => join(SAMPLES, name));
  const prints = (/** @type {string[]} */ ...args) => ({ args: () => args, writes: [] });
  return {
    plane: {
      args: (out) => ['reconstruct', at('scans'), '--out', out],
      writes: ['map.pgm', 'map.yaml', ...RECONSTRUCTED],
    },
    space: { args: (out) => ['reconstruct', at('walk'), '--out', out, '--workers', '2'], writes: RECONSTRUCTED },
    strategies: {
      args: (out) => [
        ...['strategies', at('walk'), '--strategies', 'voxels_0.1,voxels_0.3'],
        ...['--out', join(out, 'table.csv'), '--frames', join(out, 'frames.csv')],
      ],
      writes: ['frames.csv', 'table.csv'],
    },
    convert: { args: (out) => ['convert', at('long.tum'), join(out, 'long.kitti')], writes: ['long.kitti'] },
    bev: {
      args: (out) => ['bev', '--scene', at('scene.json'), '--points', at('points.csv'), '--out', join(out, 'bev.json')],
      writes: ['bev.json'],
    },
    icp: {
      args: (out) => [
        ...['icp', source ?? '', target ?? '', '--trace', join(out, 'trace.json')],
        ...['--landscape', join(out, 'landscape.png'), '--basin', join(out, 'basin.png')],
      ],
      writes: ['basin.png', 'landscape.png', 'trace.json'],
    },
    evaluate: prints('evaluate', at('long.tum'), at('long.tum'), '--json'),
    mapQuality: prints('map-quality', source ?? '', target ?? '', '--json'),
    consistency: prints('consistency', at('walk'), at('short.tum'), '--json'),
    topics: prints('topics', at('walk')),
    settings: prints('settings'),
  };
}

/** Runs the command line; a signal at each of these times (ms), each in a row after the one before. @param {string[]} args @param {string} cwd @param {[ms: number, signal: NodeJS.Signals][]} signals @param {number} [timeout] after which it is ended (ms) */
export async function runWith(args, cwd, signals, timeout) {
  const start = performance.now();
  const child = spawn(process.execPath, [CLI, ...args], {
    cwd,
    stdio: ['ignore', 'ignore', 'pipe'],
    timeout,
    killSignal: 'SIGKILL',
  });
  let stderr = '';
  child.stderr.setEncoding('utf8').on('data', (text) => (stderr += text));
  /** @type {Promise<{ code: number | null, signal: NodeJS.Signals | null }>} */
  const ended = new Promise((resolve) => child.on('close', (code, signal) => resolve({ code, signal })));
  for (const [ms, signal] of signals) {
    await Promise.race([sleep(ms), ended]);
    child.kill(signal);
  }
  return { ...(await ended), stderr, milliseconds: performance.now() - start };
}

/** @type {{ folder: string, runs: Record<string, Run>, milliseconds: Map<string, number> } | null} */
let ready = null;

async function prepare() {
  await load();
  const folder = mkdtempSync(join(tmpdir(), 'scanstitch-signals-'));
  process.on('exit', () => rmSync(folder, { recursive: true, force: true }));
  prepareInputs(folder);
  return { folder, runs: runsOf(folder), milliseconds: new Map() };
}

/** One command, with one or two signals at any time of its run. @param {Random} random @param {string} [name] of the command */
export async function signals(random, name) {
  const { folder, runs, milliseconds } = (ready ??= await prepare());
  const chosen = name ?? random.one(Object.keys(runs));
  const { args, writes } = /** @type {Run} */ (runs[chosen]);
  const out = join(folder, `out-${chosen}`);
  mkdirSync(out, { recursive: true });
  if (!milliseconds.has(chosen)) {
    const undisturbed = await runWith(args(out), folder, [], DEADLINE_MS);
    assert.equal(undisturbed.signal, null, `${chosen}: ${undisturbed.stderr}`);
    assert.ok(undisturbed.code === 0 || writes.length === 0, `${chosen}: ${undisturbed.stderr}`);
    assert.deepEqual(wholeFiles(out), [...writes].sort(), chosen);
    milliseconds.set(chosen, undisturbed.milliseconds);
  }
  // What an earlier run has written is replaced whole, or not at all.
  if (random.below(2) > 0) rmSync(out, { recursive: true });
  mkdirSync(out, { recursive: true });
  const before = readdirSync(folder).sort();
  const signal = () => random.one(/** @type {const} */ (['SIGINT', 'SIGTERM']));
  const whole = milliseconds.get(chosen) ?? 0;
  /** @type {[number, NodeJS.Signals][]} */
  const planned = [[random.below(Math.ceil(1.1 * whole)), signal()]];
  if (random.below(2) > 0) planned.push([random.below(SECOND_MS), signal()]);
  const { code, signal: endedBy, stderr } = await runWith(args(out), folder, planned, DEADLINE_MS);
  const told = `${chosen}, ${JSON.stringify(planned)}: exit code ${code}, ${endedBy}, ${stderr}`;
  const isAllowed = code === null ? planned.some(([, sent]) => sent === endedBy) : EXIT_CODES.includes(code);
  assert.ok(isAllowed, told);
  assert.doesNotMatch(stderr, /defect/, told);
  const names = wholeFiles(out);
  assert.ok(
    names.every((file) => writes.includes(file)),
    `${told}: ${names}`,
  );
  if (code === 0) assert.deepEqual(names, [...writes].sort(), told);
  assert.deepEqual(readdirSync(folder).sort(), before, told);
  return new Uint8Array();
}

/** The commands that are sent signals. */
export async function commandsOfSignals() {
  ready ??= await prepare();
  return Object.keys(ready.runs);
}
