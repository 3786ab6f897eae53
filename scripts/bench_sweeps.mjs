// @ts-check
/**
 * Processor time of the engine a sweep, in Node: `node scripts/bench_sweeps.mjs DIR/timing [--first 20] [--times] [--engine DIR]`, of sweeps that
 * `cargo measure lidar_sweeps --time --sweeps 60 --write DIR` writes (x y z t as 64-bit floats), as PCD files in memory. A line for the first
 * sweeps, during which the engine is compiled in other threads, and one for all others: reading a file, preparing it (less that), and
 * registering it. `--times` gives the points' times, too. kiss-icp on the same sweeps: `python scripts/bench_kiss_icp.py DIR --time timing`.
 */
import { readdirSync, readFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { parseArgs } from 'node:util';
import { ROOT } from './steps.mjs';

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    first: { type: 'string', default: '20' },
    times: { type: 'boolean', default: false },
    engine: { type: 'string', default: join(ROOT, 'pkg') },
  },
});
const [folder = '', numFirst] = [positionals[0], Number(values.first)];
const engine = resolve(values.engine);
const { initSync, PointCloud, prepare_cloud, SpatialReconstruction } = await import(
  pathToFileURL(join(engine, 'scanstitch.js')).href
);
initSync({ module: readFileSync(join(engine, 'scanstitch_bg.wasm')) });

/** A sweep as a PCD file. @param {string} file */
function pcd(file) {
  const bytes = readFileSync(join(folder, file));
  const numbers = new Float64Array(bytes.buffer, bytes.byteOffset, bytes.length / 8);
  const [count, width] = [numbers.length / 4, values.times ? 4 : 3];
  const kept = Float32Array.from(numbers.filter((_, index) => index % 4 < width));
  const each = (/** @type {string} */ word) => ` ${word}`.repeat(width);
  const header = `VERSION 0.7\nFIELDS x y z${values.times ? ' time' : ''}\nSIZE${each('4')}\nTYPE${each('F')}\nCOUNT${each('1')}\nWIDTH ${count}\nHEIGHT 1\nPOINTS ${count}\nDATA binary\n`;
  return new Uint8Array(Buffer.concat([Buffer.from(header), Buffer.from(kept.buffer)]));
}

const spent = [0, 0, 0];
/** @template T @param {number} stage @param {() => T} work */
function timed(stage, work) {
  const before = process.cpuUsage();
  const result = work();
  const { user, system } = process.cpuUsage(before);
  spent[stage] = (spent[stage] ?? 0) + (user + system) / 1000;
  return result;
}

const reconstruction = new SpatialReconstruction({});
let config = '';
/** @param {string} name @param {number} number @param {Uint8Array} file */
function register(name, number, file) {
  timed(0, () => PointCloud.read(file, name).free());
  const prepared = timed(1, () => prepare_cloud(config, name, number, number / 10, file));
  timed(2, () => {
    reconstruction.add_prepared(prepared);
    while (reconstruction.step().stage !== 'done');
  });
}

const names = readdirSync(folder).filter((name) => name.endsWith('.bin'));
names.sort().forEach((name, number) => {
  const file = pcd(name);
  if (number === 0) config = reconstruction.begin('0.pcd', file);
  register(`${number}.pcd`, number, file);
  if (number + 1 !== numFirst && number + 1 !== names.length) return;
  const count = number + 1 === numFirst ? numFirst : names.length - numFirst;
  const [reading = 0, preparing = 0, registering = 0] = spent.map((milliseconds) => milliseconds / count);
  console.log(
    `${count} sweeps: ${(preparing - reading + registering).toFixed(1)} ms a sweep and ${reading.toFixed(1)} for reading (preparing ${(preparing - reading).toFixed(1)}, registering ${registering.toFixed(1)})`,
  );
  spent.fill(0);
});
const { frames } = reconstruction.result();
console.log(`${frames.filter((/** @type {any} */ { status }) => status === 'good').length} good`);
