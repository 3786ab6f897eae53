import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { keyed } from 'lit/directives/keyed.js';
import { map_styles } from '../components/map-styles.js';
import { shared } from '../components/theme.js';
import type { Rgb } from '../views/palette.js';
import { Gestures, type GestureTarget } from './gestures.js';
import { type Heights, heightsOf, leveling, type MapPoints, NO_POINTS, sample, straightAzimuth } from './leveling.js';
import { ramp, sceneColors } from './look.js';
import { buttons, type LayersState, readout, sectionSlider } from './map3d-controls.js';
import { map3d_styles } from './map3d-styles.js';
import {
  between,
  fitted,
  isAlike,
  metresPerPixel,
  type Orbit,
  orbited,
  panned,
  type Size,
  STRAIGHT_DOWN,
  toScreen,
  zoomedAt,
} from './orbit.js';
import type { ColorMode } from './point-cloud.js';
import { type Camera, type Pose, positionOf } from './poses.js';
import type { LayerName, MapScene, SceneLook } from './scene.js';
import { type Mat3, transformed, type Vec3 } from './vectors.js';

/** What is drawn over the points. */
export interface SpatialMarks {
  poses: readonly Pose[];
  reference: readonly (Pose | null)[];
  camera: Camera | null;
  /** Frames shown, from the first on. */
  until: number;
  selected: number | null;
}

const NO_MARKS: SpatialMarks = { poses: [], reference: [], camera: null, until: 0, selected: null };
const FLAT: Mat3 = [
  [1, 0, 0],
  [0, -1, 0],
  [0, 0, -1],
];
const NO_HEIGHTS: Heights = { floor: 0, top: 0, section: 0 };
const FIRST_VIEW: Orbit = {
  target: [0, 0, -2],
  azimuth: 0,
  elevation: STRAIGHT_DOWN,
  distance: 10,
  projection: 'perspective',
};

const ZOOM_STEP = 1.3;
const PAN_STEP = 60; // CSS pixels
const TURN_STEP = Math.PI / 24;
const TURN_PER_PIXEL = 0.006;
const FLIGHT_MS = 350;
/** Points that a view is fitted to. */
const NUM_SAMPLES = 1500;
/** A lost graphics context is replaced after so long; again and again, ever later, where that fails. */
const RESTORE_MS = [250, 1000, 2000, 4000];

/**
 * The map in space: points, paths and cameras, which turn, move and zoom.
 *
 * Fires `frame-selected` with a frame number or null, `map-painted` when a new set of points is on the screen, and
 * `graphics-changed` with 'lost', 'restored' or 'unavailable'.
 */
@customElement('scanstitch-map3d')
export class ScanstitchMap3d extends LitElement implements GestureTarget {
  @property({ attribute: false }) points: MapPoints = NO_POINTS;
  @property({ attribute: false }) marks: SpatialMarks = NO_MARKS;
  @property({ attribute: false }) names: readonly string[] = [];
  @property({ attribute: false }) reference_name = '';
  /** Edge of the map's voxels, m: how large a point is drawn. */
  @property({ attribute: false }) voxel_size = 0.02;
  @property({ attribute: false }) has_colors = true;
  @property({ type: Boolean }) dark = false;
  /** Changes with the data set: the view is fitted anew. */
  @property({ attribute: false }) fit_key: unknown = null;
  @property({ attribute: false }) description = '';
  /** Whether more points are to come: small changes do not move the view until then. */
  @property({ type: Boolean }) growing = false;
  /** The selected frame's picture. */
  @property({ attribute: false }) image: HTMLImageElement | null = null;

  @state() private mode: ColorMode | null = null;
  @state() private size_factor = 1.6;
  /** Where the user cuts, m above the first camera; null: where the data suggest it. */
  @state() private section: number | null = null;
  @state() private heights: Heights = NO_HEIGHTS;
  @state() private shows: Record<LayerName, boolean> = {
    points: true,
    estimate: true,
    reference: true,
    cameras: true,
    grid: true,
  };
  @state() private layers_open = false;
  @state() private hovered: number | null = null;
  @state() private guarded = false;
  @state() private graphics: 'starting' | 'there' | 'lost' | 'unavailable' = 'starting';
  @state() private num_canvases = 0;
  @query('.stage') private stage!: HTMLElement;
  @query('canvas') private canvas!: HTMLCanvasElement;

