/** `scanstitch icp`: one registration, iteration by iteration. */
import { basename } from 'node:path';
import type { GridOptions, PointCloud, RegistrationOptions, RegistrationResult } from '../../pkg/scanstitch.js';
import type { OwnIcpComparison } from '../lab/own_icp.js';
import { OwnPosesError } from '../lab/own_poses.js';
import { MOST_POINTS, voxelFor } from '../lab/thinning.js';
import {
  type Command,
  CommandError,
  type Engine,
  EXIT,
  isScanstitchError,
  optionsOf,
  readArguments,
  table,
  wholeNumber,
} from './command.js';
import { writeWhole } from './disk.js';
import { readRequired } from './inputs.js';
import { png } from './png.js';
import { print, tell } from './terminal.js';

type Options = Partial<RegistrationOptions>;

const OPTIONS = optionsOf({ texts: 'trace landscape basin own axes half-widths size stride', lists: 'set' });

export const icp: Command = {
  name: 'icp',
  about: 'one registration, iteration by iteration; its cost landscape and basin; your own ICP beside it',
  help: () => `scanstitch icp SOURCE TARGET [OPTION]...

Registers a cloud (PLY or PCD) to another and prints every iteration: pairs, residuals, cost and step.
Two planar clouds (z = 0) are registered in the plane.

Options:
  --set NAME=VALUE     an option of the registration, as of register() in docs/api.md: metric=point_to_point,
                       robust_kernel=none, max_correspondence_distance=1, init=global, voxel_size=0.25,
                       step=gauss_newton, ...
  --trace FILE         every iteration with its pairs, weights and normal equations, as JSON
  --landscape FILE     the cost over two unknowns around the result, as PNG; dark is low
  --basin FILE         the basin of attraction on the same grid of starts, as PNG: green is the result, other colours
                       are other minima, black is not converged
  --axes I,J           unknowns of both pictures, counted in the plane from 0 in theta, x, y (default: 1,2) and in
                       space in wx, wy, wz, x, y, z (default: 3,4)
  --half-widths A,B    half width of the pictures along each (rad, m; default: 1,1)
  --size W,H           nodes of the pictures (default: 101,101; of the basin 31,31)
  --stride N           uses every N-th source point for both pictures, which is faster for large clouds (default: 1)
  --own FILE           poses of your own ICP, a 3 x 3 or 4 x 4 matrix per iteration (CSV, JSON, npy): each of its steps
                       is compared with ours from the same pose; where they differ, the cause is reported: pairs,
                       weights or solution

Examples:
  scanstitch icp 1.ply 0.ply --trace trace.json --basin basin.png
  scanstitch icp 1.ply 0.ply --own mine.npy --set metric=point_to_point --set robust_kernel=none
`,
  run,
};

async function run(engine: Engine, args: string[]) {
  const { values, positionals } = readArguments('icp', { args, options: OPTIONS, allowPositionals: true });
  if (positionals.length !== 2) throw new CommandError('Give a source and a target. See: scanstitch icp --help');
  const given = Object.fromEntries((values.set ?? []).map(setting));
  const grid = gridOf(values);
  const own = values.own === undefined ? null : ownPoses(engine, values.own);
  const clouds: PointCloud[] = [];
  try {
    for (const path of positionals) clouds.push(readCloud(engine, path));
    const [source, target] = clouds as [PointCloud, PointCloud];
    const options = { max_iterations: MOST_ITERATIONS, ...given, ...(await thinning(engine, source, target, given)) };
    const result = engine.register(source, target, { ...options, trace: true });
    print(iterations(result));
    const isStuck = result.end_reason === 'no_step';
    if (isStuck) tell(`scanstitch: ${noStep(result)}`);
    const better = isStuck ? null : otherMinimum(engine, source, target, options, result);
    if (better !== null) tell(`scanstitch: ${better}`);
    if (values.trace) await writeWhole(values.trace, `${JSON.stringify(result)}\n`);
    const T_center = result.T_target_source;
    if (values.landscape)
      await writeWhole(values.landscape, landscape(engine, source, target, options, { ...grid, T_center }));
    if (values.basin) await writeWhole(values.basin, basin(engine, source, target, options, { ...grid, T_center }));
    if (own) print(`\n${comparison(engine.compare_own_icp(source, target, own, options))}`);
    return isStuck || better !== null ? EXIT.partial : EXIT.done;
  } finally {
    for (const cloud of clouds) cloud.free();
  }
}

