/** Parts of the panels beside the map, the same for scans and for frames. */
import { css, html, nothing, type TemplateResult } from 'lit';
import { barAt, barChart, CHART_VIEW_BOX } from '../views/chart.js';
import { baseName, plural, sentence } from '../views/format.js';
import type { Status } from '../views/map-painter.js';
import { cssColor, type Rgb } from '../views/palette.js';
import { iconButton } from '../components/icon-button.js';
import { type Sign } from '../components/icons.js';
import { NEXT, PREVIOUS } from '../components/panel-icons.js';
import { statusBadge } from '../components/status-badge.js';

/** What a frame is called. */
export type Noun = 'scan' | 'frame';
type Select = (frame: number | null) => void;

interface NamedFrame {
  name: string;
  status: Status;
  /** Why it is not good; empty where it is. */
  reason: string;
}

/** Of a run that went wrong as a whole, the first few places say enough; more are listed when they are asked for. */
const MAX_BAD_SHOWN = 6;
const MAX_BAD_LISTED = 200;

/** Name and assessment of the selected frame, and the way to its neighbours and back to all. */
export function frameHeader(
  noun: Noun,
  frames: readonly NamedFrame[],
  index: number,
  color: Rgb | undefined,
  select: Select,
): TemplateResult | typeof nothing {
  const frame = frames[index];
  if (!frame) return nothing;
  const step = (sign: Sign, label: string, key: string, to: number | null): TemplateResult =>
    iconButton(sign, label, () => select(to), { hint: `${label} (${key})`, isOff: to !== null && !frames[to] });
  return html`<header>
    ${swatch(color)}
    <h2 title=${frame.name}>${baseName(frame.name)}</h2>
    ${statusBadge(frame.status)}
    <span class="steps">
      ${step(PREVIOUS, `Previous ${noun}`, ',', index - 1)} ${step(NEXT, `Next ${noun}`, '.', index + 1)}
      ${step('close', `Back to all ${noun}s`, 'Esc', null)}
    </span>
  </header>`;
}

/** Number of the frames that are not good. */
export function numBad(frames: readonly NamedFrame[]): number {
  return frames.filter(({ status }) => status !== 'good').length;
}

/** Those that need a look, with the reason: each run of alike ones is a button that selects its first. */
export function badList(frames: readonly NamedFrame[], colors: readonly Rgb[], select: Select): TemplateResult {
  const runs = badRuns(frames);
  const count = (some: readonly BadRun[]): number => some.reduce((sum, { first, last }) => sum + last - first + 1, 0);
  const row = ({ first, last, status, reason }: BadRun): TemplateResult =>
    html`<li class="bad">
      <button @click=${() => select(first)}>
        ${swatch(colors[first])}<span class="names">${runName(frames, first, last)}</span>${statusBadge(status)}
      </button>
      <p class="muted">${sentence(reason)}</p>
    </li>`;
  const others = runs.slice(MAX_BAD_SHOWN, MAX_BAD_LISTED);
  const numUnlisted = count(runs.slice(MAX_BAD_LISTED));
  return html`<ul>
      ${runs.slice(0, MAX_BAD_SHOWN).map(row)}
    </ul>
    ${
      others.length > 0
        ? html`<details class="others">
            <summary>and ${count(runs.slice(MAX_BAD_SHOWN))} more</summary>
            <ul>
              ${others.map(row)}
              ${numUnlisted > 0 ? html`<li class="muted">and ${numUnlisted} more, which the table names</li>` : nothing}
            </ul>
          </details>`
        : nothing
    }`;
}

interface BadRun {
  first: number;
  last: number;
  status: Status;
  reason: string;
}

/** Consecutive frames that are not good for the same reason, regardless of the numbers in it. */
function badRuns(frames: readonly NamedFrame[]): BadRun[] {
  const runs: BadRun[] = [];
  frames.forEach(({ status, reason }, frame) => {
    if (status === 'good') return;
    const run = runs.at(-1);
    const isAlike = run && run.last === frame - 1 && run.status === status && kind(run.reason) === kind(reason);
    if (isAlike) run.last = frame;
    else runs.push({ first: frame, last: frame, status, reason });
  });
  return runs;
}

