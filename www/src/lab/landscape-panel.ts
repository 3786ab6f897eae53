import { html, nothing, type TemplateResult } from 'lit';
import { customElement } from 'lit/decorators.js';
import { formatDuration, formatLength } from '../views/format.js';
import { formatAngle } from '../views/pose-format.js';
import { memoizeLast } from '../views/memoize-last.js';
import { offsetsOfNode, poseAtOffsets } from './grids.js';
import {
  costRange,
  isAtEdge,
  type Landscape,
  landscapePainter,
  minimaWords,
  rampStops,
  seenMinima,
} from './landscape.js';
import { difference } from './poses.js';
import type { LabFacts } from './protocol.js';
import { SurveyPanel } from './survey-panel.js';
import { strideWords } from './thinning.js';
import type { LandscapeSurvey } from './survey.js';
import { formatNumber } from './words.js';

/** The cost over two unknowns around the result of the run. Fires `ghost-shown` with a pose or null. */
@customElement('scanstitch-lab-landscape')
export class ScanstitchLabLandscape extends SurveyPanel<LandscapeSurvey> {
  protected override readonly isBasin = false;
  private painterOf = memoizeLast(landscapePainter);

  protected override allAxes(facts: LabFacts): readonly number[] {
    return this.axes(facts);
  }

  protected override renderResult(facts: LabFacts): TemplateResult {
    const landscape = this.survey.result;
    return html`
      <header>
        <h2>Cost around the result</h2>
        <span class="muted"
          >${landscape?.progress === 1 ? `${landscape.grid.size.join(' × ')} poses, ${formatDuration(landscape.milliseconds)}${strideWords(landscape.grid.stride)}` : 'computing…'}</span
        >
      </header>
      ${this.renderChoices(facts)}
      ${
        landscape
          ? html`<scanstitch-figure
                class="map"
                steppable
                label="Cost over two unknowns"
                description=${this.words(facts)}
                .painter=${this.painterOf(
                  landscape,
                  this.marksOf(this.session.pose, this.session.trace, facts, landscape.grid),
                  this.colorsOf(this.dark),
                  this.dark,
                )}
                @figure-pointer=${this.onPointer}
                @keydown=${this.onKey}
                @click=${this.startHere}
              ></scanstitch-figure>
              ${this.renderScale(landscape)}
              <p class="readout number muted">${this.readout(facts) || 'Click on a place to start from there'}</p>
              ${this.renderMinima(facts)}`
          : nothing
      }
      <p class="explanation">
        The cost is the mean robust loss of a source point; the pairs are searched anew at every pose, as in the
        iterations. The other unknowns stay as they are at the end of the run. Line: the path of the iterations.
        Circles: local minima. Colours: square root of the cost above the lowest.
      </p>
    `;
  }

  /** Which cost has which colour. */
  private renderScale(landscape: Landscape): TemplateResult {
    const { low, high } = costRange(landscape);
    return html`<p class="costs number muted">
      ${formatNumber(low)}
      <i style="background: linear-gradient(to right, ${rampStops(this.dark)})" aria-hidden="true"></i>
      ${formatNumber(high)} m² ${landscape.costs.some(Number.isNaN) ? ', blank: no pairs' : nothing}
    </p>`;
  }

  private renderMinima(facts: LabFacts): TemplateResult | typeof nothing {
    const landscape = this.survey.result;
    if (!landscape || landscape.progress < 1) return nothing;
    const minima = seenMinima(landscape);
    return html`<h3>${minimaWords(landscape)}</h3>
      <ul class="minima number">
        ${minima.slice(0, 6).map((minimum) => {
          const { column, row, cost } = minimum;
          const T = poseAtOffsets(landscape.grid, offsetsOfNode(landscape.grid, [column, row]), facts.is_planar);
          const { rotation, translation } = difference(landscape.grid.T_center, T);
          return html`<li>
            <button
              @click=${() => void this.session.startFrom(T)}
              @pointerenter=${() => this.tellGhost(T)}
              @pointerleave=${() => this.tellGhost(null)}
            >
              Start there
            </button>
            ${formatLength(translation)}, ${formatAngle(rotation, 1)} away,
            ${formatNumber(cost)} m²${isAtEdge(landscape, minimum) ? ', lowest at the edge: choose a wider range' : nothing}
          </li>`;
        })}
      </ul>`;
  }

  private readout(facts: LabFacts): string {
    const landscape = this.survey.result;
    const [column = 0, row = 0] = this.node ?? [];
    if (!landscape || !this.node) return '';
    const cost = landscape.costs[row * (landscape.grid.size[0] ?? 1) + column];
    return `${this.nodeWords(facts)}: ${cost === undefined || Number.isNaN(cost) ? 'no pairs' : `cost ${formatNumber(cost)} m²`}`;
  }

  private words(facts: LabFacts): string {
    const landscape = this.survey.result;
    if (!landscape) return '';
    return `${minimaWords(landscape)}. ${this.readout(facts)} Arrow keys go from pose to pose, Enter starts there.`;
  }

  protected override onNode(): void {
    const { facts } = this.session;
    this.tellGhost(facts && this.nodePose(facts));
  }
}
