/** `scanstitch map-quality`: how sharp maps are, without a reference. */
import { readdirSync } from 'node:fs';
import { basename, join } from 'node:path';
import type { FrameResidual, MapQuality, MapQualityOptions } from '../../pkg/scanstitch.js';
import { compareNaturally } from '../base/natural_order.js';
import {
  attempt,
  type Command,
  CommandError,
  type Engine,
  numberIn,
  optionsOf,
  readArguments,
  table,
} from './command.js';
import { fileProblem } from './disk.js';
import { readInput } from './inputs.js';
import { Complaints, print } from './terminal.js';
import { readTrajectory } from './trajectories.js';

const OPTIONS = optionsOf({ texts: 'radius max-points frames', flags: 'json' });

export const mapQuality: Command = {
  name: 'map-quality',
  about: 'mean map entropy and mean plane variance of maps; needs no reference',
  help: () => `scanstitch map-quality MAP... [OPTION]...
       scanstitch map-quality --frames FOLDER TRAJECTORY... [OPTION]...

Sharpness of maps (PLY or PCD): the smaller the figures, the sharper the map. Only maps of the same scans are
comparable.
With --frames, the clouds of a recording are placed by trajectories, and the point-to-plane residual between overlapping
frames (in the plane: point-to-line) is printed as well.
Mean map entropy: Droeschel and Behnke 2014. Mean plane variance: Razlaw et al. 2015; of planar maps, across the lines.

Options:
  --frames FOLDER    one cloud per frame, PLY or PCD, in the order of their numbers, each in its sensor's frame
  --radius METRES    of the neighbourhood of a point (default: 0.3)
  --max-points N     points that are evaluated, spread over the map; 0 for all (default: 50000)
  --json             in full precision

Examples:
  scanstitch map-quality mine/map.ply theirs/map.ply --radius 0.2
  scanstitch map-quality --frames scans/ reference.tum mine.tum
`,
  run,
};

function run(engine: Engine, args: string[]) {
  const { values, positionals } = readArguments('map-quality', { args, options: OPTIONS, allowPositionals: true });
  if (positionals.length === 0)
    throw new CommandError('Nothing to judge was given. See: scanstitch map-quality --help');
  const given = (option: 'radius' | 'max-points') => numberIn(option, values[option], 'a number from 0', (x) => x >= 0);
  const [radius, max_points] = [given('radius'), given('max-points')];
  const options = { ...(radius !== undefined && { radius }), ...(max_points !== undefined && { max_points }) };
  const complaints = new Complaints();
  const { complain } = complaints;
  const results =
    values.frames === undefined
      ? positionals.flatMap((path) => judgedMap(engine, path, options, complain))
      : judgedFrames(engine, values.frames, positionals, options, complain);
  if (results.length === 0) throw new CommandError('Nothing could be used, so nothing was computed.');
  print(values.json ? `${JSON.stringify(results, null, 2)}\n` : printed(results));
  return complaints.exitCode;
}

type Judged = MapQuality & { name: string; residual?: FrameResidual };
type Options = Partial<MapQualityOptions>;
type Complain = (problem: string) => void;

function judgedMap(engine: Engine, path: string, options: Options, complain: Complain): Judged[] {
  const name = basename(path);
  const bytes = readInput({ name, path }, complain);
  if (!bytes) return [];
  return attempt(name, complain, () => {
    const map = engine.PointCloud.read(bytes, name);
    try {
      return { name: path, ...engine.map_quality(map, options) };
    } finally {
      map.free();
    }
  });
}

function judgedFrames(
  engine: Engine,
  folder: string,
  trajectories: string[],
  options: Options,
  complain: Complain,
): Judged[] {
  const clouds = new engine.FrameClouds();
  try {
    for (const name of cloudNames(folder)) {
      const bytes = readInput({ name, path: join(folder, name) }, complain);
      // Without this frame the poses would be those of other ones.
      if (!bytes) return [];
      const cloud = engine.PointCloud.read(bytes, name);
      clouds.add(cloud, name);
      cloud.free();
    }
    return trajectories.flatMap((path) => {
      const trajectory = readTrajectory(engine, path, {}, complain);
      if (!trajectory) return [];
      return attempt(basename(path), complain, () => {
        try {
          const { map, residual } = clouds.quality(trajectory, undefined, options);
          return { name: path, ...map, residual };
        } finally {
          trajectory.free();
        }
      });
    });
  } finally {
    clouds.free();
  }
}

function cloudNames(folder: string) {
  try {
    const names = readdirSync(folder).filter((name) => /\.(ply|pcd)$/i.test(name));
    if (names.length === 0) throw new CommandError(`${folder}: There is no PLY or PCD file in this folder.`);
    return names.sort(compareNaturally);
  } catch (error) {
    if (error instanceof CommandError) throw error;
    throw new CommandError(`${folder}: ${fileProblem(error)}`);
  }
}

function printed(results: Judged[]) {
  const ofFrames = results.some(({ residual }) => residual);
  const heads = ['mean map entropy (nats)', 'mean plane variance (mm^2)', 'points'];
  const rows = results.map(({ name, mean_map_entropy, mean_plane_variance, num_points, residual }) => [
    name,
    ...(ofFrames ? [residual ? (1e3 * residual.mean_residual).toFixed(2) : '-'] : []),
    mean_map_entropy.toFixed(4),
    (1e6 * mean_plane_variance).toFixed(2),
    String(num_points),
  ]);
  const first = ofFrames ? ['frames placed by', 'residual (mm)'] : ['map'];
  return table([...first, ...heads], rows, new Set([0]));
}
