/** Small parts of the bird's-eye view: its problems, the blend of the two views, the refinement of a camera. */
import { html, nothing, type TemplateResult } from 'lit';
import { slider } from '../components/fields.js';
import { iconButton } from '../components/icon-button.js';
import { icon } from '../components/icons.js';
import './cameras.js';
import type { PoseKindRequest } from './cameras.js';
import { type BevDocument, hiddenWords, HINTS, markedPixels } from './document.js';
import './points-table.js';
import type { TypedPixel } from './points-table.js';
import type { BevAxes, BevPoint, BevRefinement, BevScene, Projection } from './protocol.js';
import './refinement.js';
import type { RefinementRequest } from './refinement.js';
import type { BevSession } from './session.js';
import './sketch.js';

const NO_POINTS: readonly BevPoint[] = [];

/** What is wrong with the input, each until it is mended or dismissed. */
export function problemList(session: BevSession): TemplateResult | typeof nothing {
  const { problems } = session;
  if (problems.size === 0) return nothing;
  return html`<ul class="problems">
    ${[...problems].map(
      ([key, { text, remedy }]) =>
        html`<li role="alert">
          ${icon('doubtful')}<span>${text}</span>
          ${remedy ? html`<button @click=${remedy.act}>${remedy.label}</button>` : nothing}
          ${iconButton('close', 'Dismiss the message', () => session.settle(key), { size: 12 })}
        </li>`,
    )}
  </ul>`;
}

/** How much of the warped top view is seen over the front view. */
export function blendSlider(session: BevSession): TemplateResult {
  const percent = Math.round(100 * session.blend);
  const label = 'Blend: opacity of the warped top view over the front view';
  const blend = (value: number): void => {
    session.blend = value / 100;
    session.changed();
  };
  return html`<label class="blend"
    ><span>Front view</span>${slider(percent, { label, max: 100, isOff: !session.bitmapOf('top') }, blend)}<span
      >warped top view ${percent} %</span
    ></label
  >`;
}

/** Refines a camera from pairs of places that were marked in both views. */
export function refinementPanel(
  { pairs }: BevDocument,
  answer: Projection | null,
  refined: BevRefinement | null,
  refine: (request: RefinementRequest) => Promise<void>,
): TemplateResult {
  const residuals = pairs.map(({ front }, index) => {
    const projected = answer?.pairPoints[index]?.projected;
    return front && projected ? ([projected[0] - front[0], projected[1] - front[1]] as const) : null;
  });
  return html`<section aria-label="Refinement">
    <header><h2>Refine a camera</h2></header>
    <div class="panel">
      <scanstitch-bev-refinement
        .residuals=${residuals}
        .refined=${refined}
        @refinement-requested=${({ detail }: CustomEvent<RefinementRequest>) => refine(detail)}
      ></scanstitch-bev-refinement>
    </div>
  </section>`;
}

interface PointsActions {
  add(): void;
  type(typed: TypedPixel): void;
  remove(index: number): void;
}

/** The marked points, and where the engine says they are. */
export function pointsPanel(
  document: BevDocument,
  answer: Projection | null,
  selected: number | null,
  { add, type, remove }: PointsActions,
): TemplateResult {
  return html`<section aria-label="Points">
    <header>
      <h2>Points</h2>
      <span class="file">${answer ? hiddenWords(answer) : ''}</span>
      <button class="quiet" ?hidden=${document.tool === 'grid'} @click=${add}>${icon('plus', 14)}Add</button>
    </header>
    ${
      markedPixels(document).length === 0
        ? html`<p class="hint">${HINTS[document.tool]}</p>`
        : html`<scanstitch-bev-points
            .document=${document}
            .points=${answer?.reported ?? NO_POINTS}
            .selected=${selected}
            @pixel-typed=${({ detail }: CustomEvent<TypedPixel>) => type(detail)}
            @row-removed=${({ detail: index }: CustomEvent<number>) => remove(index)}
          ></scanstitch-bev-points>`
    }
  </section>`;
}

interface SceneActions {
  set(scene: BevScene): void;
  turnAxes(axes: BevAxes): void;
  choosePoses(kind: PoseKindRequest): void;
}

/** The cameras from the side, and their numbers. */
export function scenePanels(
  scene: BevScene,
  answer: Projection | null,
  dark: boolean,
  { set, turnAxes, choosePoses }: SceneActions,
): TemplateResult {
  return html`<section aria-label="Sketch">
      <scanstitch-bev-sketch
        .layout=${answer?.layout ?? null}
        .points=${answer?.points ?? NO_POINTS}
        ?dark=${dark}
      ></scanstitch-bev-sketch>
    </section>
    <section aria-label="Cameras">
      <header><h2>Cameras and ground</h2></header>
      <div class="panel">
        <scanstitch-bev-cameras
          .scene=${scene}
          .layout=${answer?.layout ?? null}
          @scene-changed=${({ detail }: CustomEvent<BevScene>) => set(detail)}
          @axes-chosen=${({ detail }: CustomEvent<BevAxes>) => turnAxes(detail)}
          @pose-kind-chosen=${({ detail }: CustomEvent<PoseKindRequest>) => choosePoses(detail)}
        ></scanstitch-bev-cameras>
      </div>
    </section>`;
}
