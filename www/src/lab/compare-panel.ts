/** Methods side by side, from the same start and at the same iteration. */
import { html, nothing, type TemplateResult } from 'lit';
import { iconButton } from '../components/icon-button.js';
import type { SettingPreset } from '../run/settings-panel.js';
import { formatDuration, formatLength, formatPercent } from '../views/format.js';
import { formatAngle } from '../views/pose-format.js';
import { difference } from './poses.js';
import type { LabFacts, Pose } from './protocol.js';
import { type LabRun } from './runs.js';
import { MAX_RUNS } from './session.js';
import { lastPose, numPoses } from './trace.js';
import { endReasonWords, runName } from './words.js';

export interface CompareFacts {
  runs: readonly LabRun[];
  active: number;
  facts: LabFacts;
  presets: readonly SettingPreset[];
  /** Share of starts that end at the reference pose, by the run; null while it is computed. */
  basins: ReadonlyMap<number, number | null>;
  colorOf(run: LabRun): string;
  selectRun(id: number): void;
  removeRun(id: number): void;
  add(preset: SettingPreset): void;
  measureBasins(): void;
}

/** `styles`: sideStyles. */
export function comparePanel(has: CompareFacts): TemplateResult {
  const { runs, presets, facts } = has;
  const reference = endOf(runs[0]);
  return html`
    <header><h2>Methods side by side</h2></header>
    <div class="scroll" role="region" aria-label="Methods" tabindex="0">
      <table class="figures methods number" aria-label="Methods">
        <thead>
          <tr>
            <th scope="col" class="name">method</th>
            <th scope="col"><abbr title="Iterations; ! where it did not converge">iter.</abbr></th>
            <th scope="col">
              <abbr title="Root mean square residual of the accepted pairs in the last iteration">RMSE</abbr>
            </th>
            <th scope="col"><abbr title="Distance of the final pose from that of the first method">offset</abbr></th>
            <th scope="col">time</th>
            <th scope="col">
              <abbr
                title="Share of starts, up to ${facts.is_planar ? '1.5 m and 40° away' : '1.5 m away along x and y'}, from which the method ends at the first method's final pose"
                >basin</abbr
              >
            </th>
            <th></th>
          </tr>
        </thead>
        <tbody>
          ${runs.map((run) => row(run, reference, has))}
        </tbody>
      </table>
    </div>
    <div class="row field">
      <select
        aria-label="Add a method"
        ?disabled=${runs.length >= MAX_RUNS}
        @change=${({ target }: Event) => {
          const select = target as HTMLSelectElement;
          const preset = presets.find(({ name }) => name === select.value);
          select.value = '';
          if (preset) has.add(preset);
        }}
      >
        <option value="" selected>${runs.length < MAX_RUNS ? 'Add a method…' : `${MAX_RUNS} methods at most`}</option>
        ${presets.map(({ name, label }) => html`<option value=${name}>${label}</option>`)}
      </select>
      <button ?disabled=${!runs.some(({ trace }) => trace)} @click=${has.measureBasins}>Compare basins</button>
    </div>
    <p class="explanation">
      All methods run from the same start and are stepped together; the selected one is drawn with its pairs, the others
      in their colours.
      ${facts.is_planar ? 'Point to point has its step in closed form, by SVD; the others by Gauss-Newton.' : nothing}
    </p>
  `;
}

function row(run: LabRun, reference: Pose | null, has: CompareFacts): TemplateResult {
  const { trace, problem, own, id } = run;
  const name = runName(run, has.facts);
  const end = endOf(run);
  const apart = end && reference ? difference(reference, end) : null;
  const home = has.basins.get(id);
  const cells = trace
    ? html`<td>
          ${numPoses(trace) - 1}${trace.converged || own ? '' : html` <span class="muted" role="img" aria-label=${endReasonWords(trace)} title=${endReasonWords(trace)}>!</span>`}
        </td>
        <td>${trace.records.length > 0 ? formatLength(trace.records.at(-1)?.inlier_rmse ?? 0) : '–'}</td>
        <td>${apart ? html`${formatLength(apart.translation)}<br />${formatAngle(apart.rotation, 1)}` : '–'}</td>
        <td>${own ? '–' : formatDuration(trace.milliseconds)}</td>
        <td>${home === undefined ? '–' : home === null ? '…' : formatPercent(home)}</td>`
    : html`<td colspan="5">${problem || 'running…'}</td>`;
  return html`<tr class=${id === has.active ? 'selected' : ''}>
    <th scope="row" class="name">
      <button class="link" aria-pressed=${id === has.active} @click=${() => has.selectRun(id)}>
        <i style="background: ${has.colorOf(run)}"></i>${name}
      </button>
    </th>
    ${cells}
    <td>
      ${iconButton('close', `Remove ${name}`, () => has.removeRun(id), { hint: 'Remove', size: 12, isOff: has.runs.length < 2 })}
    </td>
  </tr>`;
}

const endOf = (run: LabRun | undefined): Pose | null => (run?.trace ? lastPose(run.trace) : null);
