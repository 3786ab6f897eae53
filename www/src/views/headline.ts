/** The figures at the top: what the whole run comes to. */
import { baseName, formatCount, formatDuration, formatLength, plural } from './format.js';
import { cleaningParts, sumCleaning } from './cleaning.js';

export interface Figure {
  label: string;
  value: string;
  /** One line that says what the value means. */
  meaning: string;
  tone: 'plain' | 'doubtful' | 'lost';
  /** A button beside the meaning, and the id of its event. */
  action?: { id: string; label: string; description: string };
}

interface Result {
  frames: readonly {
    status: 'good' | 'doubtful' | 'lost';
    piece: number;
    cleaning: Parameters<typeof sumCleaning>[0][number];
  }[];
  sharpness: { mean_residual: number; num_pairs: number } | null;
  comparison: ComparedError | null;
}

/** Of a run against the ground truth (m). */
export interface ComparedError {
  name: string;
  num_matched: number;
  mean: number;
  rmse: number;
  max: number;
  aligned: { mean: number } | null;
}

/** The distance with the first poses made equal, and, beside it, with all of them aligned. */
export function comparisonFigure(comparison: ComparedError, noun: 'scan' | 'frame'): Figure {
  const { name, num_matched, mean, rmse, max, aligned } = comparison;
  const distance = noun === 'scan' ? 'Distance' : 'Mean L2 distance';
  const label = `${distance} to ${baseName(name)}`;
  if (num_matched === 0)
    return { label, value: 'no match', meaning: `no ground truth pose matches a ${noun}`, tone: 'doubtful' };
  const whenAligned = aligned ? `; ${formatLength(aligned.mean)} when aligned` : '';
  const meaning = `mean from the first pose${whenAligned}; rmse ${formatLength(rmse)}, max ${formatLength(max)}`;
  return { label, value: formatLength(mean), meaning, tone: 'plain' };
}

type Frames = Result['frames'];

/**
 * `total_ms`: computing alone, without drawing and waiting. `isGrowing`: there is more to come. `num_scans`: scans of the
 * run, registered or not. `numUnread`: files beside them that could not be read.
 */
export function headlineFigures(
  result: Result,
  total_ms: number,
  isGrowing: boolean,
  num_scans: number,
  numUnread: number,
): Figure[] {
  const { frames, sharpness, comparison } = result;
  const figures = [scansFigure(frames, num_scans, numUnread)];
  if (sharpness || isGrowing) {
    figures.push({
      label: 'Sharpness',
      value: sharpness ? formatLength(sharpness.mean_residual) : '…',
      meaning: 'mean distance between overlapping scans',
      tone: 'plain',
    });
  }
  if (comparison) figures.push(comparisonFigure(comparison, 'scan'));
  figures.push(timeFigure(total_ms, frames.length), pointsFigure(frames));
  return figures;
}

function scansFigure(frames: Frames, num_scans: number, numUnread: number): Figure {
  const num_lost = frames.filter(({ status }) => status === 'lost').length;
  const numDoubtful = frames.filter(({ status }) => status === 'doubtful').length;
  const numPieces = new Set(frames.flatMap(({ status, piece }) => (status === 'lost' ? [] : [piece]))).size;
  const worries = [
    num_lost > 0 ? `${formatCount(num_lost)} lost` : '',
    numDoubtful > 0 ? `${formatCount(numDoubtful)} doubtful` : '',
    numPieces > 1 ? `map in ${formatCount(numPieces)} pieces` : '',
    numUnread > 0 ? `${plural(numUnread, 'file')} not read` : '',
  ].filter((words) => words !== '');

  const count = formatCount(frames.length);
  const without = frames.length === 1 ? 'nothing to register it against' : 'all registered';
  return {
    label: frames.length === 1 ? 'Scan' : 'Scans',
    value: frames.length < num_scans ? `${count} of ${formatCount(num_scans)}` : count,
    meaning: worries.length > 0 ? worries.join(', ') : without,
    tone: num_lost > 0 ? 'lost' : numDoubtful + numUnread > 0 ? 'doubtful' : 'plain',
  };
}

function timeFigure(total_ms: number, num_frames: number): Figure {
  return {
    label: 'Computing time',
    value: formatDuration(total_ms),
    meaning: num_frames > 1 ? `${formatDuration(total_ms / num_frames)} a scan, in this tab` : 'in this tab',
    tone: 'plain',
  };
}

function pointsFigure(frames: Frames): Figure {
  const cleaning = sumCleaning(frames.map((frame) => frame.cleaning));
  const dropped = cleaningParts(cleaning);
  return {
    label: 'Points used',
    value: formatCount(cleaning.num_kept),
    meaning:
      dropped.length > 0
        ? `left out: ${dropped.join(', ')}`
        : `of ${plural(cleaning.num_read, 'return')}: none left out`,
    tone: 'plain',
  };
}