/** Options that downsample clouds with more points than can be registered in seconds; a message says so. */
async function thinning(engine: Engine, source: PointCloud, target: PointCloud, options: Options): Promise<Options> {
  const most = Math.max(source.length, target.length);
  if (most <= MOST_POINTS || options.voxel_size !== undefined) return {};
  const counted = (voxel_size: number) => {
    const lab = new engine.IcpLab(source, target, { metric: 'point_to_point', voxel_size });
    // Planar clouds have no voxels.
    const count = lab.is_planar ? 0 : Math.max(lab.source_points().length, lab.target_points().length) / 3;
    lab.free();
    return count;
  };
  if (counted(0) <= MOST_POINTS) return {};
  const voxel_size = await voxelFor(target.positions(), counted);
  tell(
    `scanstitch: a cloud of ${most} points: both are thinned to one point in ${voxel_size} m. --set voxel_size=0 uses all points.`,
  );
  return { voxel_size };
}

/** Point to point takes hundreds of iterations where surfaces slide along one another. */
const MOST_ITERATIONS = 500;
/** Another minimum is better where so many times as many points have a partner in it. */
const BETTER = 1.1;
/** What finds a start without a guess, for clouds in space and in the plane. */
const SEARCHES = [{ init: 'global' }, { search_translation: 2, search_rotation: Math.PI }] as const;

/**
 * What to say where a search without a guess ends in a minimum in which more points have partners: the result is a
 * false one. Null
 * where it does not, or none is possible.
 */
function otherMinimum(
  engine: Engine,
  source: PointCloud,
  target: PointCloud,
  { init_T_target_source, ...options }: Options,
  result: RegistrationResult,
) {
  const search = SEARCHES[target.is_planar ? 1 : 0];
  const isSearched =
    Object.keys(search ?? {}).some((name) => name in options && name !== 'init') || options.init === 'global';
  if (!search || isSearched) return null;
  try {
    const other = engine.register(source, target, { ...options, ...search });
    if (other.num_inliers < BETTER * result.num_inliers) return null;
    const words = Object.entries(search).map(([name, value]) => `--set ${name}=${value}`);
    return `This is a false minimum: ${result.num_inliers} points have a partner, and ${other.num_inliers} in the one that a search finds. Use ${words.join(' ')}.`;
  } catch (error) {
    if (isScanstitchError(error)) return null;
    throw error;
  }
}

/** Why the loop found no step. */
function noStep({ trace }: RegistrationResult) {
  const last = trace?.at(-1)?.summary;
  return last?.num_correspondences === 0
    ? 'The clouds do not overlap from this start: no point of the source has a partner. Give a nearer start by --set init_T_target_source=[...], or --set max_correspondence_distance=5.'
    : 'The pairs do not determine a step: there are too few, or the target has no normals. Try --set metric=point_to_point.';
}

function readCloud(engine: Engine, path: string) {
  const name = basename(path);
  return engine.PointCloud.read(readRequired({ name, path }), name);
}

function ownPoses(engine: Engine, path: string) {
  const name = basename(path);
  const bytes = readRequired({ name, path });
  try {
    return engine.read_own_poses(bytes, name);
  } catch (error) {
    if (error instanceof OwnPosesError) throw new CommandError(error.message);
    throw error;
  }
}

/** `name=value`, the value as JSON where it is. */
function setting(text: string): [string, unknown] {
  const at = text.indexOf('=');
  if (at < 1) throw new CommandError(`--set takes NAME=VALUE, not "${text}".`);
  const [name, value] = [text.slice(0, at), text.slice(at + 1)];
  try {
    return [name, JSON.parse(value)];
  } catch {
    return [name, value];
  }
}

function gridOf(values: {
  axes?: string | undefined;
  'half-widths'?: string | undefined;
  size?: string | undefined;
  stride?: string | undefined;
}) {
  const numbers = (option: 'axes' | 'half-widths' | 'size') => {
    const text = values[option];
    if (text === undefined) return undefined;
    const list = text.split(',').map(Number);
    if (list.length !== 2 || list.some(Number.isNaN))
      throw new CommandError(`--${option} is two numbers, not "${text}".`);
    return list;
  };
  const stride = wholeNumber('stride', values.stride);
  const given = { axes: numbers('axes'), half_widths: numbers('half-widths'), size: numbers('size'), stride };
  return Object.fromEntries(Object.entries(given).filter(([, value]) => value !== undefined));
}

