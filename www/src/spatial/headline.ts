/** The figures at the top of a run in space. */
import { assumedMark, condition } from '../../../package/report/assumed.js';
import type { SpatialResult } from '../engine/spatial-protocol.js';
import { DEGREES, formatCount, formatDuration, formatFixed, formatLength } from '../views/format.js';
import { comparisonFigure, type Figure } from '../views/headline.js';
import { openAssumption } from './reading.js';

export interface SpatialTiming {
  /** Milliseconds of registering, per frame. */
  frames: readonly number[];
  /** Milliseconds since the run began, waiting for workers and all. */
  elapsed: number;
}

/** `num_points`: of the map as it is shown. `num_frames`: of the recording, registered or not. */
export function spatialFigures(
  result: SpatialResult,
  timing: SpatialTiming,
  num_points: number,
  num_frames: number,
): Figure[] {
  const { frames, comparison } = result;
  const figures: Figure[] = [framesFigure(result, num_frames)];
  if (comparison) figures.push(comparisonFigure(comparison, 'frame'));
  const registering = timing.frames.reduce((sum, ms) => sum + ms, 0);
  figures.push(
    {
      label: 'Computing time',
      value: frames.length > 0 ? `${formatDuration(registering / frames.length)} a frame` : '…',
      meaning: `${formatDuration(timing.elapsed)} in total, in this tab`,
      tone: 'plain',
    },
    {
      label: 'Map',
      value: `${formatCount(num_points)} points`,
      meaning: `one point per voxel of ${formatLength(result.settings.map_voxel_size ?? 0)}`,
      tone: 'plain',
    },
  );
  const { num_closed, farthest_move } = result.loops;
  if (num_closed > 0) {
    const meaning = `loop closure moved frames by up to ${formatLength(farthest_move)}`;
    figures.push({ label: 'Loops closed', value: formatCount(num_closed), meaning, tone: 'plain' });
  }
  const camera = cameraFigure(result);
  if (camera) figures.push(camera);
  if (comparison?.convention) figures.push(conventionFigure(comparison.convention));
  return figures;
}

/** How many frames are good, with the unconfirmed assumptions that the size and the shape of the map depend on. */
function framesFigure(result: SpatialResult, num_frames: number): Figure {
  const { frames, assumptions } = result;
  const counts = { good: 0, doubtful: 0, lost: 0 };
  for (const { status } of frames) counts[status]++;
  const worries = [
    counts.lost > 0 ? `${formatCount(counts.lost)} lost` : '',
    counts.doubtful > 0 ? `${formatCount(counts.doubtful)} doubtful` : '',
  ].filter((words) => words !== '');
  const provided = counts.good > 0 ? condition(result) : '';
  const good = worries.length > 0 ? [...worries, `${formatCount(counts.good)} good`].join(', ') : 'all good';
  const figure: Figure = {
    label: frames.length === 1 ? 'Frame' : 'Frames',
    value:
      frames.length < num_frames
        ? `${formatCount(frames.length)} of ${formatCount(num_frames)}`
        : formatCount(frames.length),
    meaning: provided === '' ? good : `${good} ${provided}`,
    tone: counts.lost > 0 ? 'lost' : worries.length > 0 || provided !== '' ? 'doubtful' : 'plain',
  };
  const isAssumed = provided !== '' && assumptions.length > 0;
  return isAssumed ? { ...figure, action: changeAction('Change what the good frames assume') } : figure;
}

/** Opens the dialog of what is assumed. */
function changeAction(description: string): NonNullable<Figure['action']> {
  return { id: 'reading', label: 'Change', description };
}

/** How the reference was read: the order of its quaternions stands out, the rest explains. */
function conventionFigure(convention: string): Figure {
  const parts = convention.split(', ');
  const order = parts.find((part) => part.startsWith('quaternions '));
  const meaning = [...parts.filter((part) => part !== order), 'aligned at the first pose'].join(', ');
  return {
    label: 'Ground truth format',
    value: order?.replace('quaternions ', '') ?? 'matrices',
    meaning,
    tone: 'plain',
  };
}

function cameraFigure({ camera, depth_scale, cloud_unit, quantisation, assumptions }: SpatialResult): Figure | null {
  if (!camera) return cloudFigure(cloud_unit, assumptions);
  const angle = 2 * Math.atan(camera.width / 2 / camera.fx) * DEGREES;
  const scale = depth_scale === null ? '' : `${Number(depth_scale.toPrecision(6))} values per metre`;
  const focalLength = assumedMark(assumptions, 'fx');
  const parts = [
    scale && `depth: ${scale}${assumedMark(assumptions, 'depth_scale')}`,
    quantisation && `${quantisation === 'truncated' ? 'rounded down' : quantisation} to whole values`,
    focalLength && `focal length${focalLength}`,
  ];
  const figure: Figure = {
    label: 'Camera',
    value: `${camera.width} × ${camera.height}, ${formatFixed(angle, 0)}°`,
    meaning: parts.filter(Boolean).join(', '),
    tone: openAssumption(assumptions) ? 'doubtful' : 'plain',
  };
  return assumptions.length > 0 ? { ...figure, action: changeAction('Change what is assumed of the camera') } : figure;
}

/** The unit of clouds, where it is not metres without a doubt. */
function cloudFigure(unit: number | null, assumptions: SpatialResult['assumptions']): Figure | null {
  if (unit === null || (unit === 1 && assumptions.length === 0)) return null;
  const figure: Figure = {
    label: 'Unit of the clouds',
    value: `${Number(unit.toPrecision(4))} m`,
    meaning: assumedMark(assumptions, 'cloud_unit').trim(),
    tone: openAssumption(assumptions) ? 'doubtful' : 'plain',
  };
  return assumptions.length > 0 ? { ...figure, action: changeAction('Change what is assumed of the clouds') } : figure;
}

export function formatBytes(bytes: number): string {
  if (bytes < 1e6) return `${formatFixed(bytes / 1e3, 0)}\u202fkB`;
  return `${formatFixed(bytes / 1e6, bytes < 1e7 ? 1 : 0)}\u202fMB`;
}
