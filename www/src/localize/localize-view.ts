import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { type Choices, list } from '../components/list-field.js';
import { statusBadge } from '../components/status-badge.js';
import { TRASH } from '../components/panel-icons.js';
import '../components/menu.js';
import '../components/messages.js';
import { figureStyles } from '../components/number-table.js';
import '../drawing/timeline.js';
import { announcements } from '../components/announcer.js';
import { DropTarget } from '../components/drop-target.js';
import { tellHost } from '../components/host-events.js';
import { iconButton } from '../components/icon-button.js';
import { icon } from '../components/icons.js';
import type { MenuItem } from '../components/menu.js';
import type { GivenScans } from '../run/run-kind.js';
import { dropStyles, emptyStyles, shared, tokens } from '../components/theme.js';
import { fieldStyles, statusStyles } from '../components/panel-theme.js';
import { watchSize } from '../components/watch-size.js';
import { filesOfDrop, filesOfInput, type NamedFile } from '../datasets/gather.js';
import type { Note } from '../datasets/note.js';
import type { Settings } from '../engine/protocol.js';
import type { Status } from '../views/map-painter.js';
import { memoizeLast } from '../views/memoize-last.js';
import './located-map.js';
import { type Dropped, understandDrop } from './opening.js';
import type { Files, Located } from './protocol.js';
import { statusColors } from './paint.js';
import { particlePanel } from './particle-panel.js';
import { mapWords, scanPanel } from './scan-panel.js';
import { LocalizeSession } from './session.js';
import { localizeStyles } from './styles.js';
import { barStyles } from '../components/section-styles.js';
import { trackOf } from './track.js';

/** What the command line writes. */
const EXPORTS: readonly (MenuItem & { id: keyof Files })[] = [
  {
    id: 'trajectory',
    label: 'Trajectory',
    detail: 'trajectory.tum: t x y z qx qy qz qw of each scan whose place is certain',
  },
  { id: 'report', label: 'Report', detail: 'report.json: places, covariances and rivals of all scans' },
  { id: 'picture', label: 'Picture', detail: 'localization.png: scans and trajectory in the cells of the map' },
];

const ODOMETRY: Choices<Settings['odometry']> = { auto: 'as found', log: 'poses of the log', none: 'none' };

/** Up to this width details lie below the map, as the styles have it (CSS pixels). */
const NARROW = 720;

type Verdict = Located['outcome']['verdict'];
const VERDICTS: Record<Verdict, { status: Status; words: string }> = {
  found: { status: 'good', words: 'Found in this map' },
  undecided: { status: 'doubtful', words: 'Undecided' },
  not_in_map: { status: 'lost', words: 'Not in this map' },
};

/**
 * Where a recording was taken in a map: both are dropped here, in any order. Every place that is possible is drawn with its
 * uncertainty as long as it lives.
 *
 * Fires `scanstitch-located` when all scans are located.
 */
@customElement('scanstitch-localize')
export class ScanstitchLocalize extends LitElement {
  @property({ type: Boolean, reflect: true }) dark = false;
  /** Address of a map; and what holds the recording, as the element's `src`. */
  @property() map = '';
  @property() src = '';
  /** Whether the page's address may name both: `#localize&map=...&src=...`. */
  @property({ type: Boolean }) linked = false;
  /** What was dropped on another view. */
  @property({ attribute: false }) dropped: Dropped | null = null;
  /** The scans on the page's map. */
  @property({ attribute: false }) given: GivenScans | null = null;
  /** Whether there is little room. */
  @state() private isNarrow = false;
  @query('#pick') private input!: HTMLInputElement;

  private session = new LocalizeSession(this, () => this.tellLocated());
  private trackOf = memoizeLast(trackOf);
  private colorsOf = memoizeLast(statusColors);
  private dropTarget = new DropTarget(this, (transfer) => {
    const notes: Note[] = [];
    this.take(filesOfDrop(transfer, notes), notes);
  });

  constructor() {
    super();
    watchSize(this, (width) => {
      this.isNarrow = width <= NARROW;
    });
  }

  protected override willUpdate(changed: PropertyValues<this>): void {
    if (!this.hasUpdated && this.linked) this.readAddress();
    const { session, map, src, dropped, given } = this;
    // First: what is dropped or named counts more.
    if (changed.has('given') && given) session.openScans(given);
    if ((changed.has('map') || changed.has('src')) && map + src !== '') {
      session.open(async (signal) => {
        const { fetchDropped } = await import('./addresses.js');
        return fetchDropped(map, src, { signal, fetched: () => undefined });
      }, 'Fetching the files');
    }
    if (changed.has('dropped') && dropped) session.open(async () => dropped, 'Opening the files');
  }

