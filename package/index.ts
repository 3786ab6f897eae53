/// <reference lib="esnext.disposable" preserve="true" />
/**
 * Laser scans, depth images and point clouds to a trajectory and a stitched map, in Node and in the browser.
 *
 * ```js
 * import { readFile } from 'node:fs/promises';
 * import { load, Reconstruction } from 'scanstitch';
 *
 * await load();
 * const reconstruction = new Reconstruction({ max_range: 30 });
 * for (const name of ['0.ply', '1.ply', '2.ply']) {
 *   reconstruction.add_scan(name, await readFile(name));
 * }
 * while (reconstruction.step().stage !== 'done');
 * for (const { name, T_world_sensor } of reconstruction.result().frames) {
 *   console.log(name, T_world_sensor.x, T_world_sensor.y, T_world_sensor.theta); // m, m, rad
 * }
 * reconstruction.free();
 * ```
 *
 * Trajectories are compared with a reference as evo does:
 *
 * ```js
 * import { readFile } from 'node:fs/promises';
 * import { evaluate, load, Trajectory } from 'scanstitch';
 *
 * await load();
 * const reference = Trajectory.read(await readFile('reference.tum'), 'reference.tum');
 * const mine = Trajectory.read(await readFile('mine.tum'), 'mine.tum');
 * const evaluation = evaluate(reference, mine, { alignment: 'se3' });
 * console.log(evaluation.summary().statistics.rmse, evaluation.errors()); // m
 * ```
 *
 * SI units and radians everywhere. `T_target_source` maps points of the source into the target; `T_world_sensor` is a
 * pose. What is thrown for bad input is a {@link ScanstitchError}.
 */

import { readFile } from 'node:fs/promises';
import { type Engine, loadOnce } from './api/load.js';

export * from './api/api.js';

/**
 * Loads the engine. All other functions may be called once the promise is fulfilled; further calls have no effect.
 *
 * @param engine Where the engine comes from, when it is not beside this file: its address, its response, its bytes, or
 *   the compiled module, which workers can be sent.
 */
export function load(engine?: Engine): Promise<void> {
  // Node's fetch reads no files.
  return loadOnce(engine, () => readFile(new URL('../pkg/scanstitch_bg.wasm', import.meta.url)));
}
