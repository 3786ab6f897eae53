/** The part of the panel beside the map that is about its loops: all of them, the one that is looked at, one that is put in. */
import { html, nothing, type TemplateResult } from 'lit';
import { statusBadge } from '../components/status-badge.js';
import type { Consequence, GraphLoop } from '../engine/protocol.js';
import { facts } from '../run/facts.js';
import { formatCount, formatFixed, formatLength, formatPercent, plural, sentence } from '../views/format.js';
import type { Status } from '../views/map-painter.js';
import { formatAngle } from '../views/pose-format.js';
import { fitOf } from './loop-layer.js';
import { composed } from './loop-poses.js';
import type { Draft, Mending } from './mending.js';

const WORDS: Record<Status, string> = { good: 'fits', doubtful: 'strained', lost: 'contradicted' };
/** What is to be done where so many scans are chosen, and once both are. */
const CHOOSE = [
  'Tap a scan on the map, or type its number.',
  'Now tap a second scan that saw the same place, or type its number. Of another piece, it joins the two.',
];
const DRAG =
  'Drag the second scan (pink) to where it fits the first (green), within 1 m and 17°; arrow keys move it, [ and ] turn it.';
/** So many loops are listed; all are drawn. */
const MOST_LISTED = 100;

export function loopPanel(mending: Mending): TemplateResult {
  const { loops, draft, problem } = mending;
  if (problem !== '') return html`<p>${problem}</p>`;
  if (!loops) return html`<p class="muted">Looking at the loops</p>`;
  if (!draft) return listOf(mending, loops.loops);
  return draft.kind === 'old' ? oneLoop(mending, draft.loop) : newLoop(mending, draft);
}

function listOf(mending: Mending, loops: readonly GraphLoop[]): TemplateResult {
  return html`<section aria-label="Loops">
    <p class="explanation">
      ${
        loops.length === 0
          ? 'The map has no loops.'
          : `${plural(loops.length, 'loop')} between scans, the least fitting first: how far each is from what the rest of the graph tells, in standard deviations.`
      }
    </p>
    ${
      mending.numPieces > 1
        ? html`<p class="explanation">
            The map is in ${mending.numPieces} pieces. A loop between scans of two of them, which saw the same place,
            joins these.
          </p>`
        : nothing
    }
    <ol class="loops">
      ${loops.slice(0, MOST_LISTED).map(
        (loop) =>
          html`<li>
            <button @click=${() => mending.prepare({ kind: 'old', loop })}>
              <span class="number">${loop.target} – ${loop.source}</span
              ><span class="number">${sigmasOf(loop)}</span>${badge(loop)}
            </button>
          </li>`,
      )}
    </ol>
    <button ?disabled=${!mending.isIdle} @click=${() => mending.prepare({ kind: 'new', scans: [], pose: null })}>
      Propose a loop
    </button>
  </section>`;
}

function oneLoop(mending: Mending, loop: GraphLoop): TemplateResult {
  const { x, y, theta } = loop.T_target_source;
  const { chi_squared: chiSquared } = loop;
  const exact = chiSquared < 1000 ? formatFixed(chiSquared, 1) : formatCount(chiSquared);
  const told = chiSquared > 0 ? exact : 'nothing else tells';
  return html`<section aria-label="Loop">
    <h3>Loop between ${scansOf(loop)}</h3>
    <p class="explanation">
      Both scans are drawn as the loop lays them on each other: the first green, the second pink.
    </p>
    ${facts(
      [
        ['Fit', badge(loop)],
        ['Chi-squared', told],
        ['The second from the first', `${formatFixed(x, 2)}, ${formatFixed(y, 2)} m, ${formatAngle(theta, 1)}`],
        ['Known to', `${formatLength(loop.position_sigma)}, ${formatAngle(loop.heading_sigma, 1)}`],
        ['Returns that agree', loop.is_unchecked ? 'put in without a match' : formatPercent(loop.agreement)],
      ],
      'number',
    )}
    ${decision(mending, 'Remove this loop')}
  </section>`;
}

