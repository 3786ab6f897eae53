import { css, html, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { keyed } from 'lit/directives/keyed.js';
import { Graphics, type GraphicsUser } from '../drawing/graphics.js';
import { mapStyles } from '../drawing/map-styles.js';
import { mapButton } from '../drawing/map-toolbar.js';
import { shared } from '../components/theme.js';
import { pngOf } from '../views/canvas.js';
import { axes, fitted, metresPerPixel, type Orbit, orbited, panned, zoomedAt } from '../views/orbit.js';
import type { Rgb } from '../views/palette.js';
import { dot, type Mat3, type Vec3 } from '../views/vectors.js';
import type { PlaneScene } from './plane-painter.js';
import { acted, centroid, movedBy } from './poses.js';
import type { SpaceScene } from './space-scene.js';
import { directionVertices, pairVertices, rejectedVertices, sourceVertices, targetVertices } from './space-vertices.js';
import { LabStage } from './stage.js';

/** Which way is up in the clouds. */
export type Up = 'z' | 'camera';

/** Rows: what is right, up and back in the picture. */
const VIEWS: Record<Up, Mat3> = {
  z: [
    [0, -1, 0],
    [0, 0, 1],
    [-1, 0, 0],
  ],
  camera: [
    [1, 0, 0],
    [0, -1, 0],
    [0, 0, -1],
  ],
};
const FIRST_ORBIT: Orbit = { target: [0, 0, 0], azimuth: 0.5, elevation: 0.6, distance: 10, projection: 'perspective' };
const BACKGROUND: Record<'light' | 'dark', Rgb> = { light: [252, 253, 254], dark: [11, 15, 20] };
const TURN_PER_PIXEL = 0.008;

/**
 * The two clouds in space. A drag orbits; with the source taken hold of, it moves the source in the plane of the screen, and
 * turns it about the line of sight with two fingers or Shift. The view stays centred on
 * the middle of the two clouds until the user moves it.
 */
@customElement('scanstitch-lab-space')
export class ScanstitchLabSpace extends LabStage implements GraphicsUser<SpaceScene> {
  @property() up: Up = 'z';
  private graphics = new Graphics(this, this);
  private orbit = FIRST_ORBIT;
  private reach = 50;
  /** Middle of the source in the last picture, for the camera to follow; null once the user has moved the camera. */
  private followed: Vec3 | null = null;
  private isTwisting = false;
  private drawn: { clouds: unknown; pairs: unknown; facts: unknown } = { clouds: null, pairs: null, facts: null };

  protected override updated(changed: PropertyValues<this>): void {
    if (changed.has('up')) this.fit();
    super.updated(changed);
  }

  async loadScene(): Promise<typeof SpaceScene> {
    return (await import('./space-scene.js')).SpaceScene;
  }

  onScene(scene: SpaceScene): void {
    this.drawn = { clouds: null, pairs: null, facts: null };
    scene.resize(this.size, this.surface.pixelRatio);
    this.surface.paintNow();
  }

  fit(): void {
    const { scene, size } = this;
    if (!scene || size.width === 0) return;
    const { facts, pose } = scene;
    const points: Vec3[] = [];
    const stride = 3 * Math.max(1, Math.floor(facts.target_points.length / 9000));
    for (let i = 0; i + 2 < facts.target_points.length; i += stride) {
      points.push(
        this.inView([facts.target_points[i] ?? 0, facts.target_points[i + 1] ?? 0, facts.target_points[i + 2] ?? 0]),
      );
    }
    for (let i = 0; i + 2 < facts.source_points.length; i += stride) {
      points.push(
        this.inView(
          acted(pose, facts.source_points[i] ?? 0, facts.source_points[i + 1] ?? 0, facts.source_points[i + 2] ?? 0),
        ),
      );
    }
    this.orbit = fitted(this.orbit, points, size, { across: 30, along: 30 });
    this.followed = this.sourceMiddle(scene);
    this.reach = points.reduce((reach, point) => Math.max(reach, Math.hypot(...point)), 1) * 2;
    this.surface.requestPaint();
  }

  private inView(point: Vec3): Vec3 {
    const [right, up, back] = VIEWS[this.up];
    return [dot(right, point), dot(up, point), dot(back, point)];
  }

  /** A vector of the picture's world in the target's frame. */
  private inCloud([r, u, b]: Vec3): [number, number, number] {
    const [right, up, back] = VIEWS[this.up];
    return [0, 1, 2].map((k) => r * (right[k] ?? 0) + u * (up[k] ?? 0) + b * (back[k] ?? 0)) as [
      number,
      number,
      number,
    ];
  }

  protected override render(): TemplateResult {
    return html`${this.renderStage(
      keyed(this.graphics.canvasNumber, html`<canvas aria-hidden="true"></canvas>`),
      'Arrow keys move the source in the plane of the screen, square brackets turn it about the line of sight, Shift makes both fine, Enter runs from there. Full stop and comma step on and back, the space bar plays. With Control, arrow keys move the view; plus, minus and F zoom.',
      'Drags move the source; with Shift or two fingers they turn it',
      mapButton('turn', 'Another axis is up', this.up === 'z' ? 'z is up' : 'y is down, as for a camera', () => {
        this.up = this.up === 'z' ? 'camera' : 'z';
      }),
    )}
    ${this.graphics.state === 'unavailable' ? html`<p class="no-graphics">This browser shows no 3D graphics (WebGL 2).</p>` : nothing}`;
  }

  override resized(wasEmpty: boolean): void {
    this.graphics.scene?.resize(this.size, this.surface.pixelRatio);
    if (wasEmpty) this.fit();
  }

  protected override draw(scene: PlaneScene): void {
    const graphics = this.graphics.scene;
    if (!graphics) return;
    this.follow(scene);
    this.upload(scene, graphics);
    graphics.render(this.orbit, VIEWS[this.up], scene.pose, BACKGROUND[scene.dark ? 'dark' : 'light'], this.reach);
  }

  /** Keeps the middle of the two clouds where it is on the screen. */
  private follow(scene: PlaneScene): void {
    if (!this.followed) return;
    const middle = this.sourceMiddle(scene);
    const [x, y, z] = this.followed;
    const [tx, ty, tz] = this.orbit.target;
    const target: Vec3 = [tx + (middle[0] - x) / 2, ty + (middle[1] - y) / 2, tz + (middle[2] - z) / 2];
    this.orbit = { ...this.orbit, target };
    this.followed = middle;
  }

  private sourceMiddle({ facts, pose }: PlaneScene): Vec3 {
    return this.inView(acted(pose, ...centroid(facts.source_points)));
  }

  /** What is seen, or another moment of it, as a PNG. */
  async picture(scene = this.scene): Promise<Blob> {
    const graphics = this.graphics.scene;
    if (!graphics) throw new Error('The browser gives no 3D graphics at the moment.');
    this.scene = scene;
    this.surface.paintNow();
    return pngOf(graphics.canvas);
  }

  /** Sends to the card what has changed. */
  private upload(scene: PlaneScene, graphics: SpaceScene): void {
    const clouds = `${this.fitKey} ${scene.dark} ${this.up}`;
    if (this.drawn.clouds !== clouds || this.drawn.facts !== scene.facts) {
      graphics.set('target', targetVertices(scene, VIEWS[this.up][1]));
      this.drawn.clouds = clouds;
      this.drawn.facts = scene.facts;
      this.drawn.pairs = null;
    }
    const { colorBy, pairs, rejected } = scene.look;
    const key = [scene.iteration, colorBy, pairs, rejected, scene.arrows.length];
    const before = this.drawn.pairs as readonly unknown[] | null;
    if (before?.every((part, i) => part === key[i])) return;
    this.drawn.pairs = key;
    graphics.set('source', sourceVertices(scene));
    graphics.set('pairs', pairVertices(scene));
    graphics.set('rejected', rejectedVertices(scene));
    graphics.set('marks', directionVertices(scene));
  }

  // Moving the source, or the view.

  press(): void {
    this.isTwisting = false;
  }

  turn(right: number, down: number): void {
    if (this.holds) this.shiftSource(right, down);
    else this.move(orbited(this.orbit, right * TURN_PER_PIXEL, -down * TURN_PER_PIXEL));
  }

  /** Shift, another button, or two fingers. */
  shift(right: number, down: number): void {
    if (!this.holds) this.move(panned(this.orbit, this.size, right, down));
    else if (!this.isTwisting) this.turnSource(-right * TURN_PER_PIXEL);
  }

  release(): void {
    if (this.holds) this.tell('source-released', null);
  }

  zoom(x: number, y: number, factor: number): void {
    this.move(zoomedAt(this.orbit, this.size, x, y, factor));
  }

  twist(angle: number): void {
    this.isTwisting = true;
    if (this.holds) this.turnSource(-angle);
  }

  hover(): void {
    this.stage.style.cursor = this.holds ? 'move' : '';
  }

  private move(orbit: Orbit): void {
    this.orbit = orbit;
    this.followed = null;
    this.surface.requestPaint();
  }

  protected override panBy(right: number, down: number): void {
    this.move(panned(this.orbit, this.size, right, down));
  }

  protected override shiftSource(right: number, down: number): void {
    const { scene, orbit, size } = this;
    if (!scene) return;
    const scale = metresPerPixel(orbit, size);
    const axis = axes(orbit);
    const shift = [0, 1, 2].map(
      (k) => scale * (right * (axis.right[k] ?? 0) - down * (axis.up[k] ?? 0)),
    ) as unknown as Vec3;
    this.tell('source-dragged', movedBy(scene.pose, [0, 0, 0], [0, 0, 0], this.inCloud(shift)));
  }

  /** About the line of sight. */
  protected override turnSource(angle: number): void {
    const { scene } = this;
    if (!scene) return;
    const [x, y, z] = this.inCloud(axes(this.orbit).back);
    const pivot = acted(scene.pose, ...centroid(scene.facts.source_points));
    this.tell('source-dragged', movedBy(scene.pose, [x * angle, y * angle, z * angle], pivot, [0, 0, 0]));
  }

  static override styles = [
    shared,
    mapStyles,
    css`
      .no-graphics {
        position: absolute;
        inset: auto 0 50%;
        color: var(--muted);
        text-align: center;
      }
    `,
  ];
}
