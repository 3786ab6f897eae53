import { html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { check } from '../components/fields.js';
import { TRASH } from '../components/panel-icons.js';
import { type Choices, list } from '../components/list-field.js';
import { iconButton } from '../components/icon-button.js';
import { icon } from '../components/icons.js';
import { shared } from '../components/theme.js';
import { fieldStyles } from '../components/panel-theme.js';
import { baseName } from '../views/format.js';
import { controlsStyles } from './evaluate-styles.js';
import type { EvaluationOptions } from './protocol.js';
import type { AuxiliaryId } from './session.js';
import { fire } from '../components/fire.js';

interface Choice {
  option: keyof EvaluationOptions;
  label: string;
  choices: Readonly<Record<string, string>>;
}

const RELATIONS: Choice = {
  option: 'relation',
  label: 'Component',
  choices: {
    translation_part: 'translation (m)',
    rotation_angle_deg: 'rotation angle (deg)',
    rotation_angle_rad: 'rotation angle (rad)',
    rotation_part: 'rotation part',
    full_transformation: 'full transformation',
    point_distance: 'point distance (m)',
  },
};
/** Of the relative error alone. */
const RATIO = { point_distance_error_ratio: 'ratio of point distances (%)' };

const CHOICES: readonly Choice[] = [
  {
    option: 'alignment',
    label: 'Alignment',
    choices: {
      ...{ none: 'none', origin: 'at the first pose', se3: 'SE(3), Umeyama' },
      ...{ sim3: 'Sim(3), with scale', scale: 'scale only' },
    },
  },
  {
    option: 'metric',
    label: 'Error',
    choices: { ape: 'absolute (APE)', rpe: 'relative (RPE)' },
  },
];
const ASSOCIATION: Choice = {
  option: 'association',
  label: 'Poses matched by',
  choices: { auto: 'time if available', time: 'time', index: 'index' },
};
const CONVENTIONS: Choice = {
  option: 'conventions',
  label: 'Axes, quaternions, handedness',
  choices: { detected: 'detected', as_read: 'as read' },
};
const DELTA_UNITS: Choice = {
  option: 'delta_unit',
  label: 'Delta unit',
  choices: { frames: 'frames', meters: 'metres', seconds: 'seconds', degrees: 'degrees', radians: 'radians' },
};

type CheckOption = 'all_pairs' | 'pairs_from_reference' | 'interpolate';
type NumberOption = 'delta' | 'delta_tolerance' | 'max_diff' | 'offset' | 'align_first';

/** A file beside the trajectories, which can be taken away. */
export interface AuxiliaryFile {
  id: AuxiliaryId;
  label: string;
  name: string;
}

/**
 * How trajectories are compared. Fires `reference-chosen` (the id), `options-changed` (some of them), `beside-removed`
 * (its id), `loops-only-changed`, `files-wanted` and `all-removed`.
 */
@customElement('scanstitch-evaluation-controls')
export class ScanstitchEvaluationControls extends LitElement {
  @property({ attribute: false }) files: readonly { id: number; name: string }[] = [];
  @property({ attribute: false }) referenceId = -1;
  @property({ attribute: false }) options: Partial<EvaluationOptions> = {};
  @property({ attribute: false }) beside: readonly AuxiliaryFile[] = [];
  @property({ attribute: false }) loops_only = false;

  protected override render(): TemplateResult {
    const isRelative = this.options.metric === 'rpe';
    const relations = isRelative ? { ...RELATIONS, choices: { ...RELATIONS.choices, ...RATIO } } : RELATIONS;
    return html`<form
      class="controls"
      aria-label="Comparison options"
      @submit=${(event: Event) => event.preventDefault()}
    >
      ${
        this.files.length < 2
          ? nothing
          : html`${this.renderReference()} ${CHOICES.map((choice) => this.renderChoice(choice))}
            ${this.renderChoice(relations)} ${isRelative ? this.renderPairs() : nothing}`
      }
      <span class="actions">
        <button type="button" @click=${() => fire(this, 'files-wanted')}>${icon('plus')}Add files…</button>
        <button type="button" class="quiet" @click=${() => fire(this, 'all-removed')}>${icon(TRASH)}Remove all</button>
      </span>
      ${this.beside.length > 0 ? this.renderBeside() : nothing} ${this.files.length < 2 ? nothing : this.renderMore()}
    </form>`;
  }

  /** How poses are matched, which is seldom changed. */
  private renderMore(): TemplateResult {
    return html`<details class="more">
      <summary>Matching of poses</summary>
      <div>
        ${this.renderChoice(ASSOCIATION)} ${this.renderNumber('max_diff', 'Maximum time difference (s)', 0.01, 0)}
        ${this.renderNumber('offset', 'Time offset (s)', 0, null)} ${this.renderCheck('interpolate', 'interpolate')}
        ${this.renderChoice(CONVENTIONS)}
        ${this.renderNumber('align_first', 'Align on the first n poses (0: all)', 0, 0)}
      </div>
    </details>`;
  }

  private renderReference(): TemplateResult {
    const files: Choices<number> = this.files.map(({ id, name }) => [id, name]);
    const choices: Choices<number> = this.referenceId < 0 ? [[-1, 'none yet'], ...files] : files;
    return html`<label
      >Ground truth ${list(choices, this.referenceId, (id) => fire(this, 'reference-chosen', id))}</label
    >`;
  }

  private renderPairs(): TemplateResult {
    return html`${this.renderNumber('delta', 'Delta', 1, 0)} ${this.renderChoice(DELTA_UNITS)}
    ${this.renderCheck('all_pairs', 'all pairs')}
    ${this.options.all_pairs ? this.renderNumber('delta_tolerance', 'Tolerance (share)', 0.1, 0) : nothing}
    ${this.renderCheck('pairs_from_reference', 'delta along the ground truth')}`;
  }

  private renderCheck(option: CheckOption, words: string): TemplateResult {
    return check(words, this.options[option] ?? false, (isOn) => this.set({ [option]: isOn }), { kind: 'check' });
  }

  private renderBeside(): TemplateResult {
    return html`<ul class="beside" aria-label="Other files">
      ${this.beside.map(
        ({ id, label, name }) =>
          html`<li>
            <span class="muted">${label}</span> <span title=${name}>${baseName(name)}</span>
            ${
              id === 'relations'
                ? check('loops only', this.loops_only, (isOn) => fire(this, 'loops-only-changed', isOn), {
                    kind: 'check',
                  })
                : nothing
            }
            ${iconButton('close', `Remove ${name}`, () => fire(this, 'beside-removed', id), { size: 12 })}
          </li>`,
      )}
    </ul>`;
  }

  private renderChoice({ option, label, choices }: Choice): TemplateResult {
    const present = this.options[option] ?? Object.keys(choices)[0];
    return html`<label>${label} ${list(choices, present as string, (value) => this.set({ [option]: value }))}</label>`;
  }

  private renderNumber(
    option: NumberOption,
    label: string,
    initial: number,
    min: number | null,
    title = '',
  ): TemplateResult {
    return html`<label title=${title || nothing}
      >${label}
      <input
        type="number"
        step="any"
        min=${min ?? nothing}
        .value=${String(this.options[option] ?? initial)}
        @change=${(event: Event) => {
          const value = (event.target as HTMLInputElement).valueAsNumber;
          if (Number.isFinite(value)) this.set({ [option]: option === 'align_first' ? Math.round(value) : value });
        }}
    /></label>`;
  }

  private set(change: Partial<EvaluationOptions>): void {
    // What only the relative error has must not outlive it.
    const isLost = change.metric === 'ape' && (this.options.relation ?? '') in RATIO;
    fire(this, 'options-changed', isLost ? { ...change, relation: 'translation_part' } : change);
  }

  static override styles = [shared, fieldStyles, controlsStyles];
}
