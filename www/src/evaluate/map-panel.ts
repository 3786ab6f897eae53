import { html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { icon } from '../components/icons.js';
import { shared } from '../components/theme.js';
import { tableStyles } from '../components/panel-theme.js';
import { rankingStyles, sectionStyles } from '../components/section-styles.js';
import type { MapResult, MapQuality } from './protocol.js';
import { fire } from '../components/fire.js';

/** The sharpness of maps, where there is no ground truth. Fires `run-map-wanted` where the map of a run can be judged. */
@customElement('scanstitch-map-panel')
export class ScanstitchMapPanel extends LitElement {
  @property({ attribute: false }) answer: MapResult | null = null;
  @property({ type: Boolean }) busy = false;
  /** Whether a run waits whose map may be judged. */
  @property({ type: Boolean }) hasRun = false;

  protected override render(): TemplateResult {
    const { answer } = this;
    const rows = [
      ...(answer?.placed ?? []).map(({ name, quality }) => ({ name, ...quality })),
      ...(answer?.maps ?? []).map(({ name, quality }) => ({ name, map: quality, residual: null })),
    ];
    return html`<section class="maps" aria-label="Sharpness of the map">
      <header>
        <h2>Sharpness of the map</h2>
        <span class="muted">no ground truth needed; lower is sharper, for maps of the same frames</span>
        ${
          this.hasRun
            ? html`<span class="save"
                ><button ?disabled=${this.busy} @click=${() => fire(this, 'run-map-wanted')}>
                  Measure this run’s map
                </button></span
              >`
            : nothing
        }
      </header>
      ${this.busy ? html`<p class="muted" role="status">Computing…</p>` : nothing}
      ${(answer?.refusals ?? []).map(
        ({ name, problem }) =>
          html`<p class="problem" role="alert">
            ${icon('doubtful', 14)}${problem.startsWith(name) ? problem : `${name}: ${problem}`}
          </p>`,
      )}
      ${rows.length > 0 ? this.renderTable(rows) : nothing}
    </section>`;
  }

  private renderTable(
    rows: readonly { name: string; map: MapQuality; residual: { mean_residual: number; num_pairs: number } | null }[],
  ): TemplateResult {
    const hasResidual = rows.some(({ residual }) => residual !== null);
    return html`<div class="scroll" role="region" aria-label="Figures of the maps" tabindex="0">
      <table aria-label="Sharpness of maps">
        <thead>
          <tr>
            <th scope="col" class="name">${hasResidual ? 'frames placed by' : 'map'}</th>
            ${
              hasResidual
                ? html`<th scope="col" title="mean distance of a point from the surface that another frame saw there">
                    residual (mm)
                  </th>`
                : nothing
            }
            <th scope="col" title="mean map entropy, Droeschel and Behnke 2014">entropy (nats)</th>
            <th scope="col" title="mean plane variance, Razlaw et al. 2015">plane variance (mm²)</th>
            <th scope="col" title="points that were evaluated">points</th>
          </tr>
        </thead>
        <tbody>
          ${rows.map(
            ({ name, map, residual }) =>
              html`<tr>
                <th scope="row" class="name">${name}</th>
                ${hasResidual ? html`<td>${residual ? (1e3 * residual.mean_residual).toFixed(2) : '–'}</td>` : nothing}
                <td>${map.mean_map_entropy.toFixed(4)}</td>
                <td>${(1e6 * map.mean_plane_variance).toFixed(1)}</td>
                <td>${map.num_points}</td>
              </tr>`,
          )}
        </tbody>
      </table>
    </div>`;
  }

  static override styles = [shared, sectionStyles, tableStyles, rankingStyles];
}