  /** Where the eye is. What is written beside the map follows when a flight ends: anew at each of its pictures, it would take
   * more time than they do. */
  private orbit: Orbit = FIRST_VIEW;
  private scene: MapScene | null = null;
  private size: Size = { width: 0, height: 0 };
  private R_view_map: Mat3 = FLAT;
  private sampled: Vec3[] = [];
  /** The azimuth at which the walls run across and along the screen. */
  private straight = 0;
  private is_moved = false;
  private animation_frame = 0;
  private flight: { from: Orbit; to: Orbit; start: number } | null = null;
  private has_new_points = false;
  private num_failures = 0;
  private restore_timer: ReturnType<typeof setTimeout> | undefined;
  private gestures = new Gestures(this, this);
  private resize_observer = new ResizeObserver(() => this.resize());

  override connectedCallback(): void {
    super.connectedCallback();
    if (!this.hasUpdated) return;
    this.resize_observer.observe(this.stage);
    if (!this.scene) this.num_canvases++;
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.resize_observer.disconnect();
    cancelAnimationFrame(this.animation_frame);
    this.animation_frame = 0;
    clearTimeout(this.restore_timer);
    this.scene?.dispose();
    this.scene = null;
  }

  protected override firstUpdated(): void {
    this.gestures.listen(this.stage);
    this.resize_observer.observe(this.stage);
    this.resize();
  }

  protected override willUpdate(changed: PropertyValues<this>): void {
    if (changed.has('fit_key')) {
      this.is_moved = false;
      this.section = null;
      this.orbit = FIRST_VIEW;
      this.flight = null;
    }
    if (changed.has('points') || changed.has('fit_key')) this.survey();
  }

  protected override updated(changed: PropertyValues<this>): void {
    if ((changed as Map<PropertyKey, unknown>).has('num_canvases')) this.startScene();
    if (changed.has('points')) {
      this.scene?.setPoints(this.points);
      this.has_new_points = true;
    }
    const is_whole = changed.has('growing') && !this.growing;
    if ((changed.has('points') || is_whole) && !this.is_moved) this.follow(changed.has('fit_key'));
    const before = changed.get('marks');
    if (changed.has('marks') || changed.has('image') || changed.has('points')) this.passMarks(before ?? null);
    this.requestPaint();
  }

  /** Shows the whole map, from where the eye is. */
  fit(at_once = false): void {
    this.is_moved = false;
    const azimuth = this.orbit.elevation === STRAIGHT_DOWN ? this.straight : this.orbit.azimuth;
    this.flyToAll({ ...this.orbit, azimuth }, at_once);
  }

  /** Looks straight down. */
  fromAbove(): void {
    this.is_moved = false;
    this.flyToAll({ ...this.orbit, azimuth: this.straight, elevation: STRAIGHT_DOWN }, false);
  }

  /** Keeps the map in view while it grows; the view stands still where little has been added. */
  private follow(at_once: boolean): void {
    const azimuth = this.orbit.elevation === STRAIGHT_DOWN ? this.straight : this.orbit.azimuth;
    const to = this.toAll({ ...this.orbit, azimuth });
    if (at_once || !this.growing || !isAlike(this.flight?.to ?? this.orbit, to)) this.fly(to, at_once);
  }

  private flyToAll(orbit: Orbit, at_once: boolean): void {
    this.fly(this.toAll(orbit), at_once);
  }

  /** The orbit that shows all there is from where this one looks. */
  private toAll(orbit: Orbit): Orbit {
    // Beside the map the section's slider and the buttons need room.
    const margin = this.size.width < 520 ? { across: 30, along: 16 } : { across: 64, along: 30 };
    return fitted(orbit, this.openSamples(), this.size, margin);
  }

  /** What the section leaves, and all cameras: as heavy as a part of the map, lest they count as strays. */
  private openSamples(): Vec3[] {
    const cut = this.cut();
    const open = this.sampled.filter(([, y]) => y <= cut);
    const cameras = this.marks.poses.map((pose) => this.toView(positionOf(pose)));
    const weight = Math.ceil((open.length * 0.02) / Math.max(cameras.length, 1));
    return [...open, ...Array.from({ length: weight }, () => cameras).flat()];
  }

