import { html, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { mapStyles } from '../drawing/map-styles.js';
import { shared } from '../components/theme.js';
import { mapBounds } from '../views/map-bounds.js';
import { penOn } from '../views/pen.js';
import {
  bestTurns,
  fitted,
  panned,
  type Size,
  toWorld,
  type Turns,
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
import { LabStage } from './stage.js';

const MARGIN = { top: 40, right: 56, bottom: 40, left: 40 };
/** The two clouds in the plane on a canvas; the source is moved where it is taken hold of, and turned by its handle. */
@customElement('scanstitch-lab-plane')
export class ScanstitchLabPlane extends LabStage {
  /** By how many quarter turns the target is drawn turned; null: as it is best laid. */
  @property({ attribute: false }) turns: Turns | null = null;
  private view: Viewport = { centerX: 0, centerY: 0, scale: 40, turns: 0 };
  private ground = document.createElement('canvas');
  private groundOf: readonly unknown[] = [];
  /** The user has moved the view: it is no longer fitted when its size changes. */
  private isMoved = false;
  private drag: 'view' | 'source' | 'turn' = 'view';
  private grip: [number, number] = [0, 0];

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
    // Ranges are those from the middles, as a cloud need not be one of a scanner at its origin.
    const middles = [centroid(facts.target_points), acted(pose, ...centroid(facts.source_points))];
    const offsets = Uint32Array.of(0, facts.target_points.length / 3, flat.length / 2);
    const bounds = mapBounds(
      { points: flat, offsets },
      middles.map(([x, y]) => ({ x, y })),
    );
    if (bounds) this.view = fitted(bounds, size, MARGIN, this.turns ?? bestTurns(bounds, size));
    this.isMoved = false;
    this.surface.requestPaint();
  }

  protected override render(): TemplateResult {
    return this.renderStage(
      html`<canvas aria-hidden="true"></canvas>`,
      'Arrow keys move the source, square brackets turn it, Shift makes both fine, Enter runs from there. Full stop and comma step on and back, the space bar plays. Plus, minus and F zoom.',
      'Every drag moves the source; two fingers turn it',
      null,
    );
  }

  override resized(wasEmpty: boolean): void {
    if (wasEmpty || !this.isMoved) this.fit();
  }

  protected override draw(scene: PlaneScene): void {
    const { size, view } = this;
    const ratio = this.surface.pixelRatio;
    // The target stays while the source moves: it is drawn once for every view.
    const groundOf = [scene.facts, scene.dark, view, size.width, size.height, ratio];
    if (groundOf.some((part, i) => part !== this.groundOf[i])) {
      this.groundOf = groundOf;
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

  hover(x: number, y: number): void {
    const { scene, view, size } = this;
    if (!scene) return;
    const { grip } = handleOf(scene.facts, scene.pose, view, size);
    const isGrip = Math.hypot(x - grip[0], y - grip[1]) <= 14;
    this.stage.style.cursor = isGrip ? 'alias' : this.holds || this.isOnSource(x, y, 7) ? 'move' : '';
  }

  private move(view: Viewport): void {
    this.view = view;
    this.isMoved = true;
    this.surface.requestPaint();
  }

  protected override panBy(right: number, down: number): void {
    this.move(panned(this.view, right, down));
  }

  protected override shiftSource(right: number, down: number): void {
    const { scene } = this;
    if (!scene) return;
    const [from, to] = [this.worldAt(0, 0), this.worldAt(right, down)];
    this.tell('source-dragged', movedBy(scene.pose, [0, 0, 0], [0, 0, 0], [to.x - from.x, to.y - from.y, 0]));
  }

  protected override turnSource(angle: number): void {
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

  private worldAt(x: number, y: number): { x: number; y: number } {
    return toWorld(this.view, this.size, x, y);
  }

  static override styles = [shared, mapStyles];
}
