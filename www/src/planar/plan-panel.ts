/** The part of the panel beside the map that lays a building plan behind it. */
import { css, html, nothing, type TemplateResult } from 'lit';
import { slider } from '../components/fields.js';
import type { PlacedPlan } from '../engine/protocol.js';
import { facts } from '../run/facts.js';
import { formatFixed, formatLength, formatPercent } from '../views/format.js';
import { formatAngle } from '../views/pose-format.js';
import type { Place } from './grid-tools.js';
import type { Mending } from './mending.js';
import { number } from './panel-fields.js';
import './plan-picture.js';
import type { PlanTools } from './plan-tools.js';

export function planPanel(mending: Mending): TemplateResult {
  const { plan, isDone } = mending;
  const { sheet, pairs, placed, problem } = plan;
  return html`<section aria-label="Plan">
    <p class="explanation">
      ${sheet ? nextWords(plan) : 'A plan of the building is laid behind the map, as a scan or photograph that is not distorted.'}
    </p>
    <scanstitch-plan-picture
      .sheet=${sheet}
      .places=${pairs.map(({ picture }) => picture)}
      @picture-chosen=${({ detail }: CustomEvent<File>) => plan.choose(detail)}
      @picture-tapped=${({ detail }: CustomEvent<Place>) => plan.tapPicture(detail)}
      @picture-moved=${({ detail: { at, place } }: CustomEvent<{ at: number; place: Place }>) => plan.movePicture(at, place)}
    ></scanstitch-plan-picture>
    ${problem === '' ? nothing : html`<p role="status">${problem}</p>`}
    ${placed?.contradiction ? html`<p role="status" class="doubt">${placed.contradiction} Correct the points, or say how exact they are.</p>` : nothing}
    ${pairs.length > 0 ? pointFields(plan) : nothing} ${placed ? placedFields(plan, placed) : nothing}
    <div class=${placed ? 'actions decision' : 'actions'}>
      <button class="primary" ?disabled=${!isDone || !plan.isNew} @click=${() => mending.layPlan()}>
        Lay the plan
      </button>
      ${plan.isLaid ? html`<button ?disabled=${!isDone} @click=${() => mending.removePlan()}>Take it off</button>` : nothing}
    </div>
  </section>`;
}

/** What is to be done next. */
function nextWords(plan: PlanTools): string {
  const { pairs } = plan;
  const at = plan.next('picture');
  const wantsMap = plan.next('map');
  if (at < pairs.length) return `Now tap point ${at + 1} in the picture: the place that you have taken on the map.`;
  if (wantsMap < pairs.length)
    return `Now tap point ${wantsMap + 1} on the map: the place that you have taken in the picture. Or type its coordinates.`;
  if (pairs.length < 3) {
    const more = [
      'Tap a corner of the building in the picture, then the same corner on the map. Three corners at least, far apart.',
      'Two more corners, far from the first.',
      'One more corner.',
    ];
    return more[pairs.length] ?? '';
  }
  return 'Drag points to correct them, or add more. The circles are where the plan has them.';
}

function pointFields(plan: PlanTools): TemplateResult {
  return html`<ol class="points" aria-label="Points of the plan">
    ${plan.pairs.map(({ picture, map }, at) => {
      const residual = plan.placed?.residuals[at];
      return html`<li class="fields known">
        <span class="number">${at + 1}</span>
        ${(['x', 'y'] as const).map((name, axis) =>
          number(name, `${name} of point ${at + 1} in the map (m)`, map[axis] ?? null, (to) => plan.type(at, axis, to)),
        )}
        <span class="number off"
          >${picture === null ? 'not in the picture yet' : residual === undefined ? nothing : `off ${formatFixed(residual, 2)} m`}</span
        >
        <button aria-label="Remove point ${at + 1}" title="Remove" @click=${() => plan.remove(at)}>×</button>
      </li>`;
    })}
  </ol>`;
}

/** How it lies, how exact its points are, and how much of it is seen. */
function placedFields(plan: PlanTools, { pixel, turn }: PlacedPlan): TemplateResult {
  const { accuracy, opacity } = plan;
  return html`${facts(
      [
        ['Side of a pixel', formatLength(pixel)],
        ['Turned by', formatAngle(turn, 1)],
      ],
      'number',
    )}
    <label class="opacity"
      >Opacity
      ${slider(opacity, { label: 'Opacity of the plan', step: 0.05, words: formatPercent(opacity) }, (to) => plan.show(to))}</label
    >
    <div class="fields">
      ${number('Points are exact to (m)', 'Standard deviation of a point (m)', accuracy, (to) => plan.trust(to))}
    </div>`;
}

export const planStyles = css`
  .points {
    display: grid;
    gap: 4px;
  }
  .points li {
    flex-wrap: nowrap;
    align-items: center;
  }
  .points span {
    flex: none;
  }
  .points .off {
    min-width: calc(70 * var(--px));
    font-size: calc(12 * var(--px));
    text-align: right;
  }
  .points button {
    min-width: 32px;
    padding-inline: 4px;
  }
  .opacity {
    display: flex;
    align-items: center;
    gap: 8px;
    font-size: calc(13 * var(--px));
  }
  .opacity input {
    flex: 1;
    min-width: 0;
  }
  .doubt {
    padding: 8px 10px;
    border-radius: var(--radius);
    color: var(--doubtful);
    background: var(--doubtful-soft);
    font-size: calc(13 * var(--px));
  }
`;