  /** The map as a picture, at twice the resolution of the screen or better. */
  async picture(): Promise<Blob> {
    if (!this.scene) throw new Error('The browser gives no 3D graphics at the moment.');
    return this.scene.toPng(this.orbit, this.look(), this.up(), 2);
  }

  protected override render(): TemplateResult {
    return html`
      <div
        class="stage"
        tabindex="0"
        role="group"
        aria-label="Map"
        aria-describedby="map-keys"
        ?data-guarded=${this.guarded}
        @keydown=${this.onKey}
        @dblclick=${() => this.fit()}
        @focus=${this.updateGuard}
        @blur=${this.updateGuard}
      >
        ${keyed(this.num_canvases, html`<canvas role="img" aria-label=${this.description}></canvas>`)}
        <p id="map-keys" class="visually-hidden">
          Arrow keys turn the map, with Shift they move it, plus and minus zoom, F shows all of it, T looks from above,
          P changes between perspective and plan, comma and full stop select the frame before and after.
        </p>
      </div>
      ${this.renderNotice()} ${this.renderControls()}
    `;
  }

  private renderNotice(): TemplateResult | typeof nothing {
    if (this.graphics === 'there' || this.graphics === 'starting') return nothing;
    return html`<div class="notice" role="status">
      ${
        this.graphics === 'lost'
          ? 'The graphics card dropped the picture. It is being drawn again; nothing computed is lost.'
          : html`This browser gives no 3D graphics (WebGL 2), so the map cannot be drawn. Everything else works:
              figures, table, exports. <button @click=${() => this.restart()}>Try again</button>`
      }
    </div>`;
  }

  private renderControls(): TemplateResult {
    const section = { heights: this.heights, cut: this.cut() };
    const onCut = (height: number): void => {
      this.section = height;
      this.requestPaint();
    };
    return html`${sectionSlider(section, onCut)}
    ${readout(section, {
      hovered: this.hovered === null ? null : (this.names[this.hovered] ?? ''),
      mode: this.colorMode(),
      dark: this.dark,
      metres_per_pixel: metresPerPixel(this.orbit, this.size),
    })}
    ${buttons({
      is_flat: this.orbit.projection === 'orthographic',
      layers: this.layers_open ? this.layersState() : null,
      zoom: (direction) => this.zoomBy(ZOOM_STEP ** direction),
      fit: () => this.fit(),
      fromAbove: () => this.fromAbove(),
      toggleProjection: () => this.toggleProjection(),
      toggleLayers: () => {
        this.layers_open = !this.layers_open;
      },
    })}`;
  }

  private layersState(): LayersState {
    const { has_colors, size_factor, voxel_size, shows, marks, reference_name } = this;
    return {
      ...{ mode: this.colorMode(), has_colors, size_factor, voxel_size, shows },
      reference_name: marks.reference.length > 0 ? reference_name : null,
      has_cameras: marks.camera !== null,
      setMode: (mode) => {
        this.mode = mode;
      },
      setSize: (factor) => {
        this.size_factor = factor;
      },
      show: (name, shown) => {
        this.shows = { ...shows, [name]: shown };
      },
    };
  }

  // The scene and its graphics context.

  private async startScene(): Promise<void> {
    const { canvas } = this;
    try {
      const { MapScene } = await import('./scene.js');
      if (!this.isConnected || canvas !== this.canvas) return;
      this.scene?.dispose();
      this.scene = null;
      const scene = new MapScene(canvas);
      canvas.addEventListener('webglcontextlost', () => {
        if (this.scene === scene) this.onLost();
      });
      this.scene = scene;
    } catch {
      this.onFailed();
      return;
    }
    const was_lost = this.graphics !== 'starting';
    this.graphics = 'there';
    this.num_failures = 0;
    this.scene.resize(this.size, pixelRatio());
    this.scene.setPoints(this.points);
    this.passMarks(null);
    this.has_new_points = true;
    if (was_lost) this.emit('graphics-changed', 'restored');
    this.requestPaint();
  }

  private onLost(): void {
    this.scene = null;
    this.graphics = 'lost';
    this.emit('graphics-changed', 'lost');
    this.restore_timer = setTimeout(() => this.restart(), RESTORE_MS[0]);
  }

