import { css, html, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, state } from 'lit/decorators.js';
import { baseName } from '../views/format.js';
import { context2d, pngOf } from '../views/canvas.js';
import { MapCanvas, type MapContent } from '../views/map-canvas.js';
import type { MapExtra, MapLayer } from '../views/map-layer.js';
import type { BeforeMap, Layers, MapMarks } from '../views/map-painter.js';
import { poseAt } from '../views/path-painter.js';
import { mapBounds } from '../views/map-bounds.js';
import type { Piece } from '../views/pieces.js';
import type { Rgb } from '../views/palette.js';
import type { OccupancyPicture } from '../views/occupancy.js';
import { NO_POINTS, nearestFrame, type PointSet } from '../views/point-layer.js';
import { type Bounds, bestTurns, fitted, panned, type Turns, united, type Viewport } from '../views/viewport.js';
import { mapStyles } from './map-styles.js';
import { FlatMap } from './flat-map.js';
import { layerBox, layerList, mapButton } from './map-toolbar.js';
import { shared } from '../components/theme.js';
import { fire } from '../components/fire.js';

const NO_MARKS: MapMarks = {
  poses: [],
  statuses: [],
  uncertainLinks: [],
  lookDirection: 0,
  until: 0,
  selected: null,
  hovered: null,
  reference: [],
  pairs: null,
  undetermined: null,
};

/** Narrower than this (CSS pixels), the map has no room beside it. */
const SMALL_WIDTH = 640;
/** The map is in motion until the hand has rested for so long. */
const REST_MS = 90;
/** A map that has rested for so long is not growing: the slider may be next. */
const IDLE_MS = 500;

/**
 * The map: points, paths and poses on a canvas that pans and zooms.
 *
 * Fires `frame-selected` with a frame number or null, `map-painted` when a new set of points is on the screen, and
 * `occupancy-wanted` with whether the occupancy grid is to be shown, `mending-wanted` where it is to be mended.
 */
@customElement('scanstitch-map')
export class ScanstitchMap extends FlatMap {
  @property({ attribute: false }) points: PointSet = NO_POINTS;
  @property({ attribute: false }) marks: MapMarks = NO_MARKS;
  @property({ attribute: false }) names: readonly string[] = [];
  /** One for each frame, or more. */
  @property({ attribute: false }) colors: readonly Rgb[] = [];
  /** The certain pieces, where there are several. */
  @property({ attribute: false }) pieces: readonly Piece[] = [];
  /** The map that this one replaces, to be compared with it. */
  @property({ attribute: false }) map_before: BeforeMap | null = null;
  @property({ attribute: false }) referenceName = '';
  /** Whether there is a grid to ask for; and the grid, once it has come. */
  @property({ type: Boolean }) hasOccupancy = false;
  @property({ attribute: false }) occupancy: OccupancyPicture | null = null;
  /** Changes with the data set, so that the view is fitted again. */
  @property({ attribute: false }) fitKey: unknown = null;
  /** What lies over it and takes gestures first; null: nothing. */
  @property({ attribute: false }) layer: MapLayer | null = null;
  /** What else is drawn. */
  @property({ attribute: false }) extras: readonly MapExtra[] = [];
  /** Whether the map can be mended. */
  @property({ type: Boolean }) canMend = false;
  /** Without the buttons on it. */
  @property({ type: Boolean, reflect: true }) bare = false;

  @state() private layers: Layers = { grid: true, occupancy: false, path: true, reference: true };
  /** Labels of what else could be drawn. */
  @state() private switchedOff: readonly string[] = [];
  @state() private hovered: number | null = null;

