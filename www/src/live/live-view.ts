import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { printable } from '../../../package/base/printable.js';
import { kindOf } from '../../../package/live/frames.js';
import type { Offered } from '../../../package/live/source.js';
import { announcements } from '../components/announcer.js';
import { fire } from '../components/fire.js';
import { icon } from '../components/icons.js';
import '../drawing/map-view.js';
import '../components/messages.js';
import type { Message } from '../components/messages.js';
import { emptyStyles, shared } from '../components/theme.js';
import { download } from '../export/download.js';
import { sentence } from '../views/format.js';
import { memoizeLast } from '../views/memoize-last.js';
import { framePalette } from '../views/palette.js';
import { certainPieces, uncertainLinks } from '../views/pieces.js';
import type { MapMarks } from '../views/map-painter.js';
import type { PlanarShown, SpatialShown } from './growth.js';
import { LiveSession } from './session.js';
import { liveStyles } from './styles.js';
import { barStyles } from '../components/section-styles.js';
import { flowWords, kindWords, sizeWords } from './words.js';

const USUAL_ADDRESS = 'ws://localhost:8765';

/**
 * A robot's topics as they come: the user enters an address and chooses topics, and the map grows.
 *
 * Fires `stream-kept` with the recording of a stream that has ended.
 */
@customElement('scanstitch-live')
export class ScanstitchLive extends LitElement {
  @property({ type: Boolean, reflect: true }) dark = false;
  /** Of a server to connect to at once. */
  @property() address = '';
  /** Whether the page's address may name one, which is connected to on request: `#live&url=...`. */
  @property({ type: Boolean }) linked = false;

  private session = new LiveSession(this, (recording) => fire(this, 'stream-kept', recording));
  private typed = USUAL_ADDRESS;
  private planarMarksOf = memoizeLast(planarMarks);
  private spatialMarksOf = memoizeLast(spatialMarks);
  private colorsOf = memoizeLast(framePalette);
  private piecesOf = memoizeLast(certainPieces);

