import type { PropertyValues, TemplateResult } from 'lit';
import { customElement, property, state } from 'lit/decorators.js';
import { mapStyles } from '../drawing/map-styles.js';
import { FlatMap } from '../drawing/flat-map.js';
import { layerBox, layerList } from '../drawing/map-toolbar.js';
import { shared } from '../components/theme.js';
import { context2d } from '../views/canvas.js';
import { memoizeLast } from '../views/memoize-last.js';
import { fitted, type Turns } from '../views/viewport.js';
import { fieldLevels, mapLevels } from './map-levels.js';
import { type LocatedScene, paintScene, type SceneLayers } from './paint.js';
import type { GridPicture, ScanDetails } from './protocol.js';
import { locatedMapStyles } from './styles.js';
import { boundsOf, scanAt, type Track } from './track.js';
import { fire } from '../components/fire.js';

/** Room around the map: for the buttons to its right, and the scale bar. */
const MARGIN = { top: 20, right: 56, bottom: 44, left: 20 };
const LAYERS: Record<keyof SceneLayers, string> = {
  field: 'Likelihood of a return',
  particles: 'Particles',
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
export class ScanstitchLocatedMap extends FlatMap {
  @property({ attribute: false }) grid: GridPicture | null = null;
  @property({ attribute: false }) track: Track | null = null;
  @property({ attribute: false }) selected = 0;
  @property({ attribute: false }) details: ScanDetails | null = null;
  /** x, y, theta and weight of each particle, where there are any. */
  @property({ attribute: false }) particles: Float32Array | null = null;
  /** Of the cells, 0 to 255, where they are known. */
  @property({ attribute: false }) likelihoods: Uint8Array | null = null;

  @state() private layers: SceneLayers = {
    field: false,
    particles: true,
    trajectory: true,
    returns: true,
    places: true,
  };

  private levelsOf = memoizeLast(mapLevels);
  private fieldLevelsOf = memoizeLast(fieldLevels);
  private knownOf = memoizeLast(boundsOf);

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

  protected override renderLayers(): TemplateResult {
    return layerList(
      (Object.keys(LAYERS) as (keyof SceneLayers)[])
        .filter((name) => this.likelihoods || (name !== 'field' && name !== 'particles'))
        .map((name) =>
          layerBox(LAYERS[name], name, this.layers[name], (isShown) => {
            this.layers = { ...this.layers, [name]: isShown };
          }),
        ),
    );
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
    const { grid, track, selected, details, particles, likelihoods, layers, dark } = this;
    const hasField = layers.field && likelihoods?.length === (grid?.width ?? 0) * (grid?.height ?? 0);
    const levels = grid && (hasField ? this.fieldLevelsOf(grid, likelihoods, dark) : this.levelsOf(grid, dark));
    return { map: levels, track, selected, details, particles, layers, dark };
  }

  protected override turnTo(turns: Turns): void {
    this.view = { ...this.view, turns };
    this.fit();
  }

  tap(x: number, y: number, reach: number): void {
    if (!this.track) return;
    const world = this.toWorld(x, y);
    const scan = scanAt(this.track, world.x, world.y, reach / this.view.scale);
    if (scan !== null) this.select(scan);
  }

  select(scan: number | null): void {
    fire(this, 'scan-selected', scan);
  }

  static override styles = [shared, mapStyles, locatedMapStyles];
}
