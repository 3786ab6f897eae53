/** The results of a reconstruction in space, as text. */
import { BOUND_95, positionBound } from '../report/bounds.js';
import type { MapSize, SpatialResult, Suggestion } from '../../pkg/scanstitch.js';
import { printable } from '../base/printable.js';
import { assumedMark, statusWords, unconfirmed } from '../report/assumed.js';
import { table } from './command.js';
import { errorFigures, millimetres } from './results.js';

export interface Timing {
  /** Wall time (ms). */
  total: number;
  /** Ms of each stage, by the frame's place in the recording. */
  frames: Map<number, Record<string, number>>;
  workers: number;
  isStopped: boolean;
}

/** A line a frame. The turn is that since the first frame. */
export function frameTable({ frames, comparison }: SpatialResult, { frames: milliseconds }: Timing) {
  const heads = ['frame', 'x (m)', 'y (m)', 'z (m)', 'turn (deg)', 'inliers', 'rmse (mm)', 'ms'];
  if (comparison) heads.push('error (mm)');
  const rows = frames.map((frame, index) => {
    const { x, y, z, qx, qy, qz, qw } = frame.T_world_sensor;
    const turn = 2 * Math.atan2(Math.hypot(qx, qy, qz), Math.abs(qw));
    const times = Object.values(milliseconds.get(frame.index) ?? {});
    const error = comparison?.errors[index];
    return [
      frame.name,
      x.toFixed(3),
      y.toFixed(3),
      z.toFixed(3),
      ((turn * 180) / Math.PI).toFixed(2),
      String(frame.num_inliers),
      millimetres(frame.inlier_rmse),
      sum(times).toFixed(1),
      ...(comparison ? [typeof error === 'number' ? millimetres(error) : '-'] : []),
      frame.status,
    ];
  });
  return table([...heads, 'status'], rows, new Set([0, heads.length]));
}

/**
 * @param timing map: ms of stitching it
 * @param numRecorded frames of the recording
 */
export function headline(
  result: SpatialResult,
  timing: Timing & { map: number },
  sizes: MapSize[],
  numRecorded: number,
) {
  const { frames, comparison, suggestion, camera, depth_scale, cloud_unit, quantisation, assumptions } = result;
  const lines = [timeLine(frames.length, timing, numRecorded), statusWords(result, optionsFor(result))];
  lines.push(...boundLine(frames));
  if (camera) {
    const [fx, fy, cx, cy] = [camera.fx, camera.fy, camera.cx, camera.cy].map((value) => Number(value.toFixed(2)));
    lines.push(
      `Camera: ${camera.width} x ${camera.height} pixels, fx ${fx}, fy ${fy}, cx ${cx}, cy ${cy}${assumedMark(assumptions, 'fx')}`,
    );
  }
  if (cloud_unit && cloud_unit !== 1) {
    lines.push(`Clouds: a unit is ${cloud_unit} m${assumedMark(assumptions, 'cloud_unit')}`);
  }
  if (depth_scale) {
    const made =
      quantisation === 'truncated' ? ', truncated to whole values' : quantisation === 'rounded' ? ', rounded' : '';
    lines.push(
      `Depth: ${Number(depth_scale.toPrecision(6))} raw values per metre${assumedMark(assumptions, 'depth_scale')}${made}`,
    );
  }
  const map = sizes.map(({ voxel_size, num_points, num_bytes }) => {
    return `${(100 * voxel_size).toFixed(0)} cm: ${num_points} points, ${(num_bytes / 1e6).toFixed(1)} MB`;
  });
  const stitched = `stitched in ${timing.map.toFixed(0)} ms`;
  if (sizes.length > 0) lines.push(`Map, ${stitched}; in voxels of ${map.join('; ')}`);
  if (comparison) {
    const { name, num_matched, aligned, convention } = comparison;
    const inMetres = (metres: number) => `${metres.toFixed(4)} m`;
    const matched = `over ${num_matched} of ${numRecorded} frames, first poses aligned`;
    lines.push(`Distance to ${printable(name)}: ${errorFigures(comparison, inMetres)} ${matched}`);
    if (aligned) lines.push(`  with all poses aligned: ${errorFigures(aligned, inMetres)}`);
    if (convention) lines.push(`  read as: ${convention}`);
    if (suggestion) lines.push(`  ${suggestion.text}${optionFor(suggestion)}`);
  }
  return lines.map((line) => `${line}\n`).join('');
}

