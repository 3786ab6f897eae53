/** Small charts as SVG. Plain numbers in, a picture out; words for those who cannot see it come with it. */
import { nothing, type SVGTemplateResult, svg } from 'lit';

export interface ChartSpec {
  /** One value per step, from the first on. */
  values: readonly number[];
  /** What a value is called, as in "rmse 12.3 mm". */
  format: (value: number) => string;
  /** What a step is called, as in "round 3". */
  step: string;
  /** The first step's number. */
  first: number;
  color: string;
  /** Linear from zero, or logarithmic from the smallest value. */
  scale: 'linear' | 'log';
}

const WIDTH = 288;
const HEIGHT = 84;
const LEFT = 52;
const RIGHT = 8;
const TOP = 8;
const BOTTOM = 18;

/** A line with a dot for each step, the value of the largest and the smallest at the side. */
export function lineChart({ values, format, step, first, color, scale }: ChartSpec): SVGTemplateResult {
  const [low, high] = scale === 'log' ? logRange(values) : [0, largest(values)];
  const share = (value: number): number =>
    scale === 'log' ? Math.log(Math.max(value, low) / low) / Math.log(high / low) : value / high;
  const x = (i: number): number =>
    values.length > 1 ? LEFT + (i / (values.length - 1)) * (WIDTH - LEFT - RIGHT) : (LEFT + WIDTH - RIGHT) / 2;
  const y = (value: number): number => HEIGHT - BOTTOM - share(value) * (HEIGHT - TOP - BOTTOM);
  const points = values.map((value, i) => `${x(i).toFixed(1)},${y(value).toFixed(1)}`).join(' ');
  return svg`
    <g class="axes">
      <line x1=${LEFT} x2=${WIDTH - RIGHT} y1=${y(high)} y2=${y(high)} />
      <line x1=${LEFT} x2=${WIDTH - RIGHT} y1=${y(low)} y2=${y(low)} />
      <text x=${LEFT - 6} y=${y(high)} text-anchor="end" dominant-baseline="central">${format(high)}</text>
      <text x=${LEFT - 6} y=${y(low)} text-anchor="end" dominant-baseline="central">${format(low)}</text>
      <text x=${x(0)} y=${HEIGHT - 3} text-anchor=${values.length > 1 ? 'start' : 'middle'}>${step} ${first}</text>
      ${
        values.length > 1
          ? svg`<text x=${WIDTH - RIGHT} y=${HEIGHT - 3} text-anchor="end">${first + values.length - 1}</text>`
          : nothing
      }
    </g>
    <polyline points=${points} fill="none" stroke=${color} stroke-width="1.75" stroke-linejoin="round" />
    ${
      values.length <= 60
        ? values.map(
            (value, i) => svg`<circle cx=${x(i)} cy=${y(value)} r="2.6" fill=${color}>
              <title>${step} ${first + i}: ${format(value)}</title>
            </circle>`,
          )
        : nothing
    }`;
}

export interface BarSpec {
  values: readonly (number | null)[];
  format: (value: number) => string;
  /** Of a frame: asked for those that are shown alone. */
  color: (frame: number) => string;
  name: (frame: number) => string;
  selected: number | null;
  /** What stands under the first and the last bar. */
  ends?: readonly [string, string] | undefined;
}

/** More bars than these would be too thin to distinguish. */
const MAX_BARS = 150;

/** One bar per frame, in the frame's colour; of many frames, one per run of them, as high as their largest. */
export function barChart({ values, format, color, name, selected, ends }: BarSpec): SVGTemplateResult {
  const high = largest(values.filter((value) => value !== null));
  const numBars = Math.min(values.length, MAX_BARS);
  const pitch = (WIDTH - LEFT - RIGHT) / Math.max(numBars, 1);
  const gap = pitch > 4 ? Math.min(pitch * 0.25, 5) : 0;
  const bars = Array.from({ length: numBars }, (_, i) => {
    const first = Math.floor((i * values.length) / numBars);
    const last = Math.floor(((i + 1) * values.length) / numBars);
    const frame = largestIn(values, first, last);
    return { frame, isSelected: selected !== null && selected >= first && selected < last };
  });
  return svg`
    <g class="axes">
      <line x1=${LEFT} x2=${WIDTH - RIGHT} y1=${TOP} y2=${TOP} />
      <line x1=${LEFT} x2=${WIDTH - RIGHT} y1=${HEIGHT - BOTTOM} y2=${HEIGHT - BOTTOM} />
      <text x=${LEFT - 6} y=${TOP} text-anchor="end" dominant-baseline="central">${format(high)}</text>
      <text x=${LEFT - 6} y=${HEIGHT - BOTTOM} text-anchor="end" dominant-baseline="central">${format(0)}</text>
      <text x=${LEFT} y=${HEIGHT - 3}>${ends?.[0] ?? 'first scan'}</text>
      <text x=${WIDTH - RIGHT} y=${HEIGHT - 3} text-anchor="end">${ends?.[1] ?? 'last'}</text>
    </g>
    ${bars.map(({ frame, isSelected }, i) => {
      const value = values[frame] ?? null;
      if (value === null) return nothing;
      const height = Math.max((value / high) * (HEIGHT - TOP - BOTTOM), 0.5);
      return svg`<rect
        x=${(LEFT + i * pitch + gap / 2).toFixed(2)}
        width=${(pitch - gap).toFixed(2)}
        y=${(HEIGHT - BOTTOM - height).toFixed(2)}
        height=${height.toFixed(2)}
        rx=${gap > 1 ? 1.5 : 0}
        fill=${isSelected ? 'var(--selected)' : color(frame)}
      ><title>${name(frame)}: ${format(value)}</title></rect>`;
    })}`;
}

/** The frame under a place, given as a share of the chart's width; null beside the bars. */
export function barAt(share: number, values: readonly (number | null)[]): number | null {
  const numBars = Math.min(values.length, MAX_BARS);
  const bar = Math.floor(((share * WIDTH - LEFT) / (WIDTH - LEFT - RIGHT)) * numBars);
  if (bar < 0 || bar >= numBars) return null;
  const first = Math.floor((bar * values.length) / numBars);
  return largestIn(values, first, Math.floor(((bar + 1) * values.length) / numBars));
}

function largestIn(values: readonly (number | null)[], first: number, last: number): number {
  let largest = first;
  for (let i = first; i < last; i++) {
    if ((values[i] ?? Number.NEGATIVE_INFINITY) > (values[largest] ?? Number.NEGATIVE_INFINITY)) largest = i;
  }
  return largest;
}

export const CHART_VIEW_BOX = `0 0 ${WIDTH} ${HEIGHT}`;

/** The largest value, or 1 where none is above zero: an axis needs a length. */
function largest(values: readonly number[]): number {
  return values.filter(Number.isFinite).reduce((a, b) => Math.max(a, b), 0) || 1;
}

/** The smallest and the largest value above zero, at least a factor of ten apart. */
function logRange(values: readonly number[]): [number, number] {
  const positive = values.filter((value) => value > 0 && Number.isFinite(value));
  const high = largest(positive);
  const low = positive.reduce((a, b) => Math.min(a, b), high);
  return [Math.min(low, high / 10), high];
}
