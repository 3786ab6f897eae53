// @ts-check
/**
 * What the surface of a recording of depth images takes in WebAssembly on top of its run, one thread:
 * `node scripts/bench_surface.mjs FOLDER [VOXEL_SIZE]...`. Median milliseconds of processor time of putting a frame in, and those of extracting the mesh, as
 * the page does it while the run goes on. The folder has the depth images alone, or in `depth`.
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
  const wanted = surface.follow(
    Uint32Array.from(placed, ({ index }) => index),
    Float64Array.from(poses),
    true,
  );
  const times = [];
  for (const frame of wanted) {
    const kept = reconstruction.kept_points(frame);
    if (!kept) continue;
    start = now();
    surface.put(frame, kept);
    times.push(now() - start);
  }
  const median = times.sort((a, b) => a - b)[times.length >> 1] ?? 0;
  start = now();
  const triangles = surface.num_triangles;
  console.log(
    `${100 * surface.voxel_size} cm: ${median.toFixed(1)} ms a frame (95 %: ${times[Math.floor(0.95 * times.length)]?.toFixed(1)}); ${triangles} triangles in ${(now() - start).toFixed(0)} ms`,
  );
  surface.free();
}