function iterations(result: RegistrationResult) {
  const rows = (result.trace ?? []).map(({ summary: iteration }, index) => [
    String(index + 1),
    String(iteration.num_correspondences),
    String(iteration.num_inliers),
    iteration.inlier_rmse.toFixed(6),
    iteration.cost.toExponential(4),
    (iteration.rotation_step * (180 / Math.PI)).toFixed(4),
    iteration.translation_step.toFixed(6),
    String(iteration.degeneracy?.shares[0]?.toFixed(4) ?? '-'),
  ]);
  const heads = ['iteration', 'pairs', 'inliers', 'rmse (m)', 'cost (m^2)', 'turn (deg)', 'step (m)', 'least share'];
  const T = Array.from({ length: 4 }, (_, row) =>
    result.T_target_source.slice(4 * row, 4 * row + 4)
      .map((x) => x.toFixed(6).padStart(11))
      .join(' '),
  );
  const open = result.undetermined ? `undetermined: ${result.undetermined.map((x) => x.toFixed(3)).join(' ')}\n` : '';
  return `${table(heads, rows, new Set())}\nended: ${result.end_reason}\nT_target_source:\n${T.join('\n')}\n${open}`;
}

function landscape(
  engine: Engine,
  source: PointCloud,
  target: PointCloud,
  options: Options,
  grid: Partial<GridOptions>,
) {
  const { costs, grid: whole, minima } = engine.cost_landscape(source, target, { ...options, grid });
  const finite = costs.filter((cost) => !Number.isNaN(cost));
  const [low, high] = [finite.reduce((a, b) => Math.min(a, b), Infinity), finite.reduce((a, b) => Math.max(a, b), 0)];
  const shade = (cost: number) => {
    if (Number.isNaN(cost)) return [128, 128, 128];
    const share = Math.sqrt((cost - low) / Math.max(high - low, Number.MIN_VALUE));
    return [255 * share ** 0.7, 255 * share ** 1.5, 80 + 120 * share];
  };
  print(`landscape: ${minima.length} local minima, cost ${low.toExponential(3)} to ${high.toExponential(3)} m^2\n`);
  return picture(whole.size, (node) => shade(costs[node] ?? Number.NaN));
}

/** Of other minima, in turn. */
const COLORS = [
  [230, 159, 0],
  [86, 180, 233],
  [240, 228, 66],
  [0, 114, 178],
  [213, 94, 0],
  [204, 121, 167],
];

function basin(engine: Engine, source: PointCloud, target: PointCloud, options: Options, grid: Partial<GridOptions>) {
  const found = engine.basin_of_attraction(source, target, { ...options, grid });
  const { labels, minima, share_home } = found;
  const color = (label: number) =>
    label < 0 ? [0, 0, 0] : label === 0 ? [0, 158, 115] : (COLORS[(label - 1) % COLORS.length] ?? [0, 0, 0]);
  const share = `${(100 * share_home).toFixed(1)} % of ${labels.length} starts end here`;
  print(`basin: ${share}, the others in ${minima.length - 1} other minima\n`);
  return picture(found.grid.size, (node) => color(labels[node] ?? -1));
}

/** The first unknown to the right, the second upwards. */
function picture([width = 0, height = 0]: number[], color: (node: number) => number[]) {
  const scale = Math.max(1, Math.floor(600 / Math.max(width, height)));
  const rgb = new Uint8Array(3 * width * height * scale * scale);
  for (let y = 0; y < height * scale; y++) {
    for (let x = 0; x < width * scale; x++) {
      const node = (height - 1 - Math.floor(y / scale)) * width + Math.floor(x / scale);
      rgb.set(color(node), 3 * (y * width * scale + x));
    }
  }
  return png(width * scale, height * scale, rgb);
}

/** Why equal steps differ in their last digits. */
function rounding(steps: OwnIcpComparison['steps']) {
  const off = Math.max(0, ...steps.flatMap(({ rotation, translation }) => [rotation, translation]));
  const remedy = 'read yours in the same way (numpy: astype(float32)), and the steps agree to 1e-9';
  return off > 1e-9
    ? `\nThe last digits differ. Points that a file declares as 32-bit floats are read as such here: ${remedy}.`
    : '';
}

function comparison({ steps, parts_at, fault, num_ours }: OwnIcpComparison) {
  const rows = steps.map(({ rotation, translation }, index) => [
    String(index + 1),
    rotation.toExponential(2),
    translation.toExponential(2),
    index === parts_at ? '<- parts' : '',
  ]);
  const heads = ['your step', 'off in turn (rad)', 'off in position (m)', ''];
  const conclusion = fault
    ? `Your ICP parts from ours at step ${(parts_at ?? 0) + 1}. ${fault.kind}: ${fault.text}`
    : `Your ICP does the same steps as ours, ${steps.length} of them; ours ends after ${num_ours}.${rounding(steps)}`;
  return `${table(heads, rows, new Set([3]))}\n${conclusion}\n`;
}
