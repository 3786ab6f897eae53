import { LitElement, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { type DrawingHost, DrawingSurface } from '../components/drawing-surface.js';
import { mapStyles } from '../components/map-styles.js';
import { flatMap } from '../components/flat-map.js';
import { layerBox, layerList } from '../components/map-toolbar.js';
import { shared } from '../components/theme.js';
import { context2d } from '../views/canvas.js';
import { type KeyedMap, PAN_STEP, pressKey } from '../views/map-keys.js';
import { memoizeLast } from '../views/memoize-last.js';
import { fitted, panned, toWorld, type Turns, type Viewport, zoomedAt } from '../views/viewport.js';
import { mapLevels } from './map-levels.js';
import { type LocatedScene, paintScene, type SceneLayers } from './paint.js';
import type { GridPicture, ScanDetails } from './protocol.js';
import { locatedMapStyles } from './styles.js';
import { boundsOf, scanAt, type Track } from './track.js';

/** Room around the map: for the buttons to its right, and the scale bar. */
const MARGIN = { top: 20, right: 56, bottom: 44, left: 20 };
const LAYERS: Record<keyof SceneLayers, string> = {
  trajectory: 'Trajectory',
  places: 'Places of the scan',
  returns: 'Returns of the scan',
};

/**
 * The map, the way through it and the places of the selected scan, on a canvas that pans and zooms.
 *
 * Fires `scan-selected` with the number of a scan, or null for the last one.
 */
@customElement('scanstitch-located-map')
export class ScanstitchLocatedMap extends LitElement implements DrawingHost, KeyedMap {
  @property({ attribute: false }) grid: GridPicture | null = null;
  @property({ attribute: false }) track: Track | null = null;
  @property({ attribute: false }) selected = 0;
  @property({ attribute: false }) details: ScanDetails | null = null;
  @property({ attribute: false }) description = '';
  @property({ type: Boolean }) dark = false;

  @state() private layers: SceneLayers = { trajectory: true, returns: true, places: true };
  @state() private layersOpen = false;
  @state() private pointer: { x: number; y: number } | null = null;
  @query('canvas') private canvas!: HTMLCanvasElement;
  @query('.stage') readonly stage!: HTMLElement;

  private view: Viewport = { centerX: 0, centerY: 0, scale: 20, turns: 0 };
  /** The user has moved the view: it is no longer fitted. */
  private isMoved = false;
  private surface = new DrawingSurface(this);
  private levelsOf = memoizeLast(mapLevels);
  private knownOf = memoizeLast(boundsOf);

  protected override firstUpdated(): void {
    this.surface.begin();
  }

  protected override updated(changed: PropertyValues<this>): void {
    if (changed.has('grid')) {
      this.view = { ...this.view, turns: 0 };
      this.fit();
    }
    this.surface.requestPaint();
  }

  /** For the keys that select. */
  get marks(): { selected: number | null; poses: readonly unknown[] } {
    return { selected: this.track ? this.selected : null, poses: this.track?.statuses ?? [] };
  }

  protected override render(): TemplateResult {
    return flatMap({
      description: this.description,
      world: this.pointer && toWorld(this.view, this.surface.size, this.pointer.x, this.pointer.y),
      zoomBy: (factor) => this.zoomBy(factor),
      fit: () => this.fit(),
      turnByQuarter: () => this.turnByQuarter(),
      onKey: (event) => this.onKey(event),
      layers: this.layersOpen
        ? layerList(
            (Object.keys(LAYERS) as (keyof SceneLayers)[]).map((name) =>
              layerBox(LAYERS[name], name, this.layers[name], (isShown) => {
                this.layers = { ...this.layers, [name]: isShown };
              }),
            ),
          )
        : null,
      toggleLayers: () => {
        this.layersOpen = !this.layersOpen;
      },
    });
  }

  fit(): void {
    const { size } = this.surface;
    if (this.grid && size.width > 0) this.view = fitted(this.knownOf(this.grid), size, MARGIN, this.view.turns);
    this.isMoved = false;
    this.surface.requestPaint();
  }

  resized(): void {
    const { size, pixelRatio } = this.surface;
    this.canvas.width = Math.max(Math.round(size.width * pixelRatio), 1);
    this.canvas.height = Math.max(Math.round(size.height * pixelRatio), 1);
    if (!this.isMoved) this.fit();
  }

  paint(): void {
    paintScene(context2d(this.canvas), this.surface.size, this.surface.pixelRatio, this.view, this.scene());
  }

  private scene(): LocatedScene {
    const { grid, track, selected, details, layers, dark } = this;
    return { map: grid && this.levelsOf(grid, dark), track, selected, details, layers, dark };
  }

  // Moving about.

  private move(view: Viewport): void {
    this.view = view;
    this.isMoved = true;
    this.surface.requestPaint();
  }

  private turnByQuarter(): void {
    this.view = { ...this.view, turns: ((this.view.turns + 1) % 4) as Turns };
    this.fit();
  }

  private onKey(event: KeyboardEvent): void {
    pressKey(event, this, {
      ArrowLeft: () => this.shift(PAN_STEP, 0),
      ArrowRight: () => this.shift(-PAN_STEP, 0),
      ArrowUp: () => this.shift(0, PAN_STEP),
      ArrowDown: () => this.shift(0, -PAN_STEP),
      r: () => this.turnByQuarter(),
    });
  }

  zoomBy(factor: number): void {
    this.surface.zoomBy(factor);
  }

  shift(right: number, down: number): void {
    this.move(panned(this.view, right, down));
  }

  zoom(x: number, y: number, factor: number): void {
    this.move(zoomedAt(this.view, this.surface.size, x, y, factor));
  }

  tap(x: number, y: number, reach: number): void {
    if (!this.track) return;
    const world = toWorld(this.view, this.surface.size, x, y);
    const scan = scanAt(this.track, world.x, world.y, reach / this.view.scale);
    if (scan !== null) this.select(scan);
  }

  hover(x: number, y: number): void {
    this.pointer = { x, y };
  }

  leave(): void {
    this.pointer = null;
  }

  select(scan: number | null): void {
    this.dispatchEvent(new CustomEvent('scan-selected', { detail: scan, bubbles: true }));
  }

  static override styles = [shared, mapStyles, locatedMapStyles];
}
