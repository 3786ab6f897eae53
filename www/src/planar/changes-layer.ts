/** What moved between several recordings, on the map they make together: things that are new and things that are gone. */
import { html, svg, type TemplateResult } from 'lit';
import { changeWords, countOf, countWords } from '../../../package/report/change_words.js';
import type { Change, ChangeKind, RecordingChanges } from '../engine/protocol.js';
import type { MapExtra } from '../views/map-layer.js';
import { type Context, DARK_MAP, LIGHT_MAP } from '../views/map-painter.js';
import { type Size, toScreenX, toScreenY, type Viewport } from '../views/viewport.js';

/** Orange and blue, which all kinds of colour blindness tell apart (Okabe and Ito 2008); the signs differ as well. */
const COLORS: Record<'light' | 'dark', Record<ChangeKind, string>> = {
  light: { new: '#c24e00', gone: '#0072b2' },
  dark: { new: '#ffa94d', gone: '#56b4e9' },
};
const SIGN = 11;
/** A thing is marked by a sign at least so far across (CSS pixels). */
const LEAST = 14;
/** Side of a cell of the grid (m). */
const CELL = 0.05;
const KINDS: readonly ChangeKind[] = ['new', 'gone'];

/** Null where nothing was compared. */
export function changesExtra(all: readonly RecordingChanges[]): MapExtra | null {
  if (all.length === 0) return null;
  const changes = all.flatMap(({ changes }) => changes);
  return {
    label: 'What moved',
    sign: 'moved',
    isBehind: false,
    paint: (ctx, size, view, dark) => changes.forEach((change) => paint(change, ctx, size, view, dark)),
    legend: legendOf(all),
  };
}

/** The cells of a thing, and a frame around it: a full square for what is new, a dashed circle for what is gone. */
function paint(
  { kind, middle, size: across, cells }: Change,
  ctx: Context,
  size: Size,
  view: Viewport,
  dark: boolean,
): void {
  const at = ([x, y]: readonly [number, number]): [number, number] => [
    toScreenX(view, size, x, y),
    toScreenY(view, size, x, y),
  ];
  ctx.save();
  const side = Math.max(CELL * view.scale, 2);
  ctx.fillStyle = COLORS[dark ? 'dark' : 'light'][kind];
  for (const cell of cells) {
    const [x, y] = at(cell);
    ctx.fillRect(x - side / 2, y - side / 2, side, side);
  }
  const half = Math.max(across * view.scale, LEAST) / 2 + 5;
  const [x, y] = at(middle);
  ctx.beginPath();
  if (kind === 'new') ctx.rect(x - half, y - half, 2 * half, 2 * half);
  else ctx.arc(x, y, half * Math.SQRT2, 0, 2 * Math.PI);
  for (const [color, width] of [
    [(dark ? DARK_MAP : LIGHT_MAP).halo, 5],
    [COLORS[dark ? 'dark' : 'light'][kind], 2.5],
  ] as const) {
    ctx.setLineDash(kind === 'gone' && width < 5 ? [6, 4] : []);
    ctx.strokeStyle = color;
    ctx.lineWidth = width;
    ctx.stroke();
  }
  ctx.restore();
}

function legendOf(all: readonly RecordingChanges[]): TemplateResult {
  return html`<ul class="changes" aria-label="What moved">
    ${all.map((of) =>
      of.changes.length === 0
        ? html`<li>${changeWords(of)}</li>`
        : html`<li title=${changeWords(of)}>
            <span><strong>${of.name}</strong> against the recordings before it:</span>
            ${KINDS.map((kind) => html`<span>${signOf(kind)}${countWords(countOf(of, kind), kind)}</span>`)}
          </li>`,
    )}
  </ul>`;
}

function signOf(kind: ChangeKind): TemplateResult {
  const color = `light-dark(${COLORS.light[kind]}, ${COLORS.dark[kind]})`;
  const half = SIGN / 2;
  const shape =
    kind === 'new'
      ? svg`<rect x="1.5" y="1.5" width=${SIGN - 3} height=${SIGN - 3} />`
      : svg`<circle cx=${half} cy=${half} r=${half - 1.5} stroke-dasharray="3 2" />`;
  return html`<svg
    width=${SIGN}
    height=${SIGN}
    aria-hidden="true"
    style="fill: none; stroke: ${color}; stroke-width: 2"
  >
    ${shape}
  </svg>`;
}
