import { css, html, LitElement, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { shared, stretch } from '../components/theme.js';
import { axes, type Direction, orbited } from '../views/orbit.js';
import { added, cross, dot, normalized, scaled, type Vec3 } from '../views/vectors.js';
import type { BevLayout, BevLayoutCamera, BevPoint } from './protocol.js';
import { watchSize } from '../components/watch-size.js';

type Place = readonly [number, number];

interface Inks {
  line: string;
  text: string;
  top: string;
  front: string;
  mark: string;
}

/** How long the pyramids of the cameras are, as a share of the height of the higher one. */
const PYRAMID = 0.35;
/** The eye goes no lower (rad): the ground must not become a line. */
const LOWEST = 0.02;
const RADIANS_PER_PIXEL = 0.01;

/**
 * The scene as a small drawing in space: the ground, what each camera sees of it, and the marks on it. Parallel lines
 * stay parallel. Dragging and the arrow keys turn it.
 */
@customElement('scanstitch-bev-sketch')
export class ScanstitchBevSketch extends LitElement {
  @property({ attribute: false }) layout: BevLayout | null = null;
  @property({ attribute: false }) points: readonly BevPoint[] = [];
  @property({ type: Boolean, reflect: true }) dark = false;
  @state() private direction: Direction = { azimuth: -0.7, elevation: 0.5 };
  @query('canvas') private canvas!: HTMLCanvasElement;
  private draggedFrom: { x: number; y: number } | null = null;

  constructor() {
    super();
    watchSize(this, () => this.paint());
  }

  protected override updated(_changed: PropertyValues): void {
    this.paint();
  }

  protected override render(): TemplateResult {
    return html`<canvas
      role="img"
      tabindex="0"
      aria-label=${this.words()}
      @pointerdown=${this.onDown}
      @pointermove=${this.onMove}
      @pointerup=${this.onUp}
      @pointercancel=${this.onUp}
      @keydown=${this.onKey}
    ></canvas>`;
  }

  private words(): string {
    const { layout } = this;
    if (!layout) return 'Sketch of the two cameras';
    const metres = ({ height }: BevLayoutCamera) => `${height.toFixed(2)} metres above the ground`;
    return `Sketch in space: top camera ${metres(layout.top)}, front camera ${metres(layout.front)}. Arrow keys turn it.`;
  }

  private paint(): void {
    const { canvas, layout } = this;
    const density = devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth * density, canvas.clientHeight * density];
    const context = canvas.getContext('2d');
    if (!context || width === 0 || height === 0) return;
    [canvas.width, canvas.height] = [Math.round(width), Math.round(height)];
    if (!layout) return;
    const dark = this.dark;
    const inks: Inks = {
      line: dark ? '#3a4553' : '#c3ccd6',
      text: dark ? '#e5eaf1' : '#17202c',
      top: dark ? '#8ab0ff' : '#2356c7',
      front: dark ? '#f2b862' : '#a85f00',
      mark: dark ? '#ff6fb1' : '#c4126a',
    };
    const place = placer(layout, this.direction, [width, height], 22 * density);
    draw({ context, layout, place, inks, density }, this.points);
  }

  private onDown(event: PointerEvent): void {
    this.draggedFrom = { x: event.clientX, y: event.clientY };
    this.canvas.setPointerCapture(event.pointerId);
  }

  private onMove(event: PointerEvent): void {
    if (!this.draggedFrom) return;
    this.turn(event.clientX - this.draggedFrom.x, event.clientY - this.draggedFrom.y);
    this.draggedFrom = { x: event.clientX, y: event.clientY };
  }

  private onUp(): void {
    this.draggedFrom = null;
  }

  private onKey(event: KeyboardEvent): void {
    const step = { ArrowLeft: [-12, 0], ArrowRight: [12, 0], ArrowUp: [0, -12], ArrowDown: [0, 12] }[event.key];
    if (!step) return;
    event.preventDefault();
    this.turn(step[0] ?? 0, step[1] ?? 0);
  }

  private turn(dx: number, dy: number): void {
    this.direction = orbited(this.direction, dx * RADIANS_PER_PIXEL, -dy * RADIANS_PER_PIXEL, LOWEST);
  }

  static override styles = [
    shared,
    css`
      :host {
        height: 220px;
      }
      canvas {
        display: block;
        ${stretch};
        cursor: grab;
        touch-action: none;
      }
      canvas:active {
        cursor: grabbing;
      }
      canvas:focus-visible {
        outline-offset: -2px;
      }
    `,
  ];
}