  private onFailed(): void {
    const wait = RESTORE_MS[++this.num_failures];
    if (this.graphics !== 'starting' && wait !== undefined) {
      this.restore_timer = setTimeout(() => this.restart(), wait);
      return;
    }
    this.graphics = 'unavailable';
    this.emit('graphics-changed', 'unavailable');
    this.requestPaint();
  }

  /** A fresh canvas with a fresh context; the points and paths are passed to it again. */
  private restart(): void {
    this.num_canvases++;
  }

  private passMarks(before: SpatialMarks | null): void {
    const { scene, marks, heights } = this;
    if (!scene) return;
    const depth = this.cameraDepth();
    const is_new = before === null || before.poses !== marks.poses || before.reference !== marks.reference;
    if (is_new) {
      scene.setPaths(marks.poses, marks.reference, marks.camera, depth);
      const shown = [...this.sampled, ...marks.poses.map((pose) => this.toView(positionOf(pose)))];
      if (shown.length > 0) scene.setGround(this.R_view_map, shown, heights.floor, this.straight);
    }
    const pose = marks.selected === null ? null : (marks.poses[marks.selected] ?? null);
    scene.setSelected(pose, marks.camera, 2.4 * depth, this.image);
  }

  private cameraDepth(): number {
    return 0.16;
  }

  // Measures of the map.

  private survey(): void {
    const { points, marks } = this;
    if (points.positions.length === 0) {
      this.sampled = [];
      this.heights = NO_HEIGHTS;
      return;
    }
    this.R_view_map = leveling(points, marks.camera !== null);
    this.sampled = sample(points, this.R_view_map, NUM_SAMPLES);
    const cameras = marks.poses.map((pose) => this.toView(positionOf(pose)));
    this.heights = heightsOf(sample(points, this.R_view_map, 4 * NUM_SAMPLES), cameras);
    // While the map grows, a rough turn will do.
    const open = this.openSamples().filter((_, i) => !this.growing || i % 5 === 0);
    this.straight = straightAzimuth(open, this.size.width >= this.size.height);
  }

  private toView(point: Vec3): Vec3 {
    return transformed(this.R_view_map, point);
  }

  private up(): Vec3 {
    return this.R_view_map[1];
  }

  private cut(): number {
    return this.section ?? this.heights.section;
  }

  private colorMode(): ColorMode {
    return this.mode ?? (this.has_colors ? 'image' : 'height');
  }

  private look(): SceneLook {
    const { heights, marks } = this;
    const section = this.cut();
    const colors = sceneColors(this.dark);
    return {
      mode: this.colorMode(),
      point_size: this.size_factor * this.voxel_size,
      section: section >= heights.top ? 1e9 : section,
      until: marks.until,
      selected: marks.selected ?? -1,
      low: heights.floor,
      high: Math.min(section, heights.top),
      num_frames: marks.poses.length,
      ramp: ramp(this.dark),
      highlight: colors.selected as Rgb,
      colors,
      shows: this.shows,
    };
  }

