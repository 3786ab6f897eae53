/** What is seen in the lab, in words. */
import { formatLength, plural } from '../views/format.js';
import { formatAngle, formatStep } from '../views/pose-format.js';
import { DEFAULTS, PLANAR_DEFAULTS } from './defaults.js';
import type { LabFacts, LabIteration, Options } from './protocol.js';
import { numPoses } from './trace.js';

type Named = { trace: { poses: ArrayLike<number>; converged: boolean; end_reason: string } | null };

/** A number with three digits, for matrices and costs. */
export function formatNumber(value: number): string {
  if (Number.isNaN(value)) return '–';
  if (value === 0) return '0';
  const size = Math.abs(value);
  const text =
    size >= 1e5 || size < 1e-3
      ? value
          .toExponential(2)
          .replace(/e([+-])(\d+)/, (_, sign: string, power: string) => `e${sign === '-' ? '−' : ''}${power}`)
      : String(Number(value.toPrecision(size >= 100 ? 4 : 3)));
  return text.replace(/^-/, '−');
}

export function rejectionCounts({ rejected_reason }: LabIteration): number[] {
  const counts = REJECTION_WORDS.map(() => 0);
  for (const reason of rejected_reason) counts[reason] = (counts[reason] ?? 0) + 1;
  return counts;
}

/** Why source points are left out of a step, after their count; in the order of the engine's reasons. */
export const REJECTION_WORDS = ['too far', 'by normals', 'trimmed', 'without normal'] as const;

const END_WORDS: Record<string, string> = {
  max_iterations: 'not converged: iteration limit',
  cycle: 'not converged: poses repeat',
  no_step: 'stopped: the pairs do not determine a step',
};

/** How a run ended, as the engine's `end_reason` says it. */
export function endReasonWords({ converged, end_reason }: { converged: boolean; end_reason: string }): string {
  return END_WORDS[end_reason] ?? (converged ? 'converged' : 'not converged');
}

/** The state of an iteration, as a screen reader says it. */
export function stateWords({ trace }: Named, at: number, iteration: LabIteration | null): string {
  const count = Math.max(numPoses(trace) - 1, 0);
  const where = at === 0 ? `Start of ${plural(count, 'iteration')}` : `After iteration ${at} of ${count}`;
  if (!iteration) return `${where}.`;
  const { rotation_step, translation_step } = iteration;
  const numRejected = iteration.rejected_source.length;
  const pairs = `${plural(iteration.source.length, 'pair')}${numRejected > 0 ? `, ${numRejected} rejected` : ''}`;
  const next = `next step ${formatStep(translation_step)} and ${formatAngle(rotation_step, 3)}`;
  return `${where}: ${pairs}, rmse ${formatLength(iteration.inlier_rmse)}, cost ${formatNumber(iteration.cost)}, ${next}.`;
}

const METRICS = {
  point_to_point: 'Point to point',
  point_to_line: 'Point to line',
  point_to_plane: 'Point to plane',
  gicp: 'GICP',
  vgicp: 'Voxelised GICP',
} as const;
export const KERNELS = {
  none: 'No kernel',
  huber: 'Huber',
  cauchy: 'Cauchy',
  geman_mcclure: 'Geman-McClure',
  tukey: 'Tukey',
} as const;

/** Those that these clouds can be registered by. */
export function metricsFor(is_planar: boolean): (keyof typeof METRICS)[] {
  return is_planar ? ['point_to_point', 'point_to_line'] : ['point_to_point', 'point_to_plane', 'gicp', 'vgicp'];
}

/** The metric that these options mean for these clouds: where none is given, the engine's choice. */
export function metricOf(
  { metric }: Options,
  { is_planar, target_normals }: Pick<LabFacts, 'is_planar' | 'target_normals'>,
): keyof typeof METRICS {
  if (metric) return metric;
  return is_planar ? 'point_to_line' : target_normals.length > 0 ? 'point_to_plane' : 'point_to_point';
}

export const metricName = (metric: keyof typeof METRICS): string => METRICS[metric];

/** What a method is called: its metric, and what differs from the engine's defaults. */
/** What a run beside others is called. */
export function runName(run: { own: string; options: Options; facts: LabFacts | null }, facts: LabFacts): string {
  return run.own ? `Your ICP: ${run.own}` : methodName(run.options, run.facts ?? facts);
}

export function methodName(options: Options, facts: Pick<LabFacts, 'is_planar' | 'target_normals'>): string {
  const {
    robust_kernel = DEFAULTS.robust_kernel,
    robust_kernel_width = DEFAULTS.robust_kernel_width,
    trim_fraction = DEFAULTS.trim_fraction,
    max_correspondence_distance = DEFAULTS.max_correspondence_distance,
    search_translation = PLANAR_DEFAULTS.search_translation,
    search_rotation = PLANAR_DEFAULTS.search_rotation,
  } = options;
  const metric = METRICS[metricOf(options, facts)];
  const hasWidth =
    robust_kernel !== 'none' &&
    (robust_kernel !== DEFAULTS.robust_kernel || robust_kernel_width !== DEFAULTS.robust_kernel_width);
  return [
    metric,
    robust_kernel === 'none'
      ? 'no kernel'
      : hasWidth
        ? `${KERNELS[robust_kernel]} ${formatLength(robust_kernel_width)}`
        : '',
    trim_fraction > 0 ? `trimmed ${Math.round(100 * trim_fraction)}\u202f%` : '',
    max_correspondence_distance === DEFAULTS.max_correspondence_distance
      ? ''
      : `within ${formatLength(max_correspondence_distance)}`,
    facts.is_planar && (search_translation > 0 || search_rotation > 0) ? 'after a search' : '',
  ]
    .filter(Boolean)
    .join(', ');
}