  private readAddress(): void {
    const named = new URLSearchParams(location.hash.replace(/^#/, ''));
    if (!named.has('localize')) return;
    [this.map, this.src] = [named.get('map') ?? this.map, named.get('src') ?? this.src];
  }

  protected override render(): TemplateResult {
    const { session, dropTarget } = this;
    const isEmpty = !session.map && !session.recording && !session.unscaled && session.phase !== 'reading';
    return html`<div class="whole">
      ${isEmpty ? nothing : this.renderBar()}
      <scanstitch-messages
        strip
        .messages=${session.messages}
        @messages-dismissed=${() => session.dismissMessages()}
      ></scanstitch-messages>
      ${isEmpty ? nothing : this.renderNext()} ${session.map ? this.renderResult() : this.renderEmpty()}
      <input id="pick" type="file" multiple hidden @change=${this.onPicked} />
      ${announcements(session.announcer)} ${dropTarget.hint('Drop a map or a recording here')}
    </div>`;
  }

  private renderEmpty(): TemplateResult {
    return html`<div class="empty">
      <section aria-label="No map yet">
        <h2>Where was a recording taken, in a map that you have?</h2>
        <p>
          Drop a map and a recording of laser scans, together or one after the other. The map is
          <code>map.yaml</code> of ROS with its picture, a picture alone, or <code>wean.dat</code>; the recording is a
          laser log, a ROS bag or scans as PLY files.
        </p>
        <p class="muted">
          No initial pose is needed: every place of the map is compared. Odometry in the recording or beside it is what
          makes a place certain.
        </p>
        <p class="actions">
          <button class="primary" @click=${() => this.input.click()}>${icon('open')}Choose files…</button>
        </p>
        <p class="muted">Nothing leaves this machine.</p>
      </section>
    </div>`;
  }

  private renderBar(): TemplateResult {
    const { session } = this;
    const { phase, activity, progress } = session;
    const what = [session.map?.name, session.recordingWords].filter(Boolean).join(' · ');
    return html`<section class="bar" aria-label="Localisation">
      <h2 class="visually-hidden">Where the recording was taken</h2>
      <span class="what" title=${what}>${what}</span>
      ${this.renderVerdict()}
      ${
        phase === 'reading' || phase === 'running'
          ? html`<span class="muted number">${activity}</span>
              <progress .value=${progress} aria-label=${activity}></progress>
              <button @click=${() => void session.stop()}>Stop</button>`
          : nothing
      }
      ${
        phase === 'stopped'
          ? html`<span class="muted">Stopped</span> <button @click=${() => session.locateAgain()}>Locate again</button>`
          : nothing
      }
      <span class="actions">
        ${session.recording && phase !== 'reading' && phase !== 'running' ? this.renderOdometry() : nothing}
        <button @click=${() => this.input.click()}>${icon('open')}Open…</button>
        <scanstitch-menu
          label="Export"
          icon="download"
          ?compact=${this.isNarrow}
          .items=${EXPORTS}
          ?disabled=${!session.isHeld || session.numLocated === 0}
          @menu-chosen=${({ detail }: CustomEvent<keyof Files>) => session.export(detail)}
        ></scanstitch-menu>
        ${iconButton(TRASH, 'Remove map and recording', () => session.clear(), { hint: 'Remove map and recording' })}
      </span>
    </section>`;
  }

  private renderVerdict(): TemplateResult | typeof nothing {
    const { phase, located } = this.session;
    if (!located) return nothing;
    const { verdict } = located.outcome;
    // While scans are located, that nothing is found yet is no answer.
    if (phase === 'running' && verdict !== 'found') return nothing;
    const { status, words } = VERDICTS[verdict];
    return statusBadge(status, words, 14);
  }

  private renderOdometry(): TemplateResult {
    const { session } = this;
    return html`<label>Odometry ${list(ODOMETRY, session.odometry, (choice) => session.setOdometry(choice))}</label>`;
  }

  /** What is missing, and how to give it. */
  private renderNext(): TemplateResult | typeof nothing {
    const { map, recording, unscaled, phase } = this.session;
    if (unscaled?.kind === 'picture') return this.renderScale(unscaled.picture);
    if (phase === 'reading' || (map && recording)) return nothing;
    const words = map
      ? 'Drop the recording to locate: a laser log, a ROS bag, or scans as PLY files.'
      : 'Drop the map: map.yaml with its picture, a picture alone, or wean.dat.';
    return html`<p class="next">${words}</p>`;
  }

  private renderScale({ name }: NamedFile): TemplateResult {
    const submit = (event: SubmitEvent): void => {
      event.preventDefault();
      const form = new FormData(event.target as HTMLFormElement);
      this.session.setScale(Number(form.get('resolution')));
    };
    return html`<div class="next">
      <p>${name} is a picture without a YAML file. Drop its YAML file, or say how large a pixel is.</p>
      <form @submit=${submit}>
        <label>Side of a pixel (m) <input name="resolution" type="number" step="any" required value="0.05" /></label>
        <button class="primary">Open the map</button>
      </form>
    </div>`;
  }

  private renderResult(): TemplateResult {
    const { session } = this;
    const { map, located, details, selected } = session;
    const track = located && this.trackOf(located.track);
    const shown = details?.index === selected ? details : null;
    const { width = 0, height = 0, resolution = 0 } = map?.picture ?? {};
    return html`<main class=${located ? '' : 'alone'}>
        <scanstitch-located-map
          .grid=${map?.picture ?? null}
          .track=${track}
          .selected=${selected}
          .details=${shown}
          .particles=${session.particles?.state?.values ?? null}
          .likelihoods=${session.particles && session.likelihoods}
          .description=${map ? mapWords(map.name, [width * resolution, height * resolution], shown) : ''}
          ?dark=${this.dark}
          @scan-selected=${({ detail }: CustomEvent<number | null>) => session.select(detail)}
        ></scanstitch-located-map>
        ${located ? this.renderDetails(located) : nothing}
      </main>
      ${
        track
          ? html`<scanstitch-timeline
              .count=${track.statuses.length}
              .until=${selected + 1}
              .colors=${this.colorsOf(track.statuses, this.dark)}
              ?dark=${this.dark}
              @until-changed=${({ detail }: CustomEvent<number>) => session.select(detail - 1)}
            ></scanstitch-timeline>`
          : nothing
      }`;
  }

  private renderDetails(located: Located): TemplateResult {
    const { session } = this;
    const { details, particles, phase } = session;
    return html`<aside aria-label="Details">
      ${this.renderSummary(located)} ${details ? scanPanel(details) : nothing}
      ${particles ? particlePanel(particles, details, (options) => session.chooseParticles(options)) : nothing}
      <p>
        <button
          aria-pressed=${particles !== null}
          ?disabled=${phase === 'running'}
          @click=${() => session.toggleParticles()}
        >
          ${particles ? 'Hide the particles' : 'Compare with a particle filter'}
        </button>
      </p>
    </aside>`;
  }

  private renderSummary({ outcome: { summary, notes } }: Located): TemplateResult | typeof nothing {
    if (this.session.phase !== 'done') return nothing;
    return html`<section aria-label="Result">
      <p>${summary}</p>
      ${notes.map((note) => html`<p class="muted">${note}</p>`)}
    </section>`;
  }

  // Files.

  private take(coming: Promise<NamedFile[]> | NamedFile[], notes: readonly Note[]): void {
    const { session } = this;
    session.open(async (signal) => {
      const fresh = await coming;
      const names = new Set(fresh.map(({ name }) => name));
      // What lacked something before, such as a YAML file without its picture, is completed.
      const before = session.incomplete.filter(({ name }) => !names.has(name));
      const dropped = await understandDrop([...before, ...fresh], { isForMap: true, notes, signal });
      return dropped;
    }, 'Opening the files');
  }

  private onPicked(): void {
    const files = filesOfInput(this.input);
    if (files.length > 0) this.take(files, []);
  }

  private tellLocated(): void {
    const { located, requestedAt } = this.session;
    if (!located) return;
    const { verdict, summary, num_scans_to_find } = located.outcome;
    const elapsed_ms = performance.now() - requestedAt;
    tellHost(this, 'scanstitch-located', { verdict, summary, num_scans_to_find, elapsed_ms });
  }

  static override styles = [
    tokens,
    shared,
    dropStyles,
    emptyStyles,
    fieldStyles,
    statusStyles,
    figureStyles,
    barStyles,
    localizeStyles,
  ];
}
