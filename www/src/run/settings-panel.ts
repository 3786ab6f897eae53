import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { type Field, fromScreen, sameSettings, toScreen, unitSign } from '../views/setting-fields.js';
import { rangeWords, screenStep, settingGroups, zeroWord } from '../views/setting-form.js';
import { icon } from '../components/icons.js';
import { RESET } from '../components/panel-icons.js';
import { column, row, shared, small } from '../components/theme.js';
import { fire } from '../components/fire.js';

/** All settings of an engine, by name. */
export type SettingValues = Readonly<Record<string, string | number>>;

/** What a form needs to know of a setting; the engine says it. */
export interface SettingField extends Field {
  name: string;
  label: string;
  explanation: string;
  kind:
    | Exclude<Field['kind'], { type: 'choice' }>
    | { type: 'choice'; choices: readonly { value: string; label: string }[] };
}

export interface SettingPreset {
  name: string;
  label: string;
  explanation: string;
  settings: SettingValues;
}

/** Groups shown open at first; the others are folded until asked for. */
const NUM_OPEN_GROUPS = 2;

/**
 * The settings, drawn from the engine's own description of them.
 *
 * Fires `settings-changed` with all settings.
 */
@customElement('scanstitch-settings')
export class ScanstitchSettings extends LitElement {
  @property({ attribute: false }) descriptions: readonly SettingField[] = [];
  @property({ attribute: false }) presets: readonly SettingPreset[] = [];
  @property({ attribute: false }) values: SettingValues | null = null;

  protected override render(): TemplateResult {
    const { values, presets } = this;
    if (!values) return html`<p class="muted">The engine is starting…</p>`;
    const preset = presets.find(({ settings }) => sameSettings(settings, values));
    const defaults = presets[0]?.settings ?? values;
    return html`
      <header>
        <h2>Settings</h2>
        <button
          class="quiet"
          ?disabled=${sameSettings(values, defaults)}
          @click=${() => this.change(defaults)}
          title="Back to the default of every setting"
        >
          ${icon(RESET)}Reset
        </button>
      </header>
      <div class="field">
        <label for="preset">Preset</label>
        <select id="preset" aria-describedby="preset-explanation" @change=${this.onPreset}>
          ${presets.map(
            ({ name, label }) => html`<option value=${name} .selected=${preset?.name === name}>${label}</option>`,
          )}
          ${preset ? nothing : html`<option value="" .selected=${true}>Custom</option>`}
        </select>
        <p class="explanation" id="preset-explanation">
          ${preset?.explanation ?? 'Changed by hand. Choose a preset to restore its values.'}
        </p>
      </div>
      ${settingGroups(this.descriptions).map(({ group, descriptions }, index) => {
        const numChanged = descriptions.filter(({ name }) => values[name] !== defaults[name]).length;
        return html`<details ?open=${index < NUM_OPEN_GROUPS}>
          <summary>
            ${icon('chevron')}<span>${group}</span>
            ${numChanged > 0 ? html`<span class="changed">${numChanged} changed</span>` : nothing}
          </summary>
          ${descriptions.map((description) => this.renderField(description, values, defaults))}
        </details>`;
      })}
    `;
  }

  private renderField(description: SettingField, values: SettingValues, defaults: SettingValues): TemplateResult {
    const { name, label, explanation, kind } = description;
    const isChanged = values[name] !== defaults[name];
    return html`<div class="field ${isChanged ? 'is-changed' : ''}">
      <label for=${name}>${label}</label>
      ${kind.type === 'choice' ? this.renderChoice(description, values) : this.renderNumber(description, values)}
      <p class="explanation" id="${name}-explanation">
        ${zeroWord(explanation) ? explanation.replace(/(?<![\d.])0: /, 'Empty: ') : explanation}
      </p>
    </div>`;
  }

