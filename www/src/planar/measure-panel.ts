/** The part of the panel beside the map that measures it. */
import { css, html, nothing, type TemplateResult } from 'lit';
import type { ScanAt } from '../engine/protocol.js';
import { facts } from '../run/facts.js';
import { formatFixed, plural } from '../views/format.js';
import { formatAngle } from '../views/pose-format.js';
import type { Place } from './grid-tools.js';
import { choice, number, pointForm } from './panel-fields.js';
import { angleAt, areaOf, crossesItself, directionOf, lengthOf, type MapMeasuring } from './map-measuring.js';

const MODES = [
  ['points', 'Distance and area'],
  ['scans', 'Scans at a place'],
] as const;
/** So many scans are listed; the beams of all are drawn. */
const MOST_LISTED = 200;

/** `select`: a scan of the map. */
export function measurePanel(
  measuring: MapMeasuring,
  selected: number | null,
  select: (scan: number) => void,
): TemplateResult {
  const { mode, cross, isEmpty } = measuring;
  return html`<section aria-label="Measure">
    ${choice('What is measured', MODES, mode, (chosen) => measuring.choose(chosen))}
    <p class="explanation">
      ${
        mode === 'points'
          ? 'Tap points of the map, drag one to move it, or type its coordinates. With the keyboard, arrow keys move the map, Enter takes the point under the cross, Backspace removes the last.'
          : 'Tap a place: scans whose beams end in its cell are drawn pink, those whose beams pass through it grey. With the keyboard, arrow keys move the map and Enter takes the place under the cross.'
      }
    </p>
    ${facts([['Under the cross', cross ? placeWords([cross.x, cross.y], cross.decimals) : '']], 'number')}
    ${pointForm('Point', 'Take', (place) => measuring.take(place))}
    <div class="actions">
      <button ?disabled=${isEmpty} title="Backspace" @click=${() => measuring.back()}>Remove the last</button>
      <button ?disabled=${isEmpty} title="Escape" @click=${() => measuring.clear()}>Clear</button>
    </div>
    ${mode === 'points' ? pointFacts(measuring.points.corners) : scanList(measuring, selected, select)}
  </section>`;
}

const placeWords = ([x, y]: Place, decimals = 2): string =>
  `x ${formatFixed(x, decimals)} m, y ${formatFixed(y, decimals)} m`;

/** What the points tell. */
function pointFacts(places: readonly Place[]): TemplateResult | typeof nothing {
  const [last = null, before = null, third = null] = [places.at(-1), places.at(-2), places.at(-3)];
  if (!last) return nothing;
  const isArea = places.length > 2;
  const area = crossesItself(places) ? 'none: the way crosses itself' : `${formatFixed(areaOf(places), 2)} m²`;
  return html`<output role="status">
    ${facts(
      [
        ['Last point', placeWords(last)],
        before && ['Distance', `${formatFixed(lengthOf([before, last]), 3)} m`],
        before && ['Direction', formatAngle(directionOf(before, last), 1)],
        before && third && ['Angle at the point before', formatAngle(angleAt(third, before, last), 1)],
        isArea && ['Along all points', `${formatFixed(lengthOf(places), 3)} m`],
        isArea && ['Round them', `${formatFixed(lengthOf([...places, ...places.slice(0, 1)]), 3)} m`],
        isArea && ['Area', area],
      ],
      'number',
    )}
  </output>`;
}

function scanList(measuring: MapMeasuring, selected: number | null, select: (scan: number) => void): TemplateResult {
  const { place, scans, side, problem } = measuring;
  const sideField = number('Side of the cell', 'Side of the cell (m)', side, (to) => measuring.widen(to));
  const count = (of: 'num_ended' | 'num_passed'): number => (scans ?? []).filter((scan) => scan[of] > 0).length;
  const told =
    place &&
    (scans
      ? `${plural(scans.length, 'scan')} at ${placeWords(place)}: beams of ${count('num_ended')} end there, of ${count('num_passed')} pass.`
      : 'Looking for the scans');
  return html`<div class="fields">${sideField}</div>
    ${problem !== '' ? html`<p role="status">${problem}</p>` : place ? html`<p role="status">${told}</p>` : nothing}
    <ol class="loops" aria-label="Scans at the place">
      ${(scans ?? []).slice(0, MOST_LISTED).map(
        (scan) =>
          html`<li>
            <button aria-pressed=${scan.scan === selected} @click=${() => select(scan.scan)}>
              <span class="number">scan ${scan.scan}</span><span>${beamWords(scan)}</span>
            </button>
          </li>`,
      )}
    </ol>`;
}

const beamWords = ({ num_ended: ended, num_passed: passed }: ScanAt): string =>
  [ended > 0 ? `${ended} end` : '', passed > 0 ? `${passed} pass` : ''].filter(Boolean).join(', ');

export const measureStyles = css`
  output {
    display: block;
  }
  .loops button[aria-pressed='true'] {
    border-color: var(--accent);
    box-shadow: inset 0 0 0 1px var(--accent);
  }
`;
