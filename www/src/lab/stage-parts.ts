/** What lies beneath the stage: the legend of its colours, and the controls that play the run. */
import { html, nothing, type TemplateResult } from 'lit';
import { check, slider } from '../components/fields.js';
import { NEXT, PREVIOUS, RESET } from '../components/panel-icons.js';
import { type Choices, list } from '../components/list-field.js';
import { iconButton } from '../components/icon-button.js';
import { type Sign } from '../components/icons.js';
import { formatCount } from '../views/format.js';
import { gradient, PAIR_COLORS, type PairColor, REJECTION_COLORS } from './pair-colors.js';
import type { StageLook } from './plane-painter.js';
import type { Player } from './player.js';
import type { LabIteration } from './protocol.js';
import { REJECTION_WORDS, rejectionCounts } from './words.js';

/** The sign of each reason, as the stage draws it. */
const SIGNS = ['◇', '×', '+', '+'] as const;
const STRETCHES: Choices<number> = [1, 5, 20, 100].map((times) => [times, `× ${times}`]);
const SPEEDS: Choices<number> = [0.5, 1, 2, 4].map((times) => [times, `${times} ×`]);

export interface LegendFacts {
  look: StageLook;
  iteration: LabIteration | null;
  /** In space pairs have their true length, and normals are not drawn. */
  is_planar: boolean;
  hasNormals: boolean;
  dark: boolean;
  change(look: StageLook): void;
}

export function legend({ look, iteration, is_planar, hasNormals, dark, change }: LegendFacts): TemplateResult {
  const counts = iteration ? rejectionCounts(iteration) : [];
  const ends = PAIR_COLORS.find(({ value }) => value === look.colorBy)?.ends ?? ['', ''];
  const box = (name: 'pairs' | 'rejected' | 'normals', label: string): TemplateResult =>
    check(label, look[name], (isOn) => change({ ...look, [name]: isOn }));
  const colors: Choices<PairColor> = PAIR_COLORS.map(({ value, label }) => [value, label]);
  return html`<div class="legend" role="group" aria-label="Pairs">
    <label>Colour ${list(colors, look.colorBy, (colorBy) => change({ ...look, colorBy }))}</label>
    <span class="scale number"
      >${ends[0]}<i style="background: linear-gradient(to right, ${gradient(dark)})"></i>${ends[1]}</span
    >
    ${box('pairs', 'Pairs')}
    ${
      is_planar
        ? html`<label
            >Pair length
            ${list(STRETCHES, look.stretch, (stretch) => change({ ...look, stretch }), {
              hint: 'Magnification of the drawn pairs',
            })}</label
          >`
        : nothing
    }
    ${is_planar && hasNormals ? box('normals', 'Normals') : nothing} ${box('rejected', 'Rejected points')}
    ${counts.map((count, reason) =>
      count === 0
        ? nothing
        : html`<span class="sign"
            ><b style="color: ${REJECTION_COLORS[reason]?.[dark ? 'dark' : 'light']}" aria-hidden="true"
              >${SIGNS[reason]}</b
            >${formatCount(count)} ${REJECTION_WORDS[reason]}</span
          >`,
    )}
  </div>`;
}

export interface Transport {
  player: Player;
  state: string;
  step(direction: 1 | -1): void;
  toStart(): void;
}

export function transport({ player, state, step, toStart }: Transport): TemplateResult {
  const { at, count, isPlaying } = player;
  const button = (sign: Sign, label: string, isOff: boolean, press: () => void): TemplateResult =>
    iconButton(sign, label, press, { hint: label, kind: '', isOff: isOff });
  return html`<div class="transport" role="group" aria-label="Iterations">
    ${button(RESET, 'Back to the start', count === 0, toStart)}
    ${button(PREVIOUS, 'One iteration back (,)', at <= 0, () => step(-1))}
    ${
      isPlaying
        ? button('pause', 'Pause (space bar)', false, () => player.pause())
        : button('play', 'Play the iterations (space bar)', count === 0, () => player.play())
    }
    ${button(NEXT, 'One iteration on (.)', at >= count, () => step(1))}
    ${slider(Math.round(at), { label: 'Iteration', max: count, words: state, isOff: count === 0 }, (to) => player.seek(to))}
    <output class="number" aria-hidden="true">${Math.floor(at + 1e-9)}<span class="muted"> / ${count}</span></output>
    ${list(SPEEDS, player.speed, (speed) => (player.speed = speed), { label: 'Speed', hint: 'Speed' })}
  </div>`;
}
