/** What the view and its worker say to each other. Plain data: views know neither the worker nor the engine. */
import type {
  BevAxes,
  BevLayout,
  BevPair,
  BevParameter,
  BevPoint,
  BevPolygon,
  BevPoseKind,
  BevPreset,
  BevRefinement,
  BevRole,
  BevScene,
  BevSegment,
  EulerOrder,
  WholePixels,
} from '../engine/package.js';

export type * from '../engine/package.js';

export type Pixel = readonly [number, number];

/** What is to be followed from the top view to the front view. */
export interface Query {
  scene: BevScene;
  /** Pixels of the top view, u v u v ... */
  marked: Float64Array;
  /** Corners of a region, u v u v ...; empty for none. */
  region: Float64Array;
  /** Ends of lines, u v u v for each. */
  lines: Float64Array;
  /** Top pixels of pairs. */
  pairTops: Float64Array;
  /** What is done to the pixels that are reported. */
  whole: WholePixels;
}

export interface Projection {
  points: BevPoint[];
  /** The same points in whole pixels, where these are wanted. */
  reported: BevPoint[];
  region: BevPolygon | null;
  lines: BevSegment[];
  pairPoints: BevPoint[];
  /** What of the top view the front camera sees. */
  common: BevPolygon;
  layout: BevLayout;
  /** Nine numbers, row by row. */
  homography: number[];
}

export interface About {
  version: string;
  presets: BevPreset[];
}

/** A part of the warped top view, in rows of the front view. */
export interface Strip {
  generation: number;
  first_row: number;
  num_rows: number;
  width: number;
  rgba: Uint8ClampedArray<ArrayBuffer>;
  isLast: boolean;
}

/** The worker of the bird's-eye view; its events are strips. */
export interface BevApi {
  start(module: WebAssembly.Module): About;
  project(query: Query): Projection;
  /** One pixel of a view, followed to the other. */
  follow(given: { scene: BevScene; from: BevRole; pixel: Pixel }): BevPoint;
  inAxes(given: { scene: BevScene; axes: BevAxes }): BevScene;
  withPoses(given: { scene: BevScene; kind: BevPoseKind; order: EulerOrder }): BevScene;
  refine(given: {
    scene: BevScene;
    pairs: readonly BevPair[];
    camera: BevRole;
    parameters: readonly BevParameter[];
  }): BevRefinement;
  points_csv(given: { scene: BevScene; marked: Float64Array; whole: WholePixels }): string;
  readScene(given: { name: string; bytes: Uint8Array }): BevScene;
  readPoints(given: { name: string; bytes: Uint8Array }): Float64Array;
  checkImage(given: { scene: BevScene; role: BevRole; width: number; height: number }): void;
  /** Keeps the picture of the top view, RGBA; null forgets it. */
  keepImage(rgba: Uint8Array | null): void;
  /** Warps the kept picture strip by strip; a newer generation ends it. */
  warp(generation: number, scene: BevScene): void;
}
