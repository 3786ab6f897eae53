import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property, state } from 'lit/decorators.js';
import { check } from '../components/fields.js';
import { list } from '../components/list-field.js';
import { figureStyles, numberTable } from '../components/number-table.js';
import { row, shared, wrap } from '../components/theme.js';
import { letter } from './paint.js';
import type { BevParameter, BevRefinement, BevRole } from './protocol.js';
import { fire } from '../components/fire.js';

/** What is to be refined. */
export interface RefinementRequest {
  camera: BevRole;
  parameters: readonly BevParameter[];
}

const PARAMETERS: readonly [BevParameter, string, string][] = [
  ['pitch', 'pitch', 'rotation about the camera’s x axis'],
  ['height', 'height', 'the height of the camera'],
  ['offset', 'offset', 'the position of the camera along the ground'],
  ['ground', 'ground', 'the height of the ground itself; both cameras stay'],
];
const CAMERAS: Record<BevRole, string> = { front: 'front', top: 'top' };
const DEGREES = 180 / Math.PI;

/**
 * A camera moved until projections fall on their marks, and what is left between them.
 *
 * Fires `refinement-requested` (RefinementRequest).
 */
@customElement('scanstitch-bev-refinement')
export class ScanstitchBevRefinement extends LitElement {
  /** For each pair the projected less the marked pixel; null where one is missing. */
  @property({ attribute: false }) residuals: readonly (readonly [number, number] | null)[] = [];
  /** The last refinement, while its scene is the one that is shown. */
  @property({ attribute: false }) refined: BevRefinement | null = null;
  @state() private camera: BevRole = 'front';
  @state() private parameters: readonly BevParameter[] = ['pitch', 'height', 'offset'];

  protected override render(): TemplateResult {
    const count = this.residuals.filter((residual) => residual !== null).length;
    return html`<p class="muted">
        ${count} pair${count === 1 ? '' : 's'} marked in both views. The selected parameters are adjusted until the
        projections (crosses) fall on the marks.
      </p>
      <div class="checks">
        <label>Camera ${list(CAMERAS, this.camera, (camera) => (this.camera = camera))}</label>
        ${PARAMETERS.map(([parameter, label, hint]) =>
          check(label, this.parameters.includes(parameter), (isOn) => this.choose(parameter, isOn), { hint }),
        )}
        <button class="primary" ?disabled=${count === 0} @click=${this.request}>Refine</button>
      </div>
      ${count > 0 ? this.renderResiduals() : nothing} ${this.refined ? this.renderEvidence(this.refined) : nothing}`;
  }

  private renderResiduals(): TemplateResult {
    const rows = this.residuals.flatMap((residual, index) =>
      residual ? [[letter(index), ...[...residual, Math.hypot(...residual)].map((value) => value.toFixed(2))]] : [],
    );
    return numberTable(['pair', 'du (px)', 'dv (px)', 'distance'], rows, 'Residuals');
  }

  private renderEvidence(result: BevRefinement): TemplateResult {
    const changes = [
      ['pitch', result.pitch * DEGREES, '°', 3],
      ['height', result.height, ' m', 4],
      ['right', result.right, ' m', 4],
      ['ahead', result.ahead, ' m', 4],
      ['ground', result.ground, ' m', 4],
    ] as const;
    const moved = changes.filter(([, value]) => value !== 0);
    const words = moved.map(
      ([name, value, unit, digits]) => `${name} ${value > 0 ? '+' : '−'}${Math.abs(value).toFixed(digits)}${unit}`,
    );
    return html`<p class="evidence" role="status">
      ${words.join(', ') || 'No change needed'}. rmse ${result.rmse_before.toFixed(3)} → ${result.rmse.toFixed(3)} px in
      ${result.iterations} step${result.iterations === 1 ? '' : 's'}${result.converged ? '' : ', not converged'}.
    </p>`;
  }

  private choose(parameter: BevParameter, isOn: boolean): void {
    const rest = this.parameters.filter((one) => one !== parameter);
    this.parameters = isOn ? [...rest, parameter] : rest;
  }

  private request(): void {
    const { camera, parameters } = this;
    fire(this, 'refinement-requested', { camera, parameters });
  }

  static override styles = [
    shared,
    figureStyles,
    css`
      .checks {
        ${wrap};
        gap: 6px 14px;
        margin: 6px 0 10px;
      }
      label {
        ${row};
        gap: 5px;
        font-size: calc(13 * var(--px));
      }
      .evidence {
        margin-top: 8px;
        font-size: calc(13 * var(--px));
        font-variant-numeric: tabular-nums;
      }
    `,
  ];
}
