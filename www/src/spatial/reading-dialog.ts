import { css, html, LitElement, type TemplateResult } from 'lit';
import { customElement, property, query } from 'lit/decorators.js';
import { dialogStyles } from '../components/section-styles.js';
import { shared, wrap } from '../components/theme.js';
import type { Assumption, Suggestion } from '../engine/spatial-protocol.js';
import type { Camera } from './poses.js';
import { valueText, valueWords } from './reading.js';
import { fire } from '../components/fire.js';

export interface Readings {
  values: { setting: Suggestion['setting']; value: number }[];
}

const LABELS = { depth_scale: 'Depth scale', fx: 'Focal length', cloud_unit: 'Unit' } as const;
const UNITS = { depth_scale: 'raw values per metre', fx: 'pixels', cloud_unit: 'metres' } as const;

/**
 * What was assumed of the depth images or clouds, with all values that such have, and a field for any other.
 *
 * Fires `readings-chosen` with the values that are to be used.
 */
@customElement('scanstitch-reading-dialog')
export class ScanstitchReadingDialog extends LitElement {
  @property({ attribute: false }) assumptions: readonly Assumption[] = [];
  @property({ attribute: false }) camera: Camera | null = null;
  @query('dialog') private dialog!: HTMLDialogElement;
  @query('form') private form!: HTMLFormElement;

  show(): void {
    this.form.reset();
    this.dialog.showModal();
  }

  protected override render(): TemplateResult {
    const { camera, assumptions } = this;
    return html`<dialog aria-labelledby="title">
      <form method="dialog" @submit=${this.onSubmit}>
        <h2 id="title">What is assumed of the ${camera ? 'depth images' : 'clouds'}</h2>
        <p class="muted">Neither the files nor the settings say it. Choose another value, and all is computed again.</p>
        ${assumptions.map((assumption) => this.renderAssumption(assumption, camera))}
        <p class="actions">
          <button type="button" @click=${() => this.dialog.close()}>Cancel</button>
          <button class="primary" type="submit">Compute again</button>
        </p>
      </form>
    </dialog>`;
  }

  private renderAssumption(assumption: Assumption, camera: Camera | null): TemplateResult {
    const { setting, value, why, likely, usual, confirmed_by } = assumption;
    const near = (a: number, b: number): boolean => Math.abs(Math.log(a / b)) < 0.01;
    const about = (candidate: number): string => usual.find((one) => near(one.value, candidate))?.about ?? '';
    const others = usual.filter((one) => likely.every((candidate) => !near(one.value, candidate)));
    const option = (candidate: number, note: string): TemplateResult =>
      html`<label>
        <input type="radio" name=${setting} value=${candidate} ?checked=${candidate === value} />
        <span class="number">${valueWords(assumption, candidate, camera)}</span>
        <span class="muted">${note}</span>
      </label>`;
    return html`<fieldset>
      <legend>${LABELS[setting]}</legend>
      <p class="muted">
        ${confirmed_by === null ? 'Nothing in the recording confirms the assumed value.' : `Confirmed by ${confirmed_by}.`}
      </p>
      ${likely.map((candidate) =>
        option(candidate, candidate === value ? `assumed, ${why}` : [about(candidate), 'possible as well'].join(', ')),
      )}
      ${others.map((one) => option(one.value, one.about))}
      <label>
        <input type="radio" name=${setting} value="other" />
        <span>Another</span>
        <input
          type="number"
          inputmode="decimal"
          name="${setting}_other"
          min="0.001"
          max="1000000"
          step="any"
          aria-label="${LABELS[setting]}, ${UNITS[setting]}"
          placeholder=${valueText(value)}
          @input=${(event: Event) => this.onOther(event, setting)}
        />
        <span class="muted">${UNITS[setting]}</span>
      </label>
    </fieldset>`;
  }

  /** Selects the option of the own value when one is typed. */
  private onOther(event: Event, setting: Assumption['setting']): void {
    const { value } = event.target as HTMLInputElement;
    const own = this.form.querySelector<HTMLInputElement>(`input[name=${setting}][value=other]`);
    if (own && value !== '') own.checked = true;
  }

  private onSubmit(): void {
    const given = new FormData(this.form);
    const values = this.assumptions.flatMap(({ setting, value: assumed }) => {
      const chosen = given.get(setting);
      const value = Number(chosen === 'other' ? given.get(`${setting}_other`) : chosen);
      return value > 0 && (value !== assumed || chosen === 'other') ? [{ setting, value }] : [];
    });
    if (values.length > 0) fire(this, 'readings-chosen', { values });
  }

  static override styles = [
    shared,
    dialogStyles,
    css`
      :host {
        display: contents;
      }
      dialog {
        width: min(520px, calc(100vw - 24px));
      }
      fieldset {
        gap: 2px;
      }
      label {
        ${wrap};
        gap: 2px 8px;
        min-height: 28px;
      }
      label .muted {
        font-size: calc(12.5 * var(--px));
      }
      input[type='number'] {
        width: 110px;
        text-align: right;
      }
      input[type='radio'] {
        width: 16px;
        height: 16px;
      }
      .actions {
        display: flex;
        flex-wrap: wrap;
        justify-content: flex-end;
        gap: 8px;
      }
      @media (pointer: coarse) {
        label {
          min-height: 40px;
        }
      }
    `,
  ];
}