function kind(reason: string): string {
  return reason.replace(/[\d.]+/g, '');
}

/** "#4" or "#4 to #7" of a log, "4.ply" or "4.ply to 7.ply" of files. */
function runName(frames: readonly NamedFrame[], first: number, last: number): string {
  const short = (frame: number): string => baseName(frames[frame]?.name ?? '').replace(/^.*(?=#\d+$)/, '');
  return first === last ? short(first) : `${short(first)} to ${short(last)}`;
}

function swatch(color: Rgb = [0, 0, 0]): TemplateResult {
  return html`<i class="swatch" style="background: ${cssColor(color)}"></i>`;
}

export interface FrameBars {
  noun: Noun;
  frames: readonly NamedFrame[];
  colors: readonly Rgb[];
  selected: number | null;
  select: Select;
  title: string;
  /** What is good and what is bad; empty where the title says enough. */
  explanation?: string;
  /** One for each frame; null where there is none. */
  values: readonly (number | null)[];
  format: (value: number) => string;
  /** What stands under the first and the last bar. */
  ends?: readonly [string, string];
}

/** A bar for each frame, which selects it; nothing where no frame has a value. */
export function frameBars(bars: FrameBars): TemplateResult | typeof nothing {
  const { noun, frames, selected, title, values, format } = bars;
  const known = values.filter((value) => value !== null);
  if (known.length === 0) return nothing;
  const [low, high] = [known.reduce((a, b) => Math.min(a, b)), known.reduce((a, b) => Math.max(a, b))];
  const here = selected === null ? null : (values[selected] ?? null);
  return html`<section>
    <h3>${title}${here === null ? nothing : html` <span class="here number">${format(here)}</span>`}</h3>
    ${bars.explanation ? html`<p class="explanation">${bars.explanation}</p>` : nothing}
    <svg
      class="bars"
      viewBox=${CHART_VIEW_BOX}
      role="img"
      aria-label="${title}: from ${format(low)} to ${format(high)} over ${plural(known.length, noun)}."
      @click=${(event: MouseEvent) => {
        const box = (event.currentTarget as Element).getBoundingClientRect();
        const frame = barAt((event.clientX - box.left) / box.width, values);
        if (frame !== null) bars.select(frame);
      }}
    >
      ${barChart({
        values,
        format,
        color: (frame) => cssColor(bars.colors[frame] ?? [0, 0, 0]),
        name: (frame) => baseName(frames[frame]?.name ?? ''),
        selected,
        ends: bars.ends,
      })}
    </svg>
  </section>`;
}

/** With `statusStyles` and `panelStyles`. */
export const frameStyles = css`
  section > svg {
    width: 100%;
    height: auto;
    color: var(--muted);
  }
  section > svg + h3 {
    margin-top: 10px;
  }
  .axes line {
    stroke: var(--line);
  }
  .axes text {
    fill: var(--muted);
    font-size: 10.5px; /* of the chart, which grows with its width */
    font-variant-numeric: tabular-nums;
  }
  .steps {
    display: flex;
    margin-left: auto;
  }
  ul {
    display: grid;
    grid-template-columns: minmax(0, 1fr);
    justify-items: start;
    gap: 6px;
  }
  .bad {
    display: grid;
    grid-template-columns: minmax(0, 1fr);
    justify-items: start;
    gap: 2px;
    max-width: 100%;
  }
  .bad button {
    max-width: 100%;
  }
  .bad .names {
    overflow: hidden;
    text-overflow: ellipsis;
  }
  .bad p {
    font-size: calc(12.5 * var(--px));
  }
  .others summary {
    padding: 4px 0;
    color: var(--accent);
  }
  .facts {
    display: grid;
    grid-template-columns: auto 1fr;
    gap: 4px 14px;
    font-size: calc(13 * var(--px));
  }
  .facts dt {
    color: var(--muted);
  }
  .here {
    float: right;
    color: var(--selected);
  }
  svg.bars {
    cursor: pointer;
  }
`;