  /** First frame of the only piece that is shown; null: all are. */
  @state() private only: number | null = null;
  /** How the user has turned the map; null: as it is best laid. */
  private turns: Turns | null = null;
  private mapCanvas: MapCanvas | null = null;
  private lastMotion = Number.NEGATIVE_INFINITY;
  private lastPainted = 0;
  private restTimer: ReturnType<typeof setTimeout> | undefined;
  private hasNewPoints = false;

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    clearTimeout(this.restTimer);
  }

  protected override firstUpdated(): void {
    this.mapCanvas = new MapCanvas(this.canvas);
    super.firstUpdated();
  }

  protected override willUpdate(changed: PropertyValues<this>): void {
    if (changed.has('fitKey')) {
      this.isMoved = false;
      this.turns = null;
      this.only = null;
    }
    if (changed.has('pieces') || changed.has('map_before')) this.mapCanvas?.invalidate();
  }

  /** The piece that alone is shown; null where all are. */
  private get shownPiece(): Piece | null {
    return this.pieces.find(({ frames }) => frames[0] === this.only) ?? null;
  }

  protected override updated(changed: PropertyValues<this>): void {
    if (changed.has('points') || changed.has('fitKey')) {
      if (changed.has('points')) this.hasNewPoints = true;
      if (!this.isMoved) this.fit();
    }
    const previous = changed.get('marks');
    const isSlid = changed.has('marks') && previous?.until !== this.marks.until;
    if (isSlid && !changed.has('points')) this.lastMotion = performance.now();
    if (changed.has('points') || changed.has('dark') || changed.has('colors')) this.mapCanvas?.invalidate();
    else if (isSlid || (changed.has('marks') && previous?.selected !== this.marks.selected)) this.mapCanvas?.slide();
    this.requestPaint();
  }

  /** Shows the whole map. */
  fit(): void {
    this.isMoved = false;
    this.fitTo(this.bounds());
  }

  /** Shows this piece alone, or all of the map again. */
  private showPiece(piece: Piece | null): void {
    this.only = piece?.frames[0] ?? null;
    this.mapCanvas?.invalidate();
    if (!piece) return this.fit();
    this.fitTo(mapBounds(this.points, this.marks.poses, [], piece.frames));
    this.isMoved = true;
  }

  private fitTo(bounds: Bounds | null): void {
    const { size } = this.surface;
    if (bounds && size.width > 0) {
      const isSmall = size.width < SMALL_WIDTH;
      const margin = isSmall
        ? { top: 24, right: 24, bottom: 44, left: 24 }
        : { top: 36, right: 64, bottom: 52, left: 36 };
      this.view = fitted(bounds, size, margin, this.turns ?? bestTurns(bounds, size));
    }
    this.requestPaint();
  }

  /** How the map lies on the screen. */
  get turned(): Turns {
    return this.view.turns;
  }

  protected override turnTo(turns: Turns): void {
    this.turns = turns;
    this.fit();
  }

  /** The map as a picture, at twice the resolution of the screen or better. */
  async picture(): Promise<Blob> {
    const print = new MapCanvas();
    print.resize(this.surface.size, Math.max(2, this.surface.pixelRatio));
    print.paint(this.content(), this.view, false);
    return pngOf(print.canvas);
  }

  protected override renderReadout(): unknown {
    const { hovered } = this;
    if (hovered === null) return nothing;
    const name = baseName(this.names[hovered] ?? `scan ${hovered}`);
    return html`<span class="frame"><i style="background: rgb(${this.colors[hovered]?.join(' ')})"></i>${name}</span>`;
  }

  protected override renderOwn(): unknown {
    const state = { pressed: this.layer !== null };
    return this.canMend
      ? mapButton('loops', 'Mend the map', 'Mend and measure the map (M)', this.mend, state)
      : nothing;
  }

  protected override get ownKeys(): Record<string, () => void> {
    return { ...(this.canMend && { m: this.mend }), ...this.layer?.keys };
  }

  private mend = (): void => fire(this, 'mending-wanted');

  protected override renderAfter(): unknown {
    const numUncertain = this.marks.uncertainLinks.filter(Boolean).length;
    const legends = this.shownExtras.flatMap(({ legend }) => legend ?? []);
    if (this.pieces.length + numUncertain === 0)
      return legends.length > 0 ? html`<div class="legend">${legends}</div>` : nothing;
    import('./map-legend.js').catch(() => undefined); // the map is the same without it
    return html`<div class="legend">
      ${legends}<scanstitch-map-legend
        .pieces=${this.pieces}
        .shown=${this.shownPiece}
        .numUncertain=${numUncertain}
        .num_lost=${this.marks.statuses.filter((status) => status === 'lost').length}
        ?compact=${this.surface.size.width < SMALL_WIDTH}
        @piece-wanted=${({ detail }: CustomEvent<Piece | null>) => this.showPiece(detail)}
      ></scanstitch-map-legend>
    </div>`;
  }

  private get shownExtras(): readonly MapExtra[] {
    return this.extras.filter(({ label }) => !this.switchedOff.includes(label));
  }

  private showExtra(label: string, shown: boolean): void {
    this.switchedOff = shown ? this.switchedOff.filter((other) => other !== label) : [...this.switchedOff, label];
  }

  protected override renderLayers(): TemplateResult {
    const layer = (name: keyof Layers, label: string): TemplateResult =>
      layerBox(label, name, this.layers[name], (shown) => this.showLayer(name, shown));
    return layerList(html`
      ${layer('path', 'Path and poses')}
      ${this.marks.reference.length > 0 ? layer('reference', `Ground truth: ${baseName(this.referenceName)}`) : nothing}
      ${this.hasOccupancy ? layer('occupancy', 'Occupancy in place of points') : nothing} ${layer('grid', 'Grid')}
      ${this.extras.map(({ label, sign }) => layerBox(label, sign, !this.switchedOff.includes(label), (shown) => this.showExtra(label, shown)))}
    `);
  }

  private showLayer(name: keyof Layers, shown: boolean): void {
    this.layers = { ...this.layers, [name]: shown };
    if (name === 'occupancy') fire(this, 'occupancy-wanted', shown);
    this.requestPaint();
  }

  private bounds(): Bounds | null {
    const { map_before: before } = this;
    const bounds = mapBounds(this.points, this.marks.poses, this.marks.reference);
    return united(bounds, before && mapBounds(before.points, before.poses));
  }

  resized(): void {
    this.mapCanvas?.resize(this.surface.size, this.surface.pixelRatio);
    if (!this.isMoved) this.fit();
  }

  private requestPaint(): void {
    this.surface.requestPaint();
  }

  paint(): void {
    const now = performance.now();
    const isInMotion = this.lastMotion > this.lastPainted || now - this.lastMotion < REST_MS;
    this.lastPainted = now;
    const isExact = this.mapCanvas?.paint(this.content(), this.view, isInMotion) ?? true;
    this.layer?.paint(context2d(this.canvas), this.surface.size, this.view, this.dark);
    clearTimeout(this.restTimer);
    const prepare = (): void => this.mapCanvas?.prepare(this.content(), this.view);
    this.restTimer = isExact ? setTimeout(prepare, IDLE_MS) : setTimeout(() => this.requestPaint(), REST_MS + 10);
    if (this.hasNewPoints) {
      this.hasNewPoints = false;
      fire(this, 'map-painted');
    }
  }

  private content(): MapContent {
    const { points, colors, occupancy, dark } = this;
    const layers = { ...this.layers, occupancy: this.layers.occupancy || this.layer?.showsGrid === true };
    return {
      points,
      colors,
      layers,
      occupancy,
      extras: this.shownExtras,
      dark,
      before: this.map_before,
      only: this.shownPiece?.frames ?? null,
      marks: { ...this.marks, hovered: this.hovered ?? this.marks.hovered },
    };
  }

  // Moving about.

  protected override move(view: Viewport): void {
    this.lastMotion = performance.now();
    super.move(view);
  }

  override shift(right: number, down: number): void {
    const { view } = this;
    const moved = panned(view, right, down);
    if (!this.layer?.drag?.(view.centerX - moved.centerX, view.centerY - moved.centerY)) this.move(moved);
  }

  press(x: number, y: number, reach: number): void {
    const at = this.toWorld(x, y);
    this.layer?.press?.(at.x, at.y, reach / this.view.scale);
  }

  release(): void {
    this.layer?.release?.();
  }

  override zoom(x: number, y: number, factor: number): void {
    this.layer?.cancel?.();
    super.zoom(x, y, factor);
  }

  tap(x: number, y: number, reach: number): void {
    if (!this.layer?.tap(x, y, reach, this.surface.size, this.view)) this.select(this.frameAt(x, y, reach));
  }

  override hover(x: number, y: number): void {
    super.hover(x, y);
    this.hovered = this.frameAt(x, y, 12);
  }

  override leave(): void {
    super.leave();
    this.hovered = null;
  }

  /** The frame whose pose, or else whose point, lies under a place on the screen. */
  private frameAt(x: number, y: number, reach: number): number | null {
    const pose = this.layers.path ? poseAt(this.marks, this.surface.size, this.view, x, y, reach) : null;
    if (pose !== null) return pose;
    const world = this.toWorld(x, y);
    return nearestFrame(this.points, this.marks.until, world.x, world.y, (reach - 2) / this.view.scale);
  }

  select(frame: number | null): void {
    fire(this, 'frame-selected', frame);
  }

  static override styles = [
    shared,
    mapStyles,
    css`
      .readout .frame {
        display: inline-flex;
        align-items: center;
        gap: 5px;
        color: var(--text);
      }
      .readout i {
        width: 9px;
        height: 9px;
        border-radius: 50%;
      }
      .legend {
        grid-area: legend;
        max-height: 30cqh;
        overflow: auto;
      }
      .changes {
        padding: 5px 12px;
        border-top: 1px solid var(--line);
        background: var(--surface);
        font-size: calc(12.5 * var(--px));
        list-style: none;
      }
      .changes :is(li, span) {
        display: flex;
        flex-wrap: wrap;
        align-items: center;
        gap: 0 6px;
      }
      .changes li {
        column-gap: 14px;
      }
      .sign.plan {
        height: 12px;
        border: 1px dashed var(--muted);
      }
      .sign.moved {
        width: 10px;
        height: 10px;
        margin-inline: 6px;
        border: 2px solid light-dark(#c24e00, #ffa94d);
      }
      .sign.reference {
        border-top: 2px dashed light-dark(#b4530a, #ffad5c);
      }
    `,
  ];
}