/** How far the good frames may be off against the first one, where that is known: the least certain of them. */
function boundLine(frames: SpatialResult['frames']) {
  const known = frames.flatMap(({ std, status }) => (std && status === 'good' ? [std] : []));
  if (known.length < 2) return [];
  const metres = Math.max(...known.map(positionBound));
  const degrees = ((BOUND_95 * 180) / Math.PI) * Math.max(...known.map(({ rotation }) => rotation));
  return [
    `Good frames: known to ${metres.toFixed(3)} m and ${degrees.toFixed(2)} degrees against the first one (95 %, the least certain)`,
  ];
}

/**
 * What was assumed of depth images or clouds because no file and no setting says it, in a sentence each; what a note of
 * the engine says
 * is left out.
 */
export function assumptionNotes({ assumptions, notes }: SpatialResult): string[] {
  // The words of the engine's note about the depth scale (crate/src/camera/depth_scale.rs).
  const isSaid = notes.some((text) => text.includes('raw values per metre'));
  return assumptions.flatMap(({ setting, value, why, likely, confirmed_by }) => {
    const number = Number(value.toPrecision(6));
    const confirmed = confirmed_by === null ? null : `Confirmed by ${confirmed_by}.`;
    if (setting === 'depth_scale') {
      const remedy = 'If the map has the wrong size, give the right number: --set depth_scale=NUMBER.';
      const assumed = `No file says what the depth scale is: a scale of ${number} raw values per metre is assumed, ${why}.`;
      return isSaid ? [] : [`${assumed} ${confirmed ?? remedy}`];
    }
    if (setting === 'cloud_unit') {
      const others = likely.slice(1).map((other) => `${other} m`);
      const also = others.length > 0 ? `; possible as well: ${others.join(', ')}` : '';
      const assumed = `No file says the unit of the clouds' coordinates: ${number} m are assumed, as ${why}${also}.`;
      return [`${assumed} If the map has the wrong size, give the right unit in metres: --set cloud_unit=NUMBER.`];
    }
    const remedy = 'If the map is bent, give the camera: --intrinsics FILE (fx fy cx cy), or --set fx=PIXELS.';
    const assumed = `No file says what the camera is like: a focal length of ${number} pixels is assumed, ${why}.`;
    return [`${assumed} ${confirmed ?? remedy}`];
  });
}

/** The options that change what is not confirmed. */
function optionsFor({ assumptions, is_scale_contradicted }: SpatialResult) {
  const options = {
    depth_scale: '--set depth_scale=NUMBER',
    fx: '--set fx=PIXELS',
    cloud_unit: '--set cloud_unit=NUMBER',
  };
  const open = unconfirmed(assumptions).map(({ setting }) => options[setting]);
  return ` (${[...(is_scale_contradicted ? [options.depth_scale] : []), ...open].join(', ')})`;
}

function optionFor({ setting, value }: Suggestion) {
  return value === null || value === undefined ? '' : ` (--set ${setting}=${value})`;
}

function timeLine(count: number, { total, frames, workers }: Timing, numRecorded: number) {
  const mean = (stage: string) => {
    const times = [...frames.values()].map((milliseconds) => milliseconds[stage] ?? 0);
    return (sum(times) / times.length).toFixed(1);
  };
  const stages = `read ${mean('read')}, prepare ${mean('prepare')}, register ${mean('register')}`;
  const threads = workers === 0 ? 'one thread' : `${workers} ${workers === 1 ? 'worker' : 'workers'}`;
  return `${count} of ${numRecorded} frames in ${total.toFixed(0)} ms, ${(total / count).toFixed(1)} ms a frame with ${threads} (${stages})`;
}

function sum(numbers: number[]) {
  return numbers.reduce((total, number) => total + number, 0);
}
