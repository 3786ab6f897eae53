/** Ways to use the map in space other than turning it: what they need of it, and what it asks them. Loaded on demand. */
import type { TemplateResult } from 'lit';
import type { FloorGrid, FloorGridFiles } from '../engine/spatial-protocol.js';
import type { Orbit, Size } from '../views/orbit.js';
import type { Vec3 } from '../views/vectors.js';
import type { SpatialMarks } from './path-marks.js';
import type { LayerName, SceneLook } from './scene.js';
import type { Plane } from './section.js';
import type { SurfaceState } from './surface-bar.js';
import type { Survey } from './survey.js';

/** The map, as a tool sees it. */
export interface ToolHost {
  readonly stage: HTMLElement;
  readonly size: Size;
  readonly orbit: Orbit;
  readonly survey: Survey;
  readonly marks: SpatialMarks;
  readonly runSurface: SurfaceState;
  /** The selected frame's picture. */
  readonly image: HTMLImageElement | null;
  /** Heights over the floor (m) between which the map is flattened. */
  band: readonly [low: number, high: number];
  /** Makes the map's grid. */
  floorGrid(wanted: FloorGrid): Promise<FloorGridFiles>;
  /** How the map is drawn. */
  look(): SceneLook;
  /** Looks from there. */
  move(orbit: Orbit): void;
  requestUpdate(): void;
  requestPaint(): void;
  select(frame: number | null): void;
  setMeasured(segments: readonly (readonly [Vec3, Vec3])[]): void;
}

/** Each of its gestures returns whether it has taken it. */
export interface MapTool {
  /** Layers that would be in the way. */
  readonly hidden: readonly LayerName[];
  /** Whether the eye stands in the map. */
  readonly isInside: boolean;
  /** Cuts the map in place of the section that is chosen; `section`: the height above which nothing is drawn. */
  readonly plane?: Plane;
  readonly section?: number;
  /** What keys and fingers do. */
  readonly help: string;
  /** Goes on; whether there is more to come. `now`: ms. */
  advance?(now: number): boolean;
  key(key: string, isShifted: boolean): boolean;
  keyUp?(key: string): void;
  turn?(right: number, down: number): boolean;
  shift?(right: number, down: number): boolean;
  zoom?(factor: number): boolean;
  tap?(x: number, y: number): boolean;
  /** Below the map. */
  renderBar(): unknown;
  /** On it. */
  renderOver(): TemplateResult | null;
  end?(): void;
}