  // Painting. One picture at most per refresh of the screen, and none when nothing changed.

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.stage;
    this.size = { width, height };
    this.updateGuard();
    if (width === 0 || height === 0) return;
    this.scene?.resize(this.size, pixelRatio());
    if (!this.is_moved) this.fit(true);
    // At once: the canvas is empty now, and an animation frame later the eye would see it so.
    this.paint();
    this.requestUpdate();
  }

  private requestPaint(): void {
    if (this.animation_frame === 0) this.animation_frame = requestAnimationFrame(() => this.paint());
  }

  private paint(): void {
    cancelAnimationFrame(this.animation_frame);
    this.animation_frame = 0;
    if (this.flight) {
      const { from, to, start } = this.flight;
      const t = Math.min((performance.now() - start) / FLIGHT_MS, 1);
      this.orbit = between(from, to, t);
      if (t >= 1) {
        this.flight = null;
        this.requestUpdate();
      }
    }
    if (this.size.width === 0) return;
    this.scene?.render(this.orbit, this.look(), this.up());
    if (this.flight) this.requestPaint();
    // Where nothing can be drawn, whoever waits for the map need not wait for ever.
    if (!this.scene && this.graphics !== 'unavailable') return;
    if (this.has_new_points) {
      this.has_new_points = false;
      this.emit('map-painted', null);
    }
  }

  private updateGuard(): void {
    const page = document.scrollingElement;
    const scrolls = page !== null && page.scrollHeight > page.clientHeight + 1;
    this.guarded = scrolls && this.shadowRoot?.activeElement !== this.stage;
  }

  // Moving about.

  private fly(to: Orbit, at_once: boolean): void {
    if (this.sampled.length === 0) return;
    const is_still = at_once || matchMedia('(prefers-reduced-motion: reduce)').matches || this.orbit === FIRST_VIEW;
    this.flight = is_still ? null : { from: this.orbit, to, start: performance.now() };
    if (is_still) {
      this.orbit = to;
      this.requestUpdate();
    }
    this.requestPaint();
  }

  private move(orbit: Orbit): void {
    this.flight = null;
    this.orbit = orbit;
    this.is_moved = true;
    this.requestUpdate();
  }

  private zoomBy(factor: number): void {
    this.zoom(this.size.width / 2, this.size.height / 2, factor);
  }

  private toggleProjection(): void {
    const projection = this.orbit.projection === 'perspective' ? 'orthographic' : 'perspective';
    this.flight = null;
    this.orbit = { ...this.orbit, projection };
    this.requestUpdate();
    if (!this.is_moved) this.fit(true);
  }

  turn(right: number, down: number): void {
    this.move(orbited(this.orbit, right * TURN_PER_PIXEL, -down * TURN_PER_PIXEL));
  }

  shift(right: number, down: number): void {
    this.move(panned(this.orbit, this.size, right, down));
  }

  zoom(x: number, y: number, factor: number): void {
    this.move(zoomedAt(this.orbit, this.size, x, y, factor));
  }

  twist(angle: number): void {
    this.move(orbited(this.orbit, angle, 0));
  }

  tap(x: number, y: number, reach: number): void {
    this.select(this.frameAt(x, y, reach));
  }

  hover(x: number, y: number): void {
    this.hovered = this.frameAt(x, y, 12);
  }

  leave(): void {
    this.hovered = null;
  }

  isGuarded(): boolean {
    return this.guarded;
  }

  private frameAt(x: number, y: number, reach: number): number | null {
    let best: { frame: number; distance: number } | null = null;
    for (const [frame, pose] of this.marks.poses.slice(0, this.marks.until).entries()) {
      const place = toScreen(this.orbit, this.size, this.toView(positionOf(pose)));
      if (!place) continue;
      const distance = Math.hypot(place.x - x, place.y - y);
      if (distance <= (best?.distance ?? reach)) best = { frame, distance };
    }
    return best?.frame ?? null;
  }

  private onKey(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { selected, poses } = this.marks;
    const step = (right: number, down: number): void =>
      event.shiftKey
        ? this.shift(-right * PAN_STEP, -down * PAN_STEP)
        : this.move(orbited(this.orbit, -right * TURN_STEP, down * TURN_STEP));
    const actions: Record<string, () => void> = {
      ArrowLeft: () => step(-1, 0),
      ArrowRight: () => step(1, 0),
      ArrowUp: () => step(0, -1),
      ArrowDown: () => step(0, 1),
      '+': () => this.zoomBy(ZOOM_STEP),
      '=': () => this.zoomBy(ZOOM_STEP),
      '-': () => this.zoomBy(1 / ZOOM_STEP),
      f: () => this.fit(),
      t: () => this.fromAbove(),
      p: () => this.toggleProjection(),
      '.': () => this.select(Math.min((selected ?? -1) + 1, poses.length - 1)),
      ',': () => this.select(Math.max((selected ?? poses.length) - 1, 0)),
      Escape: () => this.select(null),
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  private select(frame: number | null): void {
    this.emit('frame-selected', frame !== null && frame < 0 ? null : frame);
  }

  private emit(type: string, detail: unknown): void {
    this.dispatchEvent(new CustomEvent(type, { detail, bubbles: true, composed: true }));
  }

  static override styles = [shared, map_styles, map3d_styles];
}

function pixelRatio(): number {
  return Math.min(window.devicePixelRatio || 1, 2);
}

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-map3d': ScanstitchMap3d;
  }
}