function newLoop(mending: Mending, { scans, pose }: Draft & { kind: 'new' }): TemplateResult {
  const { poses } = mending;
  const field = (at: 0 | 1, label: string): TemplateResult =>
    html`<label
      >${label}<input
        type="number"
        min="0"
        max=${poses.length - 1}
        .value=${String(scans[at] ?? '')}
        ?disabled=${at > scans.length}
        @change=${({ target }: Event) => {
          const scan = (target as HTMLInputElement).valueAsNumber;
          if (poses[scan]) mending.chooseScan(scan, at);
        }}
    /></label>`;
  const first = poses[scans[0] ?? -1];
  const lay = (label: string, turn: number): TemplateResult =>
    html`<button @click=${() => first && mending.lay(composed(first, { x: 0, y: 0, theta: turn }))}>${label}</button>`;
  return html`<section aria-label="New loop">
    <h3>New loop</h3>
    <p class="explanation">${pose ? DRAG : (CHOOSE[scans.length] ?? '')}</p>
    <div class="fields">${field(0, 'First scan')}${field(1, 'Second scan')}</div>
    ${
      pose
        ? html`<div class="actions" role="group" aria-label="Where the second scan lies">
            ${lay('On the first', 0)} ${lay('Turned round', Math.PI)}
            <button @click=${() => mending.chooseScan(scans[1] ?? 0, 1)}>As in the map</button>
            <button aria-label="Turn left" @click=${() => mending.move(0, 0, Math.PI / 18)}>⟲</button>
            <button aria-label="Turn right" @click=${() => mending.move(0, 0, -Math.PI / 18)}>⟳</button>
          </div>`
        : nothing
    }
    ${decision(mending, 'Add this loop')}
  </section>`;
}

function decision(mending: Mending, action: string): TemplateResult {
  const { consequence } = mending;
  const isRefused = consequence === null || consequence.refusal !== null;
  const isAwaited = consequence === null && mending.step !== null;
  return html`${isAwaited ? html`<p class="explanation">Looking at what it changes</p>` : nothing}
    ${
      consequence
        ? html`<ul class="consequence" aria-label="What it changes">
            ${consequenceWords(consequence).map((words) => html`<li>${words}</li>`)}
          </ul>`
        : nothing
    }
    <div class="actions decision">
      <button class="primary" ?disabled=${isRefused || !mending.isIdle} @click=${() => mending.take()}>
        ${action}
      </button>
      <button @click=${() => mending.prepare(null)}>Back</button>
    </div>`;
}

function scansOf({ target, source }: { target: number; source: number }): string {
  return `scans ${target} and ${source}`;
}

function sigmasOf({ chi_squared: chiSquared }: GraphLoop): string {
  return chiSquared > 0 ? `${formatFixed(Math.sqrt(chiSquared), 1)} σ` : '';
}

function badge(loop: GraphLoop): TemplateResult {
  const fit = fitOf(loop);
  return statusBadge(fit, loop.chi_squared > 0 ? WORDS[fit] : 'nothing else tells');
}

/** In whole sentences. */
function consequenceWords(consequence: Consequence): string[] {
  const { refusal, chi_squared: [before, after] = [0, 0], num_pieces: [piecesBefore, pieces] = [0, 0] } = consequence;
  if (refusal !== null) return [`Refused: ${sentence(refusal)}`];
  const { furthest, furthest_moves: far, mean_moves: mean } = consequence;
  const { num_becoming_good: numBetter, num_no_longer_good: numWorse, left_out: leftOut } = consequence;
  const [first] = leftOut;
  return [
    far < 0.001
      ? 'No scan moves by a millimetre.'
      : `Scans move by ${formatLength(mean)} in the mean, scan ${furthest} by ${formatLength(far)}.`,
    `Chi-squared of the graph is ${formatFixed(before, 1)} before and ${formatFixed(after, 1)} after.`,
    ...(pieces === piecesBefore ? [] : [`${plural(pieces, 'piece')} in place of ${piecesBefore}.`]),
    ...(numBetter === 0 ? [] : [`${plural(numBetter, 'scan')} ${numBetter === 1 ? 'becomes' : 'become'} good.`]),
    ...(numWorse === 0 ? [] : [`${plural(numWorse, 'scan')} ${numWorse === 1 ? 'is' : 'are'} no longer good.`]),
    ...(first
      ? [`${plural(leftOut.length, 'loop')} no longer fit, the first between scans ${first.join(' and ')}.`]
      : []),
  ];
}
