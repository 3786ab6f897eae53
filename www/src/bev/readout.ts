/** Numbers in words beside the views. */
import { html, nothing, type TemplateResult } from 'lit';
import { HINTS, type Tool } from './document.js';
import { shortPixel } from './picture.js';
import type { BevPoint, BevRole } from './protocol.js';

/** What the pointer is over, in which view. */
export interface Pointed {
  role: BevRole;
  point: BevPoint;
}

/** Where it lies in both views and on the ground; without anything, what to do. */
export function readout(pointed: Pointed | null, tool: Tool): TemplateResult {
  if (!pointed) return html`${HINTS[tool]}`;
  const { marked, ground, projected, status } = pointed.point;
  const [here, there] = pointed.role === 'top' ? ['top', 'front'] : ['front', 'top'];
  const metres = ground?.map((value) => value.toFixed(3)).join(', ');
  const outside = status === 'visible' ? '' : ', outside';
  return html`<span>${here} <b>${shortPixel(marked)}</b></span>
    <span>${metres ? html`ground <b>${metres}</b> m` : 'no ground: at or above the horizon'}</span>
    ${projected ? html`<span>${there} <b>${shortPixel(projected)}</b>${outside}</span>` : nothing}
    ${ground && !projected ? html`<span>behind the ${there} camera</span>` : nothing}`;
}

/** The matrix that takes ground pixels of the top view to the front view, to be copied as JSON. */
export function homographyPanel(homography: readonly number[], copy: (json: string) => void): TemplateResult {
  const rows = [0, 3, 6].map((start) => homography.slice(start, start + 3));
  const shown = rows.map((row) => row.map((value) => value.toPrecision(7).padStart(14)).join(' ')).join('\n');
  return html`<section aria-label="Homography">
    <header>
      <h2>Homography</h2>
      <span class="file">top (u, v, 1) → front, up to scale</span>
      <button class="quiet" @click=${() => copy(JSON.stringify(rows))}>Copy</button>
    </header>
    <div class="panel"><pre class="matrix">${shown}</pre></div>
  </section>`;
}
