/** Beside the stage: what the iteration is and solves, and the course of the run. */
import { facts } from '../run/facts.js';
import { html, nothing, type TemplateResult } from 'lit';
import type { Painter } from '../drawing/figure-view.js';
import { iterationTable } from '../run/iteration-table.js';
import { type Colors, linearAxis, WHOLE } from '../views/axes.js';
import { drawSeries, plotArea } from '../views/figures.js';
import { formatCount, formatLength, formatPercent, plural } from '../views/format.js';
import { formatAngle, formatStep } from '../views/pose-format.js';
import { equation } from './equation.js';
import type { CloudMetric, LabIteration, LabTrace } from './protocol.js';
import { numPoses } from './trace.js';
import { endReasonWords, formatNumber, REJECTION_WORDS, rejectionCounts } from './words.js';

export interface StepFacts {
  trace: LabTrace;
  iteration: LabIteration | null;
  metric: CloudMetric;
  /** Steps done before `iteration`; null where the source was dragged to. */
  at: number | null;
  /** Points of the source. */
  num_source: number;
}

/** `styles`: sideStyles. */
export function stepPanel(has: StepFacts, chart: TemplateResult): TemplateResult {
  const { trace, iteration, at } = has;
  const count = numPoses(trace) - 1;
  const before = at ? (trace.costs[at - 1] ?? null) : null;
  return html`
    <header>
      <h2>${placeWords(at, count)}</h2>
      <span class="muted">${endWords(trace)}</span>
    </header>
    ${iteration ? iterationFacts(iteration, before, has.num_source) : html`<p class="muted">The pairs are being searched…</p>`}
    ${chart}
    ${
      iteration
        ? html`<h3>The next step</h3>
            ${equation(iteration, has.metric)}`
        : nothing
    }
    ${iterationTable(trace.records)}
  `;
}

function placeWords(at: number | null, count: number): string {
  if (at === null) return 'Before the start';
  if (at === count) return 'At the end';
  return at === 0 ? 'At the start' : `After iteration ${at}`;
}

function endWords(trace: LabTrace): string {
  return `${plural(numPoses(trace) - 1, 'iteration')}, ${endReasonWords(trace)}`;
}

function iterationFacts(iteration: LabIteration, costBefore: number | null, numAll: number): TemplateResult {
  const { cost, inlier_rmse, fitness, source, rotation_step, translation_step, num_points } = iteration;
  const rejected = rejectionCounts(iteration);
  const change = costBefore ? (cost - costBefore) / costBefore : null;
  const numRejected = rejected.reduce((a, b) => a + b, 0);
  const changed =
    change === null ? nothing : html` <span class="muted">${change > 0 ? '+' : ''}${formatPercent(change)}</span>`;
  const drawn = num_points < numAll ? `${formatCount(num_points)} sampled while it moves` : 'the source';
  const reasons = rejected.flatMap((number, reason) =>
    number > 0 ? [`${formatCount(number)} ${REJECTION_WORDS[reason]}`] : [],
  );
  return facts([
    ['Cost', html`${formatNumber(cost)} m²${changed}`, 'Mean robust loss of a source point (m²)'],
    ['RMSE', formatLength(inlier_rmse), 'Root mean square of the residuals of the pairs that count'],
    ['Next step', `${formatStep(translation_step)}, ${formatAngle(rotation_step, 3)}`],
    ['Pairs', html`${formatCount(source.length)} <span class="muted">(${formatPercent(fitness)} of ${drawn})</span>`],
    ['Rejected', numRejected === 0 ? 'none' : reasons.join(', ')],
  ]);
}

/** The cost of each iteration of each method, on a logarithmic scale. */
export function costPainter(
  runs: readonly { costs: readonly number[]; color: string; isActive: boolean }[],
  count: number,
  at: number,
  colors: Colors,
): Painter {
  return (pen, size) => {
    const x = linearAxis({ low: 0, high: Math.max(count, 1) }, WHOLE);
    const series = runs.map(({ costs, color, isActive }) => {
      const known = costs.flatMap((cost, i) => (cost > 0 ? [[i, cost] as const] : []));
      return {
        x: known.map(([i]) => i),
        values: known.map(([, cost]) => cost),
        stride: 1,
        offset: 0,
        color,
        width: isActive ? 2.25 : 1.5,
        isDashed: false,
      };
    });
    drawSeries(pen, size, series, x, { x: 'iteration', y: 'cost (m²)' }, colors, 'log_fitted', '.0e');
    const area = plotArea(size);
    const where = area.x + area.width * x.share(at);
    pen.line([where, area.y, where, area.y + area.height], { color: colors.selected, width: 1.5 });
  };
}
