import { html, LitElement, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { map_styles } from '../components/map-styles.js';
import { mapButton } from '../components/map-toolbar.js';
import { shared } from '../components/theme.js';
import { Gestures, type GestureTarget } from '../views/gestures.js';
import { belongsToPage, PAN_STEP, ZOOM_STEP } from '../views/map-keys.js';
import { CanvasPen } from '../views/pen.js';
import {
  bestTurns,
  fitted,
  mapBounds,
  panned,
  type Size,
  toWorld,
  type Viewport,
  zoomedAt,
} from '../views/viewport.js';
import {
  handleOf,
  movedPoints,
  paintGround,
  paintHandle,
  paintStep,
  placer,
  type PlaneScene,
} from './plane-painter.js';
import { acted, centroid, movedBy } from './poses.js';
import type { Pose } from './protocol.js';
import { pressStageKey, type StageKeys } from './stage-keys.js';

const MARGIN = { top: 40, right: 56, bottom: 40, left: 40 };
/** One press of an arrow key moves the source by so many pixels, and with Shift by fewer; a bracket turns it (rad). */
const KEY_PIXELS = 4;
const FINE = 0.125;
const KEY_TURN = Math.PI / 180;

/**
 * The two clouds in the plane on a canvas that pans and zooms; the source is moved where it is taken hold of, and turned by
 * its handle.
 *
 * Fires `source-dragged` with a pose, `source-released`, and `stage-key` with what a key means for the run.
 */
@customElement('scanstitch-lab-plane')
export class ScanstitchLabPlane extends LitElement implements GestureTarget {
  @property({ attribute: false }) scene: PlaneScene | null = null;
  /** Changes with the clouds: the view is fitted anew. */
  @property({ attribute: false }) fit_key: unknown = null;
  @property() description = '';
  /** Whether every drag moves the source: for fingers, which do not hit points. */
  @state() private holds = false;
  @state() private guarded = false;
  @query('canvas') private canvas!: HTMLCanvasElement;
  @query('.stage') private stage!: HTMLElement;

  private view: Viewport = { center_x: 0, center_y: 0, scale: 40, turns: 0 };
  private size: Size = { width: 0, height: 0 };
  private ground = document.createElement('canvas');
  private ground_of: readonly unknown[] = [];
  private frame = 0;
  /** The user has moved the view: it is no longer fitted when its size changes. */
  private is_moved = false;
  private drag: 'view' | 'source' | 'turn' = 'view';
  private grip: [number, number] = [0, 0];
  private gestures = new Gestures(this, this);
  private observer = new ResizeObserver(() => this.resize());

  override connectedCallback(): void {
    super.connectedCallback();
    if (this.hasUpdated) this.observer.observe(this.stage);
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.observer.disconnect();
    cancelAnimationFrame(this.frame);
    this.frame = 0;
  }

  protected override firstUpdated(): void {
    this.gestures.listen(this.stage);
    this.observer.observe(this.stage);
    this.resize();
  }

  protected override updated(changed: PropertyValues<this>): void {
    if (changed.has('fit_key')) this.fit();
    this.requestPaint();
  }

  /** What is on the screen, for pictures. */
  get viewport(): { view: Viewport; size: Size } {
    return { view: this.view, size: this.size };
  }

  fit(): void {
    const { scene, size } = this;
    if (!scene || size.width === 0) return;
    const { facts, pose } = scene;
    const moved = movedPoints(facts.source_points, pose);
    const flat = new Float32Array(((facts.target_points.length + moved.length) / 3) * 2);
    let k = 0;
    for (const points of [facts.target_points, moved]) {
      for (let i = 0; i + 2 < points.length; i += 3) {
        flat[k++] = points[i] ?? 0;
        flat[k++] = points[i + 1] ?? 0;
      }
    }
    const bounds = mapBounds(flat, []);
    if (bounds) this.view = fitted(bounds, size, MARGIN, bestTurns(bounds, size));
    this.is_moved = false;
    this.requestPaint();
  }

  protected override render(): TemplateResult {
    return html`<div
        class="stage"
        tabindex="0"
        role="application"
        aria-roledescription="registration"
        aria-label="The two clouds"
        aria-describedby="description keys"
        ?data-guarded=${this.guarded}
        @keydown=${this.onKey}
        @dblclick=${() => this.fit()}
        @focus=${this.updateGuard}
        @blur=${this.updateGuard}
      >
        <canvas aria-hidden="true"></canvas>
        <p id="description" class="visually-hidden">${this.description}</p>
        <p id="keys" class="visually-hidden">
          Arrow keys move the source, square brackets turn it, Shift makes both fine, Enter runs from there. Full stop
          and comma step on and back, the space bar plays. Plus, minus and F zoom.
        </p>
      </div>
      <div class="controls" role="toolbar" aria-label="View">
        ${mapButton('plus', 'Zoom in', 'Zoom in (+)', () => this.zoomBy(ZOOM_STEP))}
        ${mapButton('minus', 'Zoom out', 'Zoom out (−)', () => this.zoomBy(1 / ZOOM_STEP))}
        ${mapButton('fit', 'Show both clouds', 'Show both clouds (F)', () => this.fit())}
        ${mapButton(
          'hand',
          'Drag the source',
          'Every drag moves the source; two fingers turn it',
          () => {
            this.holds = !this.holds;
          },
          { pressed: this.holds },
        )}
      </div> `;
  }

  private updateGuard(): void {
    this.guarded = belongsToPage(this.stage);
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.stage;
    const was_empty = this.size.width === 0;
    this.size = { width, height };
    this.updateGuard();
    if (was_empty || !this.is_moved) this.fit();
    cancelAnimationFrame(this.frame);
    this.paint();
  }

  private requestPaint(): void {
    if (this.frame === 0) this.frame = requestAnimationFrame(() => this.paint());
  }

  private paint(): void {
    this.frame = 0;
    const { scene, size, view } = this;
    if (!scene || size.width === 0 || size.height === 0) return;
    const ratio = Math.min(devicePixelRatio || 1, 3);
    // The target stays while the source moves: it is drawn once for every view.
    const ground_of = [scene.facts, scene.dark, view, size.width, size.height, ratio];
    if (ground_of.some((part, i) => part !== this.ground_of[i])) {
      this.ground_of = ground_of;
      paintGround(penOn(this.ground, size, ratio), size, view, scene);
    }
    const pen = penOn(this.canvas, size, ratio, this.ground);
    paintStep(pen, size, view, scene);
    paintHandle(pen, scene.facts, scene.pose, view, size, scene.dark);
  }

  // Moving the source, or the view.

  press(x: number, y: number, reach: number): void {
    this.drag = 'view';
    const { scene, view, size } = this;
    if (!scene) return;
    const { pivot, grip } = handleOf(scene.facts, scene.pose, view, size);
    this.grip = [x, y];
    if (Math.hypot(x - grip[0], y - grip[1]) <= reach + 4) this.drag = 'turn';
    else if (this.holds || Math.hypot(x - pivot[0], y - pivot[1]) <= reach || this.isOnSource(x, y, 0.6 * reach)) {
      this.drag = 'source';
    }
  }

  shift(right: number, down: number): void {
    const { scene, view } = this;
    if (this.drag === 'view' || !scene) this.move(panned(view, right, down));
    else if (this.drag === 'source') this.shiftSource(right, down);
    else {
      const { pivot } = handleOf(scene.facts, scene.pose, view, this.size);
      const angle = ([x, y]: readonly [number, number]): number => Math.atan2(pivot[1] - y, x - pivot[0]);
      const before = angle(this.grip);
      this.grip = [this.grip[0] + right, this.grip[1] + down];
      this.turnSource(angle(this.grip) - before);
    }
  }

  release(): void {
    if (this.drag !== 'view') this.tell('source-released', null);
    this.drag = 'view';
  }

  zoom(x: number, y: number, factor: number): void {
    if (this.drag === 'view') this.move(zoomedAt(this.view, this.size, x, y, factor));
  }

  twist(angle: number): void {
    if (this.drag !== 'view') this.turnSource(-angle);
  }

  tap(): void {
    this.stage.focus();
  }

  hover(x: number, y: number): void {
    const { scene, view, size } = this;
    if (!scene) return;
    const { grip } = handleOf(scene.facts, scene.pose, view, size);
    const is_grip = Math.hypot(x - grip[0], y - grip[1]) <= 14;
    this.stage.style.cursor = is_grip ? 'alias' : this.holds || this.isOnSource(x, y, 7) ? 'move' : '';
  }

  leave(): void {
    this.stage.style.cursor = '';
  }

  isGuarded(): boolean {
    return this.guarded;
  }

  private move(view: Viewport): void {
    this.view = view;
    this.is_moved = true;
    this.requestPaint();
  }

  private zoomBy(factor: number): void {
    this.move(zoomedAt(this.view, this.size, this.size.width / 2, this.size.height / 2, factor));
  }

  private shiftSource(right: number, down: number): void {
    const { scene } = this;
    if (!scene) return;
    const [from, to] = [this.worldAt(0, 0), this.worldAt(right, down)];
    this.tell('source-dragged', movedBy(scene.pose, [0, 0, 0], [0, 0, 0], [to.x - from.x, to.y - from.y, 0]));
  }

  private turnSource(angle: number): void {
    const { scene } = this;
    if (!scene) return;
    const pivot = acted(scene.pose, ...centroid(scene.facts.source_points));
    this.tell(
      'source-dragged',
      movedBy(scene.pose, [0, 0, Math.atan2(Math.sin(angle), Math.cos(angle))], pivot, [0, 0, 0]),
    );
  }

  private isOnSource(x: number, y: number, reach: number): boolean {
    const { scene, view, size } = this;
    if (!scene) return false;
    const place = placer(view, size);
    const moved = movedPoints(scene.facts.source_points, scene.pose);
    for (let i = 0; i + 2 < moved.length; i += 3) {
      const [px, py] = place(moved[i] ?? 0, moved[i + 1] ?? 0);
      if (Math.hypot(px - x, py - y) <= reach) return true;
    }
    return false;
  }

  private onKey(event: KeyboardEvent): void {
    const fine = event.shiftKey ? FINE : 1;
    const own: StageKeys = {
      shift: (right, down) => this.shiftSource(right * KEY_PIXELS * fine, down * KEY_PIXELS * fine),
      turn: (direction) => this.turnSource(direction * KEY_TURN * fine),
      zoom: (direction) => this.zoomBy(ZOOM_STEP ** direction),
      fit: () => this.fit(),
      pan: (right, down) => this.move(panned(this.view, -right * PAN_STEP, -down * PAN_STEP)),
      tell: (what) => this.tell('stage-key', what),
    };
    pressStageKey(event, own);
  }

  private worldAt(x: number, y: number): { x: number; y: number } {
    return toWorld(this.view, this.size, x, y);
  }

  private tell(name: string, detail: Pose | string | null): void {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  static override styles = [shared, map_styles];
}

/** A pen on a canvas of this size, which begins with the pixels of another one, or empty. */
export function penOn(canvas: HTMLCanvasElement, size: Size, ratio: number, ground?: HTMLCanvasElement): CanvasPen {
  const [width, height] = [Math.round(size.width * ratio), Math.round(size.height * ratio)];
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  const context = canvas.getContext('2d');
  if (!context) throw new Error('This browser draws no canvas.');
  context.setTransform(1, 0, 0, 1, 0, 0);
  if (ground && ground.width > 0) context.drawImage(ground, 0, 0);
  else context.clearRect(0, 0, width, height);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return new CanvasPen(context);
}

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-lab-plane': ScanstitchLabPlane;
  }
}
