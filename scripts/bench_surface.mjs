// @ts-check
/**
 * What the surface of a recording of depth images takes in WebAssembly on top of its run, one thread:
 * `node scripts/bench_surface.mjs FOLDER [VOXEL_SIZE]...`. Milliseconds of processor time: of the keyframes, for each frame of the run and for each
 * keyframe; of the mesh that is shown then; of the other frames, which follow, and of the mesh of all, as
 * the page makes them. The folder has the depth images alone, or in `depth`.
 */
import { existsSync, readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { load, prepare_frame, SpatialReconstruction, Surface } from '../npm/index.js';

const [folder = '', ...sizes] = process.argv.slice(2);
await load();
const depth = existsSync(join(folder, 'depth')) ? join(folder, 'depth') : folder;
const names = readdirSync(depth)
  .filter((name) => /\.(png|pgm)$/.test(name) && !/color|rgb/.test(name))
  .sort((a, b) => a.localeCompare(b, 'en', { numeric: true }));
const read = (/** @type {string} */ name) => readFileSync(join(depth, name));

const reconstruction = new SpatialReconstruction();
const config = reconstruction.begin(names[0] ?? '', read(names[0] ?? ''));
/** Processor time, ms: other programs may run meanwhile. */
const now = () => process.cpuUsage().user / 1000;
let start = now();
for (const [index, name] of names.entries()) {
  reconstruction.add_prepared(prepare_frame(config, name, index, undefined, read(name)));
  reconstruction.step();
}
reconstruction.finish();
while (reconstruction.step().stage !== 'done');
const perFrame = (now() - start) / names.length;
const { frames } = reconstruction.result();
const placed = frames.filter(({ status, piece }) => status === 'good' && piece === 0);
console.log(`${names.length} frames, ${placed.length} good: ${perFrame.toFixed(1)} ms a frame of the run`);

for (const voxel_size of sizes.length > 0 ? sizes.map(Number) : [0.01, 0.02]) {
  const surface = new Surface(reconstruction.decode_config() ?? '', { voxel_size, max_megabytes: 1500 });
  const poses = placed.flatMap(({ T_world_sensor: T }) => [T.x, T.y, T.z, T.qx, T.qy, T.qz, T.qw]);
  /** Puts in what these frames ask for: milliseconds of each. */
  const put = (/** @type {number} */ count, /** @type {boolean} */ isFinal) => {
    const numbers = Uint32Array.from(placed.slice(0, count), ({ index }) => index);
    return Array.from(surface.follow(numbers, Float64Array.from(poses.slice(0, 7 * count)), isFinal), (frame) => {
      const kept = reconstruction.kept_points(frame);
      start = now();
      if (kept) surface.put(frame, kept);
      return now() - start;
    });
  };
  const mesh = () => {
    start = now();
    return `${surface.num_triangles} triangles in ${(now() - start).toFixed(0)} ms`;
  };
  const sum = (/** @type {number[]} */ times) => times.reduce((all, time) => all + time, 0);
  const keyframes = placed.flatMap((_, at) => put(at + 1, false));
  const [ofRun, ofEach] = [placed.length, keyframes.length].map((count) => (sum(keyframes) / count).toFixed(1));
  console.log(
    `${100 * voxel_size} cm: ${keyframes.length} keyframes, ${ofRun} ms a frame of the run, ${ofEach} each; ${mesh()}`,
  );
  const rest = put(placed.length, true);
  console.log(`  then ${rest.length} frames, ${(sum(rest) / 1000).toFixed(1)} s; ${mesh()}`);
  surface.free();
}
