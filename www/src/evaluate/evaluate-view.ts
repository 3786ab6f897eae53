import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query } from 'lit/decorators.js';
import { announcements } from '../components/announcer.js';
import { DropTarget } from '../components/drop-target.js';
import { tellHost } from '../components/host-events.js';
import { icon } from '../components/icons.js';
import { retryButton } from '../components/messages.js';
import type { GivenFiles } from '../run/run-kind.js';
import { dropStyles, emptyStyles, shared, tokens } from '../components/theme.js';
import { pageStyles } from '../components/panel-theme.js';
import type { Note } from '../datasets/note.js';
import { filesOfDrop, filesOfInput } from '../datasets/gather.js';
import { messageOf } from '../engine/message-of.js';
import { plural } from '../views/format.js';
import { makeColors } from '../views/figure-colors.js';
import { memoizeLast } from '../views/memoize-last.js';
import './controls.js';
import type { AuxiliaryFile } from './controls.js';
import { evaluateStyles } from './evaluate-styles.js';
import './figures-view.js';
import type { ScanstitchEvaluationFigures } from './figures-view.js';
import './map-panel.js';
import { noticesOf } from './notices.js';
import type { EvaluationOptions, Result } from './protocol.js';
import './ranking-view.js';
import type { Sort } from './ranking-view.js';
import { type AuxiliaryId, EvaluateSession } from './session.js';
import { columnsOf } from './table.js';

/**
 * Trajectories against a reference: drop them, see paths, errors and a ranked table.
 *
 * Fires `scanstitch-evaluated` when a result of the engine is on the screen, with the `elapsed_ms` of the worker and the
 * `total_ms` since the files were dropped or an option was changed.
 */
@customElement('scanstitch-evaluate')
export class ScanstitchEvaluate extends LitElement {
  @property({ type: Boolean, reflect: true }) dark = false;
  /** A run to begin with. */
  @property({ attribute: false }) given: GivenFiles | null = null;
  @query('#pick-trajectories') private input!: HTMLInputElement;
  @query('scanstitch-evaluation-figures') private figures!: ScanstitchEvaluationFigures | null;

  private session = new EvaluateSession(this, (result) => void this.tellDrawn(result));
  private dropTarget = new DropTarget(this, (transfer) => void this.openDropped(transfer));
  private columnsFor = memoizeLast(columnsOf);
  private colorsOf = memoizeLast((order: readonly number[], dark: boolean) => {
    const { estimates } = makeColors(dark);
    return new Map(order.map((id, index) => [id, estimates[index % estimates.length] as string]));
  });

  protected override willUpdate(changed: PropertyValues<this>): void {
    if (changed.has('given') && this.given) this.session.begin(this.given);
  }

  private async tellDrawn({ elapsed_ms }: Result): Promise<void> {
    await this.updateComplete;
    await this.figures?.isDrawn();
    const detail = { elapsed_ms, total_ms: performance.now() - this.session.requestedAt };
    tellHost(this, 'scanstitch-evaluated', detail);
  }

  protected override render(): TemplateResult {
    const { session, dropTarget } = this;
    const { files, clouds } = session;
    const isEmpty = files.length + clouds.length === 0;
    const isAlone = files.length === 1 && clouds.length === 0;
    return html`<div class="evaluate">
      ${
        isEmpty
          ? this.renderEmpty()
          : html`${this.renderControls()} ${this.renderNotices()} ${isAlone ? this.renderAlone() : nothing}
            ${this.renderResult()}`
      }
      <input id="pick-trajectories" type="file" multiple hidden @change=${this.onPicked} />
      ${announcements(session.announcer)} ${dropTarget.hint('Drop trajectories here')}
    </div>`;
  }

  private renderEmpty(): TemplateResult {
    return html`<section class="empty" aria-label="No trajectories yet">
      <h2>Compare trajectories with ground truth</h2>
      <p>
        Drop a ground truth trajectory and any number of estimates: TUM, KITTI, EuRoC, NumPy, CSV, or a folder with one
        pose file per frame. A file named “gt”, “truth” or “reference” is taken as the ground truth. Errors are computed
        as evo does.
      </p>
      <p class="muted">
        <b>Submissions:</b> drop the ground truth with all files, as a folder or a zip: they are ranked, and a file that
        cannot be compared is listed with the reason. <b>No ground truth?</b> Drop maps as PLY or PCD to compare their
        sharpness.
      </p>
      <p class="actions">
        <button class="primary" @click=${() => this.input.click()}>${icon('open')}Choose files…</button>
        <button @click=${this.openSample}>Show a sample</button>
        ${
          this.given
            ? html`<button @click=${() => this.given && this.session.begin(this.given)}>The open run</button>`
            : nothing
        }
      </p>
      ${this.session.messages.map(
        (message) => html`<p class="problem" role="alert">${message.text} ${retryButton(message)}</p>`,
      )}
      <p class="muted">Nothing leaves this machine.</p>
    </section>`;
  }

