/** Small parts of the bird's-eye view: its problems, the blend of the two views, the refinement of a camera. */
import { html, nothing, type TemplateResult } from 'lit';
import { icon } from '../components/icons.js';
import type { BevDocument } from './document.js';
import type { BevRefinement, Projection } from './protocol.js';
import './refinement.js';
import type { RefinementRequest } from './refinement.js';
import type { BevSession } from './session.js';

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
          <button class="quiet icon" aria-label="Dismiss the message" @click=${() => session.settle(key)}>
            ${icon('close', 12)}
          </button>
        </li>`,
    )}
  </ul>`;
}

/** How much of the warped top view is seen over the front view. */
export function blendSlider(session: BevSession): TemplateResult {
  const percent = Math.round(100 * session.blend);
  return html`<label class="blend"
    ><span>Front view</span
    ><input
      type="range"
      min="0"
      max="100"
      aria-label="Blend: opacity of the warped top view over the front view"
      ?disabled=${!session.bitmapOf('top')}
      .value=${String(percent)}
      @input=${(event: Event) => {
        session.blend = Number((event.target as HTMLInputElement).value) / 100;
        session.changed();
      }}
    /><span>warped top view ${percent} %</span></label
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
