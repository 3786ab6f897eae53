import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { list } from '../components/list-field.js';
import { RESET } from '../components/panel-icons.js';
import { whileConnected } from '../components/while-connected.js';
import '../components/menu.js';
import { WHOLE } from '../views/address.js';
import './lab-side.js';
import './plane-stage.js';
import './space-stage.js';
import { announcements } from '../components/announcer.js';
import { layoutStyles } from '../run/run-styles.js';
import { DropTarget } from '../components/drop-target.js';
import type { GivenClouds } from '../run/given-clouds.js';
import { icon } from '../components/icons.js';
import { messages } from '../run/run-parts.js';
import { dropStyles, emptyStyles, shared } from '../components/theme.js';
import { filesOfInput } from '../datasets/gather.js';
import { messageOf } from '../engine/message-of.js';
import { download } from '../export/download.js';
import { baseName } from '../views/format.js';
import { makeColors } from '../views/figure-colors.js';
import { memoizeLast } from '../views/memoize-last.js';
import { labStyles } from './lab-styles.js';
import type { ScanstitchLabPlane } from './plane-stage.js';
import { FIRST_LOOK, type PlaneScene, type StageLook, stageTheme } from './plane-painter.js';
import type { LabFacts, Pose } from './protocol.js';
import type { ScanstitchLabSide, Tab } from './lab-side.js';
import { LabOpening } from './opening.js';
import { exportFile, exportItems, type Shoot } from './export.js';
import { emptyLab, examplesMenu, question } from './lab-empty.js';
import { runColor } from './runs.js';
import { LabSession } from './session.js';
import { stageScene } from './stage-scene.js';
import type { ScanstitchLabSpace } from './space-stage.js';
import type { RunKey } from './stage-keys.js';
import { legend, transport } from './stage-parts.js';
import { methodName, stateWords } from './words.js';

/**
 * The ICP lab: two clouds, registered iteration by iteration. What each iteration sees, solves and does is shown, and what
 * becomes of it from another start or by another method.
 */
@customElement('scanstitch-lab')
export class ScanstitchLab extends LitElement {
  /** Another object opens other clouds. */
  @property({ attribute: false }) given: GivenClouds | null = null;
  /** Addresses of a course page: two clouds, or a manifest. */
  @property() src = '';
  /** A scene of the gallery, where there is no `src`. */
  @property() example = '';
  @property({ type: Boolean }) dark = false;
  /** What is shown stands in the page's address, as a link. */
  @property({ type: Boolean, attribute: 'remember-link' }) remembersLink = false;

  @state() private tab: Tab = 'step';
  @state() private look = FIRST_LOOK;
  /** A pose that a landscape or a basin points at. */
  @state() private ghost: Pose | null = null;
  @query('#pick') private fileInput!: HTMLInputElement;
  @query('scanstitch-lab-side') private side!: ScanstitchLabSide;
  @query('scanstitch-lab-space') private space!: ScanstitchLabSpace | null;
  @query('scanstitch-lab-plane') private plane!: ScanstitchLabPlane | null;

  private session = new LabSession(this);
  private opening = new LabOpening(this.session, (tab: Tab) => {
    this.tab = tab;
  });
  private colorsOf = memoizeLast(makeColors);
  private dropTarget = new DropTarget(this, (transfer) => void this.opening.takeDrop(transfer));

  constructor() {
    super();
    whileConnected(this, window, 'hashchange', (event) => this.onAddress(event));
  }

  protected override firstUpdated(): void {
    if (!this.given && !this.openAddress(WHOLE.fragment)) this.openOwn();
  }

  private openOwn(): void {
    this.opening.openOwn(this.src, this.example);
  }

  private openAddress(hash: string): boolean {
    return this.remembersLink && this.opening.openAddress(hash);
  }

  private link(): string {
    return this.opening.link(this.tab);
  }

  /** Another scene was typed into the address; by now the lab may have put its own link there again. */
  private onAddress({ newURL }: HashChangeEvent): void {
    const hash = WHOLE.of(new URL(newURL).hash);
    if (hash !== this.link()) this.openAddress(hash);
  }

