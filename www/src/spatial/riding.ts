/** First person along the path: the map as the camera saw it, from frame to frame. */
import { html, type TemplateResult } from 'lit';
import { slider } from '../components/fields.js';
import { looking, type Orbit, type Size } from '../views/orbit.js';
import { added, transformed, turned, type Vec3 } from '../views/vectors.js';
import type { MapTool, ToolHost } from './map-tool.js';
import { type Camera, type Pose, positionOf } from './poses.js';
import type { Survey } from './survey.js';

/** The ride takes a step at this pace, or in its turn at this: m/s, rad/s. */
const PACE = 1;
const TURNING_PACE = Math.PI / 3;
/** And no step is shorter than a frame of a usual camera, s. */
const SHORTEST_STEP = 1 / 30;
/** Of a recording without a camera: half the height that is seen, a metre away. */
const TAN_HALF_VIEW = Math.tan((32.5 * Math.PI) / 180);

/** Where a sensor looks, and what is up for it: a camera has z ahead and y down, a laser x ahead and z up. */
export const ahead = (camera: Camera | null): Vec3 => (camera ? [0, 0, 1] : [1, 0, 0]);
const up = (camera: Camera | null): Vec3 => (camera ? [0, -1, 0] : [0, 0, 1]);

/** A pose on the way from one to another, `t` from 0 to 1. */
export function betweenPoses(from: Pose, to: Pose, t: number): Pose {
  const sign = from.qx * to.qx + from.qy * to.qy + from.qz * to.qz + from.qw * to.qw < 0 ? -1 : 1;
  const mix = (a: number, b: number): number => a + (b - a) * t;
  const q = (['qx', 'qy', 'qz', 'qw'] as const).map((name) => mix(from[name], sign * to[name]));
  const length = Math.hypot(...q) || 1;
  const [qx = 0, qy = 0, qz = 0, qw = 1] = q.map((value) => value / length);
  return { ...to, x: mix(from.x, to.x), y: mix(from.y, to.y), z: mix(from.z, to.z), qx, qy, qz, qw };
}

/** How long the step from one pose to the next takes, s. */
export function durationOf(from: Pose, to: Pose): number {
  const distance = Math.hypot(...added(positionOf(to), positionOf(from), -1));
  const dot = Math.abs(from.qx * to.qx + from.qy * to.qy + from.qz * to.qz + from.qw * to.qw);
  return Math.max(distance / PACE, (2 * Math.acos(Math.min(dot, 1))) / TURNING_PACE, SHORTEST_STEP);
}

/** The view of a camera at this pose: all that its image shows is seen. */
export function viewFrom(pose: Pose, camera: Camera | null, { R_view_map }: Survey, size: Size): Orbit {
  const inView = (v: Vec3): Vec3 => transformed(R_view_map, v);
  const tall = camera ? camera.height / 2 / camera.fy : TAN_HALF_VIEW;
  const wide = camera ? (camera.width / 2 / camera.fx) * (size.height / Math.max(size.width, 1)) : 0;
  const direction = inView(turned(pose, ahead(camera)));
  return looking(inView(positionOf(pose)), direction, inView(turned(pose, up(camera))), Math.max(tall, wide));
}

export class Riding implements MapTool {
  readonly hidden = ['cameras', 'estimate', 'reference'] as const;
  readonly isInside = true;
  readonly help = 'Space plays and stops, the arrow keys go from frame to frame; Esc ends.';
  #host: ToolHost;
  /** Number of the frame, and the share of the way to the next. */
  #at: number;
  #isPlaying = false;
  #last: number | null = null;

  constructor(host: ToolHost) {
    this.#host = host;
    this.#at = host.marks.selected ?? 0;
    this.#show();
  }

  advance(now: number): boolean {
    const { poses } = this.#host.marks;
    if (!this.#isPlaying) return false;
    let seconds = (now - (this.#last ?? now)) / 1000;
    this.#last = now;
    while (seconds > 0 && this.#at < poses.length - 1) {
      const [from, to] = [poses[Math.floor(this.#at)], poses[Math.floor(this.#at) + 1]];
      if (!from || !to) break;
      const rest = (Math.floor(this.#at) + 1 - this.#at) * durationOf(from, to);
      const share = Math.min(seconds / rest, 1);
      this.#at = share === 1 ? Math.floor(this.#at) + 1 : this.#at + share * (Math.floor(this.#at) + 1 - this.#at);
      seconds -= rest;
    }
    if (this.#at >= poses.length - 1) this.#play(false);
    this.#show();
    return this.#isPlaying;
  }

  key(key: string): boolean {
    const step = { ArrowLeft: -1, ArrowDown: -1, ',': -1, ArrowRight: 1, ArrowUp: 1, '.': 1 }[key];
    if (step !== undefined) this.#goTo(Math.round(this.#at) + step);
    else if (key === ' ') this.#play(!this.#isPlaying);
    return step !== undefined || key === ' ';
  }

  turn = (): boolean => true;
  shift = (): boolean => true;
  zoom = (): boolean => true;
  tap = (): boolean => true;

  renderBar(): TemplateResult {
    const { poses } = this.#host.marks;
    const [number, last] = [Math.round(this.#at) + 1, poses.length];
    return html`<button type="button" @click=${() => this.#play(!this.#isPlaying)}>
        ${this.#isPlaying ? 'Pause' : 'Play'}
      </button>
      ${slider(
        this.#at,
        { label: 'Frame of the path', max: Math.max(last - 1, 0), step: 'any', words: `frame ${number} of ${last}` },
        (at) => this.#goTo(at),
      )}
      <output class="number">${number} of ${last}</output>`;
  }

  renderOver(): TemplateResult | null {
    const { image } = this.#host;
    return image ? html`<img class="beside" src=${image.src} alt="What the camera saw here" />` : null;
  }

  end(): void {
    this.#isPlaying = false;
  }

  #play(isPlaying: boolean): void {
    const { poses } = this.#host.marks;
    if (isPlaying && this.#at >= poses.length - 1) this.#at = 0;
    this.#isPlaying = isPlaying;
    this.#last = null;
    this.#host.requestUpdate();
    this.#host.requestPaint();
  }

  #goTo(at: number): void {
    this.#isPlaying = false;
    this.#at = Math.min(Math.max(at, 0), Math.max(this.#host.marks.poses.length - 1, 0));
    this.#show();
  }

  #show(): void {
    const { marks, survey, size } = this.#host;
    const from = marks.poses[Math.floor(this.#at)];
    if (!from) return;
    const to = marks.poses[Math.floor(this.#at) + 1] ?? from;
    const pose = betweenPoses(from, to, this.#at - Math.floor(this.#at));
    this.#host.move(viewFrom(pose, marks.camera, survey, size));
    if (Math.round(this.#at) !== marks.selected) this.#host.select(Math.round(this.#at));
  }
}
