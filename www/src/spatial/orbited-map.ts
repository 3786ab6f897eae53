/** How the map in space is looked at: its viewpoint, what moves it, and what lies under the pointer. */
import { LitElement } from 'lit';
import { property, state } from 'lit/decorators.js';
import { type DrawingHost, type DrawingSurface } from '../drawing/drawing-surface.js';
import { fire } from '../components/fire.js';
import { isAlike, nearest, type Orbit, orbited, panned, type Size, STRAIGHT_DOWN, zoomedAt } from '../views/orbit.js';
import type { MapTools } from './map-tools.js';
import { type BeforePath, NO_MARKS, type SpatialMarks } from './path-marks.js';
import { fittedTo, NO_SURVEY, positions, type Survey } from './survey.js';
import { Viewpoint } from './viewpoint.js';

const TURN_PER_PIXEL = 0.006;

/** Fires `frame-selected` with a frame number or null. */
export abstract class OrbitedMap extends LitElement implements DrawingHost {
  @property({ attribute: false }) marks: SpatialMarks = NO_MARKS;
  /** The path that this one replaces, to be compared with it. */
  @property({ attribute: false }) pathBefore: BeforePath | null = null;
  /** Whether more points are to come: small changes do not move the view until then. */
  @property({ type: Boolean }) growing = false;
  @state() protected hovered: number | null = null;

  survey: Survey = NO_SURVEY;
  /** The text beside the map is updated when a flight ends: at every picture that would take longer than drawing it. */
  protected readonly viewpoint = new Viewpoint();
  protected abstract readonly surface: DrawingSurface;
  protected abstract readonly tools: MapTools;

  /** The height of the section that is shown. */
  protected abstract cut(): number;
  abstract readonly stage: HTMLElement;
  abstract readonly canvas: HTMLCanvasElement;
  abstract resized(): void;
  abstract requestPaint(): void;
  abstract paint(): void;

  get size(): Size {
    return this.surface.size;
  }

  get orbit(): Orbit {
    return this.viewpoint.orbit;
  }

  /** Shows the whole map, from the present viewpoint. */
  fit(atOnce = false): void {
    this.tools.now?.goOutside();
    this.viewpoint.isMoved = false;
    this.fly(this.toAll(this.straightened()), atOnce);
  }

  /** Looks straight down. */
  fromAbove(): void {
    this.tools.now?.goOutside();
    this.viewpoint.isMoved = false;
    this.fly(this.toAll({ ...this.viewpoint.orbit, azimuth: this.survey.straight, elevation: STRAIGHT_DOWN }), false);
  }

  /** Keeps the map in view while it grows; the view stands still where little has been added. */
  protected follow(atOnce: boolean): void {
    if (this.growing && this.pathBefore) return; // the view stays as it was, for the two to be compared
    const to = this.toAll(this.straightened());
    if (atOnce || !this.growing || !isAlike(this.viewpoint.goal, to)) this.fly(to, atOnce);
  }

  /** From above, the walls run across and along the screen. */
  private straightened(): Orbit {
    const { orbit } = this.viewpoint;
    return orbit.elevation === STRAIGHT_DOWN ? { ...orbit, azimuth: this.survey.straight } : orbit;
  }

  /** The orbit that shows all there is from where this one looks. */
  protected toAll(orbit: Orbit): Orbit {
    const poses = [...this.marks.poses, ...(this.pathBefore?.poses ?? [])];
    return fittedTo(this.survey, poses, this.cut(), orbit, this.size);
  }

  private fly(to: Orbit, atOnce: boolean): void {
    if (this.survey.sampled.length === 0) return;
    if (atOnce) this.viewpoint.jump(to);
    else this.viewpoint.fly(to);
    if (!this.viewpoint.isFlying) this.requestUpdate();
    this.requestPaint();
  }

  move(orbit: Orbit): void {
    this.viewpoint.jump(orbit);
    this.viewpoint.isMoved = true;
    this.requestUpdate();
  }

  protected toggleProjection(): void {
    const { orbit } = this.viewpoint;
    this.viewpoint.jump({ ...orbit, projection: orbit.projection === 'perspective' ? 'orthographic' : 'perspective' });
    this.requestUpdate();
    if (!this.viewpoint.isMoved) this.fit(true);
  }

  zoomBy(factor: number): void {
    this.surface.zoomBy(factor);
  }

  turn(right: number, down: number): void {
    if (!this.tools.now?.turn(right, down))
      this.move(orbited(this.viewpoint.orbit, right * TURN_PER_PIXEL, -down * TURN_PER_PIXEL));
  }

  shift(right: number, down: number): void {
    if (!this.tools.now?.shift(right, down)) this.move(panned(this.viewpoint.orbit, this.surface.size, right, down));
  }

  zoom(x: number, y: number, factor: number): void {
    if (!this.tools.now?.zoom(factor)) this.move(zoomedAt(this.viewpoint.orbit, this.surface.size, x, y, factor));
  }

  twist(angle: number): void {
    this.move(orbited(this.viewpoint.orbit, angle, 0));
  }

  tap(x: number, y: number, reach: number): void {
    if (!this.tools.now?.tap(x, y)) this.select(this.frameAt(x, y, reach));
  }

  hover(x: number, y: number): void {
    this.hovered = this.frameAt(x, y, 12);
  }

  leave(): void {
    this.hovered = null;
  }

  private frameAt(x: number, y: number, reach: number): number | null {
    const shown = positions(this.marks.poses.slice(0, this.marks.until), this.survey.R_view_map);
    return nearest(shown, this.viewpoint.orbit, this.surface.size, x, y, reach);
  }

  select(frame: number | null): void {
    fire(this, 'frame-selected', frame);
  }
}