  private renderChoice({ name, kind }: SettingField, values: SettingValues): TemplateResult {
    if (kind.type !== 'choice') return html``;
    return html`<select
      id=${name}
      aria-describedby="${name}-explanation"
      @change=${(event: Event) => this.change({ ...values, [name]: (event.target as HTMLSelectElement).value })}
    >
      ${kind.choices.map(
        ({ value, label }) => html`<option value=${value} .selected=${values[name] === value}>${label}</option>`,
      )}
    </select>`;
  }

  private renderNumber(description: SettingField, values: SettingValues): TemplateResult {
    const { name, kind, explanation } = description;
    if (kind.type === 'choice') return html``;
    const sign = unitSign(description);
    const zero = zeroWord(explanation);
    return html`<span class="number-field">
      <input
        id=${name}
        type="number"
        inputmode="decimal"
        aria-describedby="${name}-explanation"
        title=${rangeWords(description)}
        step=${screenStep(description)}
        placeholder=${zero ?? nothing}
        .value=${numberText(description, values[name] as number)}
        @change=${(event: Event) => this.onNumber(event, description, values)}
      />
      ${sign === '' ? nothing : html`<span class="unit" aria-hidden="true">${sign}</span>`}
    </span>`;
  }

  /** A number outside its range goes to the nearest end; something that is not a number is put back. */
  private onNumber(event: Event, description: SettingField, values: SettingValues): void {
    const input = event.target as HTMLInputElement;
    const isZero = input.value.trim() === '' && zeroWord(description.explanation) !== null;
    const value = isZero ? 0 : fromScreen(description, input.value);
    if (value === null) {
      input.value = numberText(description, values[description.name] as number);
      return;
    }
    input.value = numberText(description, value);
    this.change({ ...values, [description.name]: value });
  }

  private onPreset(event: Event): void {
    const { value } = event.target as HTMLSelectElement;
    const preset = this.presets.find(({ name }) => name === value);
    if (preset) this.change(preset.settings);
  }

  private change(settings: SettingValues): void {
    fire(this, 'settings-changed', { ...settings });
  }

  static override styles = [
    shared,
    css`
      :host {
        ${column};
        gap: 4px;
        padding: 14px 16px 24px;
      }
      header {
        ${row};
        justify-content: space-between;
        min-height: 32px;
      }
      header button {
        margin-right: -8px;
        color: var(--muted);
      }
      .field {
        display: grid;
        grid-template-columns: minmax(0, 1fr) auto;
        align-items: center;
        gap: 2px 10px;
        padding: 6px 0 8px;
      }
      .field:has(> select) {
        grid-template-columns: 1fr;
      }
      .explanation {
        grid-column: 1 / -1;
        ${small};
        line-height: 1.4;
      }
      .is-changed > label::after {
        content: '•';
        margin-left: 5px;
        color: var(--accent);
        font-weight: 700;
      }
      select {
        width: 100%;
      }
      .number-field {
        display: inline-flex;
        align-items: center;
        gap: 6px;
      }
      input {
        width: 92px;
        text-align: right;
        font-variant-numeric: tabular-nums;
      }
      .unit {
        width: 14px;
        color: var(--muted);
      }
      details {
        border-top: 1px solid var(--line);
      }
      summary {
        ${row};
        gap: 8px;
        min-height: 40px;
        font-weight: 600;
        list-style: none;
      }
      summary::-webkit-details-marker {
        display: none;
      }
      summary svg {
        color: var(--muted);
        transform: rotate(-90deg);
        transition: transform 120ms;
      }
      details[open] summary svg {
        transform: none;
      }
      .changed {
        margin-left: auto;
        padding: 0 8px;
        border-radius: 99px;
        background: var(--accent-soft);
        color: var(--accent);
        font-size: calc(12 * var(--px));
        font-weight: 550;
      }
      @media (pointer: coarse) {
        select,
        input {
          min-height: 42px;
          font-size: calc(16 * var(--px));
        }
      }
    `,
  ];
}

/** Empty for a zero that stands for something else. */
function numberText(description: SettingField, value: number): string {
  return value === 0 && zeroWord(description.explanation) !== null ? '' : toScreen(description, value);
}