  /** One trajectory, and nothing to compare it with. */
  private renderAlone(): TemplateResult {
    const { files, choices } = this.session;
    const name = files[0]?.name ?? '';
    const isReference = files[0]?.id === choices.referenceId;
    return html`<section class="empty" aria-label="Nothing to compare with yet">
      <h2>${isReference ? `Drop estimates to compare with ${name}` : `Drop the ground truth of ${name}`}</h2>
      <p>
        ${
          isReference
            ? 'It is taken as the ground truth. Any number of estimates can be compared with it.'
            : 'A trajectory in TUM, KITTI, EuRoC, NumPy or CSV format, with one pose for each scan or frame, or with times.'
        }
      </p>
      <p class="actions">
        <button class="primary" @click=${() => this.input.click()}>${icon('open')}Choose files…</button>
      </p>
    </section>`;
  }

  /** Three estimates of the sample's corridor, and its ground truth. */
  private openSample = async (): Promise<void> => {
    try {
      const { fetchTrajectories } = await import('../datasets/trajectories.js');
      await this.session.open(await fetchTrajectories());
    } catch (error) {
      this.session.report(`The sample could not be fetched: ${messageOf(error)}`);
    }
  };

  private renderControls(): TemplateResult {
    const { session } = this;
    const { files, choices, clouds, times, relations } = session;
    const beside: AuxiliaryFile[] = [
      ...(times ? [{ id: 'times', label: 'times', name: times.name } as const] : []),
      ...(relations ? [{ id: 'relations', label: 'relations', name: relations.name } as const] : []),
      ...(clouds.length > 0 ? [{ id: 'clouds', label: '', name: plural(clouds.length, 'cloud') } as const] : []),
    ];
    return html`<scanstitch-evaluation-controls
      .files=${files}
      .referenceId=${choices.referenceId}
      .options=${session.options}
      .beside=${beside}
      .loops_only=${choices.loops_only}
      @reference-chosen=${({ detail }: CustomEvent<number>) => session.choose({ referenceId: detail })}
      @options-changed=${({ detail }: CustomEvent<Partial<EvaluationOptions>>) =>
        session.choose({ options: { ...choices.options, ...detail } })}
      @loops-only-changed=${({ detail }: CustomEvent<boolean>) => session.choose({ loops_only: detail })}
      @beside-removed=${({ detail }: CustomEvent<AuxiliaryId>) => session.removeAuxiliary(detail)}
      @files-wanted=${() => this.input.click()}
      @all-removed=${() => session.clear()}
    ></scanstitch-evaluation-controls>`;
  }

  private renderNotices(): TemplateResult | typeof nothing {
    const { files, result, comparisons, selectedId, messages } = this.session;
    const { problems, remarks } = noticesOf({
      numFiles: files.length,
      answer: result,
      selected: comparisons.find(({ id }) => id === selectedId) ?? null,
      messages,
    });
    if (problems.length + remarks.length === 0) return nothing;
    return html`<ul class="problems">
      ${problems.map((problem) => html`<li class="problem" role="alert">${icon('doubtful')}${problem}</li>`)}
      ${remarks.map((remark) => html`<li>${icon('info')}${remark}</li>`)} ${messages.map(retryButton)}
    </ul>`;
  }

  private renderResult(): TemplateResult {
    const { session } = this;
    const { comparisons, result, order, run, clouds } = session;
    const hasRelations = comparisons.some(({ relations }) => relations !== null);
    return html`${
      result && comparisons.length + result.refusals.length > 0
        ? html`<scanstitch-ranking
            .ranked=${session.ranked}
            .refusals=${result.refusals}
            .columns=${this.columnsFor(comparisons[0]?.summary.unit ?? '', session.options, hasRelations)}
            .referenceName=${session.referenceName}
            .sort=${session.sort}
            .selectedId=${session.selectedId}
            .elapsed_ms=${result.elapsed_ms}
            .colors=${this.colorsOf(order, this.dark)}
            @estimate-selected=${({ detail }: CustomEvent<number>) => session.select(detail)}
            @estimate-removed=${({ detail }: CustomEvent<number>) => session.removeEstimate(detail)}
            @sort-changed=${({ detail }: CustomEvent<Sort>) => session.sortBy(detail)}
            @said=${({ detail }: CustomEvent<string>) => session.announce(detail)}
          ></scanstitch-ranking>`
        : nothing
    }
    ${
      comparisons.length > 0
        ? html`<scanstitch-evaluation-figures
            .comparisons=${comparisons}
            .selectedId=${session.selectedId}
            .order=${order}
            .dataKey=${session.dataKey}
            .firstAbscissa=${session.runId < 0 ? 'seconds' : 'number'}
            ?dark=${this.dark}
          ></scanstitch-evaluation-figures>`
        : nothing
    }
    ${
      clouds.length > 0 || run !== null
        ? html`<scanstitch-map-panel
            .answer=${session.mapResult}
            ?busy=${session.isJudgingMap}
            ?hasRun=${run !== null && clouds.length === 0}
            @run-map-wanted=${() => session.judgeRun()}
          ></scanstitch-map-panel>`
        : nothing
    }`;
  }

  // Files.

  private async openDropped(transfer: DataTransfer): Promise<void> {
    const unreadable: Note[] = [];
    await this.session.open(await filesOfDrop(transfer, unreadable), unreadable);
  }

  private async onPicked(): Promise<void> {
    await this.session.open(filesOfInput(this.input));
  }

  static override styles = [tokens, shared, pageStyles, dropStyles, emptyStyles, evaluateStyles];
}
