// @ts-check
/**
 * Memory of a long drive in Node: `node scripts/bench_memory.mjs [--sweeps 5000] [--every 500] [--loops off]`. A lidar of 16 rings drives a metre
 * a sweep along a street of houses and posts that never repeats. A line each: sweeps, memory of the engine, heap, and milliseconds a sweep since the
 * last line. At the end: points of the map, good sweeps, and the error of the last pose.
 */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { initSync, prepare_cloud, SpatialReconstruction } from '../pkg/scanstitch.js';
import { ROOT } from './steps.mjs';

const { values } = parseArgs({
  options: {
    sweeps: { type: 'string', default: '5000' },
    every: { type: 'string', default: '500' },
    loops: { type: 'string', default: 'on' },
  },
});
const [NUM_SWEEPS, EVERY] = [Number(values.sweeps), Number(values.every)];
const [NUM_RINGS, NUM_AZIMUTHS, HEIGHT, MAX_RANGE, NOISE] = [16, 360, 1.7, 60, 0.02];

/** A number in 0..1 of a number: what stands at a place is the same at each visit. @param {number} seed */
function random(seed) {
  let x = Math.imul(seed ^ 0x9e3779b9, 0x85ebca6b);
  x = Math.imul(x ^ (x >>> 13), 0xc2b2ae35);
  return ((x ^ (x >>> 16)) >>> 0) / 2 ** 32;
}

/** Boxes of the street between two places: x0 x1 y0 y1 and their height over the ground. @param {number} from @param {number} to */
function boxes(from, to) {
  const found = [];
  for (let block = Math.floor(from / 10) - 1; block <= to / 10 + 1; block += 1) {
    for (const side of [-1, 1]) {
      const seed = 16 * block + (side + 1) * 4;
      const front = side * (6 + 4 * random(seed));
      const [x0, x1] = [10 * block + random(seed + 1), 10 * block + 7 + 3 * random(seed + 2)];
      found.push([
        x0,
        x1,
        Math.min(front, front + 5 * side),
        Math.max(front, front + 5 * side),
        3 + 6 * random(seed + 3),
      ]);
      const [post, out] = [10 * block + 10 * random(seed + 5), side * (4 + random(seed + 6))];
      found.push([post, post + 0.3, out, out + 0.3, 4]);
    }
  }
  return found;
}

/** The cloud of a sweep from here, as a PCD file. @param {number} place @param {number} number */
function sweep(place, number) {
  const near = boxes(place - MAX_RANGE, place + MAX_RANGE);
  const points = [];
  for (let ray = 0; ray < NUM_RINGS * NUM_AZIMUTHS; ray += 1) {
    const azimuth = (2 * Math.PI * Math.floor(ray / NUM_RINGS)) / NUM_AZIMUTHS;
    const elevation = ((2 * (ray % NUM_RINGS)) / (NUM_RINGS - 1) - 1) * (Math.PI / 12);
    const [dx, dy, dz] = [
      Math.cos(elevation) * Math.cos(azimuth),
      Math.cos(elevation) * Math.sin(azimuth),
      Math.sin(elevation),
    ];
    let range = dz < 0 ? HEIGHT / -dz : Infinity;
    for (const [x0 = 0, x1 = 0, y0 = 0, y1 = 0, height = 0] of near) {
      const [tx0, tx1] = [(x0 - place) / dx, (x1 - place) / dx];
      const [ty0, ty1] = [y0 / dy, y1 / dy];
      const enter = Math.max(Math.min(tx0, tx1), Math.min(ty0, ty1));
      const leave = Math.min(Math.max(tx0, tx1), Math.max(ty0, ty1));
      if (enter > 0 && enter < leave && enter < range && dz * enter < height - HEIGHT) range = enter;
    }
    const noise = NOISE * Math.sqrt(3) * (2 * random(NUM_RINGS * NUM_AZIMUTHS * number + ray) - 1);
    if (range < MAX_RANGE) points.push((range + noise) * dx, (range + noise) * dy, (range + noise) * dz);
  }
  const count = points.length / 3;
  const header = `VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH ${count}\nHEIGHT 1\nPOINTS ${count}\nDATA binary\n`;
  return new Uint8Array(Buffer.concat([Buffer.from(header), Buffer.from(Float32Array.from(points).buffer)]));
}

const { memory } = initSync({ module: readFileSync(join(ROOT, 'pkg/scanstitch_bg.wasm')) });
const reconstruction = new SpatialReconstruction({ loop_closing: values.loops === 'off' ? 'off' : 'on' });
console.log('| sweeps | engine (MB) | heap (MB) | ms a sweep |\n|---|---|---|---|');
let config = '';
let spent = 0;
for (let number = 0; number < NUM_SWEEPS; number += 1) {
  const file = sweep(number, number);
  const start = performance.now();
  if (number === 0) config = reconstruction.begin('0.pcd', file);
  reconstruction.add_prepared(prepare_cloud(config, `${number}.pcd`, number, number / 10, file));
  while (reconstruction.step().stage !== 'done');
  spent += performance.now() - start;
  if ((number + 1) % EVERY !== 0) continue;
  /** @type {any} */ (globalThis).gc?.();
  const megabytes = (/** @type {number} */ bytes) => (bytes / 2 ** 20).toFixed(0);
  const { heapUsed } = process.memoryUsage();
  console.log(
    `| ${number + 1} | ${megabytes(memory.buffer.byteLength)} | ${megabytes(heapUsed)} | ${(spent / EVERY).toFixed(1)} |`,
  );
  spent = 0;
}
reconstruction.finish();
const start = performance.now();
while (reconstruction.step().stage !== 'done');
const finished = performance.now() - start;
const { frames, notes, loops } = reconstruction.result();
const last = reconstruction.trajectory_tum().trim().split('\n').at(-1)?.split(' ').map(Number) ?? [];
const error = [(last[1] ?? 0) - NUM_SWEEPS + 1, last[2] ?? 0, last[3] ?? 0].map((value) => value.toFixed(1));
const num_points = reconstruction.map_positions().length / 3;
console.log(
  `engine ${(memory.buffer.byteLength / 2 ** 20).toFixed(0)} MB after the end, which took ${finished.toFixed(0)} ms`,
);
console.log(
  `${num_points} points of the map, ${frames.filter(({ status }) => status === 'good').length} good of ${frames.length}, ${loops.num_closed} loops, the last pose (${error}) m off of ${NUM_SWEEPS - 1} m`,
);
for (const note of notes) console.log(note);