  protected override updated(changed: PropertyValues<this>): void {
    if (changed.has('given') && this.given) void this.session.open(this.given);
    else if (changed.get('src') !== undefined || changed.get('example') !== undefined) this.openOwn();
    this.rememberLink();
  }

  protected override render(): TemplateResult {
    const { session, dropTarget } = this;
    const isEmpty = session.given === null;
    return html`<div class="lab run">
      ${isEmpty ? this.renderEmpty() : this.renderLab()}
      <input id="pick" type="file" multiple hidden accept=".ply,.pcd,.csv,.txt,.json,.npy" @change=${this.onPicked} />
      ${dropTarget.hint('Drop one or two clouds here')} ${announcements(session.announcer)}
    </div>`;
  }

  private renderEmpty(): TemplateResult {
    return emptyLab(this.statusOf(), {
      choose: () => this.fileInput.click(),
      sample: () => this.opening.openSample(),
      example: (name) => this.opening.showExample(name),
    });
  }

  private renderLab(): TemplateResult {
    const { session, opening } = this;
    const { trace, iteration, player, run, facts } = session;
    const state = run ? stateWords(run, session.at, session.present) : '';
    return html`
      ${this.renderPair()} ${opening.scene ? question(opening.scene) : nothing}
      <div class="columns">
        <div class="main">
          <div class="stage-area">
            ${this.renderStage(state)}
            ${
              session.isDragged
                ? html`<button class="primary run-from-here" @click=${() => void session.release()}>
                    Run from here (Enter)
                  </button>`
                : session.at === 0 && !player.isPlaying && trace
                  ? html`<p class="hint" aria-hidden="true">
                      ${facts?.is_planar ? 'Drag the blue cloud to another start, or its ring to turn it' : 'Turn on the crossed arrows to drag the source; hold Shift to rotate it'}
                    </p>`
                  : nothing
            }
            ${session.phase === 'reading' || !facts ? html`<p class="hint">${session.activity}…</p>` : nothing}
            ${messages(this.statusOf())}
          </div>
          <div>
            ${transport({
              player,
              state,
              step: (direction) => session.stepBy(direction),
              toStart: () => player.seek(0),
            })}
            ${legend({
              look: this.seenLook(),
              iteration,
              is_planar: facts?.is_planar ?? true,
              hasNormals: (facts?.target_normals.length ?? 0) > 0,
              dark: this.dark,
              change: (look) => {
                this.look = look;
              },
            })}
          </div>
        </div>
        <scanstitch-lab-side
          .session=${session}
          .tab=${this.tab}
          .tick=${{}}
          ?dark=${this.dark}
          @tab-chosen=${({ detail }: CustomEvent<Tab>) => {
            this.tab = detail;
          }}
          @ghost-shown=${(event: CustomEvent<Pose | null>) => {
            event.stopPropagation();
            this.ghost = event.detail;
          }}
        ></scanstitch-lab-side>
      </div>
    `;
  }

  private renderPair(): TemplateResult {
    const { session } = this;
    const { given, run, facts } = session;
    const theme = stageTheme(this.dark);
    const clouds = given?.clouds.map(({ name }) => [name, baseName(name)] as const) ?? [];
    const choice = (role: 'source' | 'target', label: string, color: string): TemplateResult =>
      html`<label
        ><i class="swatch" style="background: ${color}" aria-hidden="true"></i>${label}
        ${list(clouds, given?.[role], (name) => session.choose(role, name))}</label
      >`;
    return html`<div class="pair" role="group" aria-label="Clouds">
      ${choice('source', 'Source', theme.source)} ${choice('target', 'Target', theme.target)}
      <span class="method">${run && facts ? methodName(run.options, facts) : ''}</span>
      <span class="ends">
        <button
          ?disabled=${!session.trace}
          @click=${() => void session.startFrom(null, false)}
          title="The start that was given"
        >
          ${icon(RESET)}Reset start
        </button>
        <button @click=${() => this.fileInput.click()} title="Two clouds, or the poses of your own ICP">
          ${icon('open')}Open…
        </button>
        ${
          this.src || this.example
            ? html`<button @click=${() => this.openOwn()} title="What this page opened first">
                This page’s clouds
              </button>`
            : nothing
        }
        ${examplesMenu((name) => this.opening.showExample(name))}
        <scanstitch-menu
          label="Export"
          icon="download"
          .items=${exportItems(facts?.is_planar ?? true, this.tab !== 'degeneracy' && this.tab !== 'method')}
          ?disabled=${!session.trace}
          @menu-chosen=${({ detail }: CustomEvent<string>) => void this.export(detail)}
        ></scanstitch-menu>
      </span>
    </div>`;
  }