  protected override willUpdate(changed: PropertyValues<this>): void {
    if (!this.hasUpdated && this.linked) {
      this.typed = new URLSearchParams(location.hash.replace(/^#/, '')).get('url') ?? this.typed;
    }
    if (!changed.has('address')) return;
    if (this.address === '') this.session.stop();
    else {
      this.typed = this.address;
      this.session.connect(this.address, true);
    }
  }

  protected override render(): TemplateResult {
    const { session } = this;
    return html`<div class="whole">
      <scanstitch-messages
        strip
        .messages=${this.messages()}
        @messages-dismissed=${() => {
          session.problem = null;
          this.requestUpdate();
        }}
      ></scanstitch-messages>
      ${session.phase === 'receiving' ? this.renderStream() : this.renderCard()} ${announcements(session.announcer)}
    </div>`;
  }

  private messages(): Message[] {
    const { problem } = this.session;
    return problem
      ? [{ kind: 'error', file: '', place: '', text: sentence(problem.problem), remedy: problem.remedy }]
      : [];
  }

  private renderCard(): TemplateResult {
    const { phase, recording } = this.session;
    return html`<div class="empty">
      <section aria-label="Live">
        <h2>A robot's topics, as they come</h2>
        ${recording ? this.renderKept(recording) : nothing}
        ${phase === 'choosing' ? this.renderTopics() : this.renderAddress()}
      </section>
    </div>`;
  }

  private renderKept(recording: File): TemplateResult {
    const { address, end } = this.session;
    return html`<p>
        ${address}: ${printable(end?.reason ?? '')}. ${recording.name} keeps what came, ${sizeWords(recording.size)}.
      </p>
      <p class="actions">
        <button @click=${() => download({ name: recording.name, blob: recording })}>
          ${icon('download')}Save the recording
        </button>
        <button @click=${() => fire(this, 'stream-kept', recording)}>Show its map</button>
      </p>`;
  }

  private renderAddress(): TemplateResult {
    const isConnecting = this.session.phase === 'connecting';
    const submit = (event: SubmitEvent): void => {
      event.preventDefault();
      this.typed = String(new FormData(event.target as HTMLFormElement).get('address'));
      this.session.connect(this.typed);
    };
    return html`<form @submit=${submit}>
        <label
          >Address of the bridge
          <input
            name="address"
            inputmode="url"
            autocomplete="off"
            spellcheck="false"
            .value=${this.typed}
            ?disabled=${isConnecting}
        /></label>
        ${
          isConnecting
            ? html`<button type="button" @click=${() => this.session.stop()}>Cancel</button>
                <span role="status" class="muted">Connecting …</span>`
            : html`<button class="primary">Connect</button>`
        }
      </form>
      <dl>
        <dt>Foxglove bridge, port 8765</dt>
        <dd><code>ros2 launch foxglove_bridge foxglove_bridge_launch.xml</code></dd>
        <dt>rosbridge, port 9090</dt>
        <dd><code>ros2 launch rosbridge_server rosbridge_websocket_launch.xml</code></dd>
      </dl>
      <p class="muted">
        Laser scans, clouds or depth images are mapped while they come. All messages are kept as a recording, which is
        reconstructed when the stream ends. Nothing leaves this machine.
      </p>`;
  }

  private renderTopics(): TemplateResult {
    const { address, stream } = this.session;
    const offered = [...(stream?.offered ?? [])].sort((a, b) => Number(!isRead(a)) - Number(!isRead(b)));
    const submit = (event: SubmitEvent): void => {
      event.preventDefault();
      this.session.start(new Set(new FormData(event.target as HTMLFormElement).getAll('topic').map(String)));
    };
    return html`<form class="topics" @submit=${submit}>
      <p role="status">
        ${stream?.protocol} at ${address}:
        ${offered.length === 0 ? 'no topics yet' : 'choose the topics to record and map.'}
      </p>
      <table aria-label="Topics">
        <tbody>
          ${offered.map(
            (topic) =>
              html`<tr class=${isRead(topic) ? '' : 'muted'}>
                <th scope="row">
                  <label
                    ><input
                      type="checkbox"
                      name="topic"
                      value=${topic.name}
                      ?checked=${isRead(topic)}
                      ?disabled=${!isRead(topic)}
                    />
                    ${printable(topic.name)}</label
                  >
                </th>
                <td>${kindWords(topic)}</td>
                <td class="muted type">${printable(topic.type)}</td>
              </tr>`,
          )}
        </tbody>
      </table>
      ${offered.length === 0 || offered.some(mayMap) ? nothing : html`<p class="muted">There are no laser scans, clouds or depth images among them, of which a map is made.</p>`}
      <p class="actions">
        <button class="primary" ?disabled=${!offered.some(isRead)}>Start</button>
        <button type="button" @click=${() => this.session.stop()}>Cancel</button>
      </p>
    </form>`;
  }

  private renderStream(): TemplateResult {
    const { session } = this;
    const problems = [...(session.stream?.problems ?? [])].map(
      ([problem, count]) => `${printable(problem)}${count > 1 ? ` (${count} times)` : ''}`,
    );
    if (session.mapProblem) problems.push(`The growing map: ${printable(session.mapProblem)}`);
    return html`<section class="bar" aria-label="Stream">
        <h2>Live</h2>
        <span class="address">${session.address}</span>
        <span class="flow number">${flowWords(session)}</span>
        <button class="primary" @click=${() => session.stop()}>Stop</button>
      </section>
      ${
        problems.length === 0
          ? nothing
          : html`<ul class="problems" aria-label="Problems">
              ${problems.map((problem) => html`<li>${sentence(problem)}</li>`)}
            </ul>`
      }
      ${this.renderMap()}`;
  }

  private renderMap(): TemplateResult {
    const shown = this.session.growth?.shown;
    if (shown?.kind === 'planar') return this.renderPlanar(shown);
    if (shown?.kind === 'spatial') return this.renderSpatial(shown);
    return html`<div class="empty">
      <p class="muted">
        The map appears with the first scans, clouds or depth images; messages of other kinds are kept for the end.
      </p>
    </div>`;
  }

  private renderPlanar({ frames, points, lookDirection }: PlanarShown): TemplateResult {
    return html`<scanstitch-map
      .points=${points}
      .marks=${this.planarMarksOf(frames, lookDirection)}
      .colors=${this.colorsOf(frames.length, this.dark)}
      .pieces=${this.piecesOf(frames, this.dark)}
      .description=${`The map of ${frames.length} scans so far.`}
      ?dark=${this.dark}
    ></scanstitch-map>`;
  }

  private renderSpatial({ snapshot: { points, result } }: SpatialShown): TemplateResult {
    return html`<scanstitch-map3d
      .points=${points}
      .marks=${this.spatialMarksOf(result)}
      .voxel_size=${result.settings.map_voxel_size || 0.05}
      .hasColors=${points.colors.length > 0}
      .description=${`The map of ${result.frames.length} frames so far.`}
      growing
      ?dark=${this.dark}
    ></scanstitch-map3d>`;
  }

  static override styles = [shared, emptyStyles, barStyles, liveStyles];
}

const isRead = (topic: Offered): boolean => kindOf(topic) !== undefined;
const mayMap = (topic: Offered): boolean => /cloud|scan|image/.test(kindOf(topic) ?? '');

function planarMarks(frames: PlanarShown['frames'], lookDirection: number): MapMarks {
  return {
    poses: frames.map(({ T_world_sensor }) => T_world_sensor),
    statuses: frames.map(({ status }) => status),
    uncertainLinks: uncertainLinks(frames),
    lookDirection,
    until: frames.length,
    selected: null,
    hovered: null,
    reference: [],
    pairs: null,
    undetermined: null,
  };
}

function spatialMarks({ frames, camera }: SpatialShown['snapshot']['result']): {
  poses: SpatialShown['snapshot']['result']['frames'][number]['T_world_sensor'][];
  reference: never[];
  camera: typeof camera;
  until: number;
  selected: null;
} {
  const poses = frames.map(({ T_world_sensor }) => T_world_sensor);
  return { poses, reference: [], camera, until: frames.length, selected: null };
}