/** Where points of the world lie on the canvas: all of the scene fits. */
function placer(
  layout: BevLayout,
  direction: Direction,
  [width, height]: Place,
  margin: number,
): (point: Vec3) => Place {
  const up = layout.up;
  // Ahead is where the front camera looks; where it looks straight down, where the top of its image points.
  const level = (v: Vec3): Vec3 => added(v, up, -dot(v, up));
  const forward = level(layout.front.forward);
  const ahead = normalized(Math.hypot(...forward) > 0.1 ? forward : level(scaled(layout.front.down, -1)));
  const screen = axes(direction, { right: cross(ahead, up), up, back: scaled(ahead, -1) });
  const flat = (p: Vec3): Place => [dot(p, screen.right), -dot(p, screen.up)];
  const all = [layout.top, layout.front].flatMap(({ position, footprint }) => [
    position,
    foot(layout, position),
    ...footprint,
  ]);
  const placed = all.map(flat);
  const [xs, ys] = [placed.map(([x]) => x), placed.map(([, y]) => y)];
  const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const scale = Math.min(
    (width - 2 * margin) / Math.max(x1 - x0, 1e-6),
    (height - 2 * margin) / Math.max(y1 - y0, 1e-6),
  );
  return (point) => {
    const [x, y] = flat(point);
    return [width / 2 + (x - (x0 + x1) / 2) * scale, height / 2 + (y - (y0 + y1) / 2) * scale];
  };
}

/** What a sketch is drawn with. */
interface Sketch {
  context: CanvasRenderingContext2D;
  layout: BevLayout;
  place(point: Vec3): Place;
  inks: Inks;
  density: number;
}

function draw(sketch: Sketch, points: readonly BevPoint[]): void {
  const { context, layout, inks, density } = sketch;
  drawFootprint(sketch, layout.top, inks.top);
  drawFootprint(sketch, layout.front, inks.front);
  drawGrounds(sketch, points);
  context.font = `600 ${12 * density}px system-ui, sans-serif`;
  drawCamera(sketch, layout.top, inks.top, 'top');
  drawCamera(sketch, layout.front, inks.front, 'front');
}

function path({ context, place }: Sketch, corners: readonly Vec3[], isClosed: boolean): void {
  context.beginPath();
  for (const corner of corners) context.lineTo(...(place(corner) as [number, number]));
  if (isClosed) context.closePath();
}

function stroke({ context, density }: Sketch, color: string, thickness: number, dash: number[] = []): void {
  context.setLineDash(dash.map((size) => size * density));
  context.strokeStyle = color;
  context.lineWidth = thickness * density;
  context.stroke();
  context.setLineDash([]);
}

type DrawnCamera = BevLayout['top'];

/** The part of the ground that a camera sees. */
function drawFootprint(sketch: Sketch, { footprint }: DrawnCamera, color: string): void {
  if (footprint.length < 3) return;
  const { context } = sketch;
  path(sketch, footprint, true);
  context.globalAlpha = 0.16;
  context.fillStyle = color;
  context.fill();
  context.globalAlpha = 1;
  stroke(sketch, color, 1);
}

/** The marked points on the ground. */
function drawGrounds({ context, place, inks, density }: Sketch, points: readonly BevPoint[]): void {
  context.fillStyle = inks.mark;
  for (const { ground } of points) {
    if (!ground) continue;
    const [x, y] = place(ground);
    context.beginPath();
    context.arc(x, y, 2.5 * density, 0, 2 * Math.PI);
    context.fill();
  }
}

/** A camera as a pyramid above its foot, with its name and height. */
function drawCamera(sketch: Sketch, camera: DrawnCamera, color: string, name: string): void {
  const { context, layout, place, inks, density } = sketch;
  const { position, corners } = camera;
  const size = PYRAMID * Math.max(Math.abs(layout.top.height), Math.abs(layout.front.height));
  path(sketch, [position, foot(layout, position)], false);
  stroke(sketch, inks.line, 1.25, [3, 3]);
  // Wide cameras have long corners: all pyramids are of one length.
  const reach = size / Math.max(...corners.map((corner) => Math.hypot(...corner)), 1);
  const ends = corners.map((corner) => added(position, corner, reach));
  for (const end of ends) {
    path(sketch, [position, end], false);
    stroke(sketch, color, 1.25);
  }
  path(sketch, ends, true);
  stroke(sketch, color, 1.5);
  // A roof over the upper edge marks the top of the image.
  const [upperLeft, upperRight] = ends;
  if (upperLeft && upperRight) {
    const middle = scaled(added(upperLeft, upperRight, 1), 0.5);
    path(sketch, [upperLeft, added(middle, camera.down, -0.18 * size), upperRight], true);
    context.fillStyle = color;
    context.fill();
  }
  const [x, y] = place(position);
  context.fillStyle = inks.text;
  const words = `${name} ${camera.height.toFixed(2)} m`;
  const wide = context.measureText(words).width;
  const left = Math.min(x + 8 * density, context.canvas.width - wide - 4 * density);
  context.fillText(words, left, y - 6 * density);
}

/** The point of the ground below a camera. */
function foot({ up, ground }: BevLayout, position: Vec3): Vec3 {
  return added(position, up, dot(ground, up) - dot(position, up));
}