  private renderStage(state: string): TemplateResult | typeof nothing {
    const { session } = this;
    const { facts } = session;
    if (!facts) return html`<div></div>`;
    const onKey = ({ detail }: CustomEvent<RunKey>): void => this.onRunKey(detail);
    const onDragged = ({ detail }: CustomEvent<Pose>): void => session.drag(detail);
    const onReleased = (): void => void session.release();
    if (!facts.is_planar) {
      return html`<scanstitch-lab-space
        .scene=${this.sceneOf(facts)}
        .fitKey=${session.generation}
        .up=${session.isOfCamera ? 'camera' : 'z'}
        .description=${state}
        @source-dragged=${onDragged}
        @source-released=${onReleased}
        @stage-key=${onKey}
      ></scanstitch-lab-space>`;
    }
    return html`<scanstitch-lab-plane
      .scene=${this.sceneOf(facts)}
      .turns=${session.given?.turns ?? null}
      .fitKey=${session.generation}
      .description=${state}
      @source-dragged=${onDragged}
      @source-released=${onReleased}
      @stage-key=${onKey}
    ></scanstitch-lab-plane>`;
  }

  private sceneOf(facts: LabFacts): PlaneScene {
    const { session, dark, ghost } = this;
    const { selected } = this.colorsOf(dark);
    const of = { session, facts, dark, look: this.seenLook(), showsDirections: this.tab === 'degeneracy' };
    return stageScene(
      of,
      (run) => runColor(session, run, this.colorsOf(dark)),
      ghost && { pose: ghost, color: selected },
    );
  }

  /** Beside the directions, pairs are coloured by what they say of the weakest one. */
  private seenLook(): StageLook {
    return this.tab === 'degeneracy' ? { ...this.look, colorBy: 'contribution' } : this.look;
  }

  private onRunKey(key: RunKey): void {
    const { session } = this;
    const { player } = session;
    const actions: Record<RunKey, () => void> = {
      next: () => session.stepBy(1),
      previous: () => session.stepBy(-1),
      play: () => (player.isPlaying ? player.pause() : player.play()),
      run: () => void session.release(),
      first: () => player.seek(0),
      last: () => player.seek(player.count),
    };
    actions[key]();
  }

  /** For the parts that all run views share: the activity and the messages. */
  private statusOf() {
    const { session } = this;
    return {
      phase:
        session.phase === 'reading' ? 'reading' : session.phase === 'running' && !session.facts ? 'running' : 'done',
      activity: session.activity,
      progress: session.progress,
      messages: session.messages,
      stop: () => undefined,
      resume: () => undefined,
      dismissMessages: () => session.dismissMessages(),
    };
  }

  // What leaves the lab.

  private rememberLink(): void {
    if (!this.remembersLink || this.hidden || !this.session.trace || this.session.player.isPlaying) return;
    const link = this.link();
    if (link !== WHOLE.fragment) WHOLE.write(link);
  }

  private async export(id: string): Promise<void> {
    const { session } = this;
    const { run, facts } = session;
    if (!run || !facts) return;
    try {
      if (id === 'link') {
        return await session.copy(new URL(this.link(), location.href).href, 'The link was copied.');
      }
      const { space, plane } = this;
      const scene = this.sceneOf(facts);
      const inSpace: Shoot = async (pose, iteration) => {
        if (!space) throw new Error('the clouds are not shown');
        return space.picture({ ...scene, pose, iteration });
      };
      const stage = plane ? { ...plane.viewport, scene } : inSpace;
      download(await exportFile(id, session, run, stage, this.side.figure, this.dark));
    } catch (error) {
      session.report(`The export failed: ${messageOf(error)}`);
    }
  }

  // Files.

  private onPicked({ target }: Event): void {
    void this.opening.take(filesOfInput(target as HTMLInputElement));
  }

  static override styles = [shared, layoutStyles, dropStyles, emptyStyles, labStyles];
}
