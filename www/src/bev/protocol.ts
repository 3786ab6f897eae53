/** What the view and its worker say to each other. Plain data: views know neither the worker nor the engine. */
import type {
  BevAxes,
  BevCamera,
  BevIntrinsics,
  BevLayout,
  BevLayoutCamera,
  BevPair,
  BevParameter,
  BevPlane,
  BevPoint,
  BevPolygon,
  BevPose,
  BevPoseKind,
  BevPreset,
  BevRefinement,
  BevRole,
  BevScene,
  BevSegment,
  EulerOrder,
  WholePixels,
} from '../../../pkg/scanstitch.js';

export type {
  BevAxes,
  BevCamera,
  BevIntrinsics,
  BevLayout,
  BevLayoutCamera,
  BevPair,
  BevParameter,
  BevPlane,
  BevPoint,
  BevPolygon,
  BevPose,
  BevPoseKind,
  BevPreset,
  BevRefinement,
  BevRole,
  BevScene,
  BevSegment,
  EulerOrder,
  WholePixels,
};

export type Pixel = readonly [number, number];

/** What is to be followed from the top view to the front view. */
export interface Question {
  scene: BevScene;
  /** Pixels of the top view, u v u v ... */
  marked: Float64Array;
  /** Corners of a region, u v u v ...; empty for none. */
  region: Float64Array;
  /** Ends of lines, u v u v for each. */
  lines: Float64Array;
  /** Top pixels of pairs. */
  pair_tops: Float64Array;
  /** What is done to the pixels that are told. */
  whole: WholePixels;
}

export interface Answer {
  points: BevPoint[];
  /** The same points in whole pixels, where these are wanted. */
  told: BevPoint[];
  region: BevPolygon | null;
  lines: BevSegment[];
  pair_points: BevPoint[];
  /** What of the top view the front camera sees. */
  common: BevPolygon;
  layout: BevLayout;
  /** Rows of nine numbers. */
  homography: number[];
}

/** What the worker can be asked, each with what it is given and what it answers. */
export interface Calls {
  about: [given: null, answer: { version: string; presets: BevPreset[] }];
  project: [given: Question, answer: Answer];
  /** One pixel of a view, followed to the other. */
  follow: [given: { scene: BevScene; from: BevRole; pixel: Pixel }, answer: BevPoint];
  in_axes: [given: { scene: BevScene; axes: BevAxes }, answer: BevScene];
  with_poses: [given: { scene: BevScene; kind: BevPoseKind; order: EulerOrder }, answer: BevScene];
  refine: [
    given: { scene: BevScene; pairs: readonly BevPair[]; camera: BevRole; parameters: readonly BevParameter[] },
    answer: BevRefinement,
  ];
  points_csv: [given: { scene: BevScene; marked: Float64Array; whole: WholePixels }, answer: string];
  read_scene: [given: { name: string; bytes: Uint8Array }, answer: BevScene];
  read_points: [given: { name: string; bytes: Uint8Array }, answer: Float64Array];
  check_image: [given: { scene: BevScene; role: BevRole; width: number; height: number }, answer: null];
  /** Keeps the picture of the top view, RGBA; null forgets it. */
  keep_image: [given: Uint8Array | null, answer: null];
}

export type Call = keyof Calls;

/** A part of the warped top view, in rows of the front view. */
export interface Strip {
  generation: number;
  first_row: number;
  num_rows: number;
  width: number;
  rgba: Uint8ClampedArray<ArrayBuffer>;
  is_last: boolean;
}

export type ToWorker =
  | { type: 'start'; module: WebAssembly.Module }
  | { type: 'call'; id: number; call: Call; given: unknown }
  /** Warps the kept picture strip by strip; a newer one ends it. */
  | { type: 'warp'; generation: number; scene: BevScene };

export type FromWorker =
  | { type: 'answer'; id: number; answer: unknown }
  /** Bad input, told by the engine. */
  | { type: 'refused'; id: number; message: string }
  | { type: 'strip'; strip: Strip }
  | { type: 'crashed'; message: string };
