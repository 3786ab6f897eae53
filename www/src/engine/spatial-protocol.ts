/**
 * Depth images and clouds in space: what the page and its workers say to each other. The names of the data are the
 * engine's own.
 */
import type {
  FrameResult,
  MapSize,
  Preset,
  Progress,
  SettingDescription as EngineSettingDescription,
  SpatialDeviation,
  SpatialPose,
  SpatialSettings as EngineSettings,
  SpatialResult,
} from './package.js';

export type { Assumption, MapSize, SpatialPose, SpatialResult, Suggestion } from './package.js';

/** All settings. The engine takes some of them, and so calls each one optional. */
export type SpatialSettings = Required<EngineSettings>;
export type SpatialPreset = Preset<SpatialSettings>;

/** What is known of a depth image or a cloud. */
export type SpatialFrameResult = FrameResult<SpatialPose, null, SpatialDeviation>;
export type SpatialSettingDescription = EngineSettingDescription & {
  name: keyof SpatialSettings;
  unit: 'm' | 'rad' | '';
};

export interface SpatialFacts {
  version: string;
  descriptions: SpatialSettingDescription[];
  presets: SpatialPreset[];
}

/** The points of a map. */
export interface MapPoints {
  /** x y z x y z ..., world, m. */
  positions: Float32Array;
  /** red green blue ... */
  colors: Uint8Array;
  /** Unit vectors, a unit being 32 767; zero where unknown. */
  normals: Int16Array;
  /** Frame that saw each point first. */
  frames: Uint32Array;
}

/** All there is to show, at one moment. */
export interface SpatialSnapshot {
  result: SpatialResult;
  points: MapPoints;
}

/** What the map comes to in voxels of another size. */
export interface SizedMap extends MapSize {
  /** Milliseconds of making it. */
  ms: number;
}

/** Which part of the map is flattened. */
export interface FloorGrid {
  /** Away from the floor, in the map's world. */
  up: readonly [number, number, number];
  /** Its height along `up` (m). */
  floor: number;
  /** Lowest and highest height over the floor (m). */
  band: readonly [number, number];
}

/** A grid as files of ROS's map_server, and as a picture. */
export interface FloorGridFiles {
  pgm: Uint8Array;
  yaml: string;
  width: number;
  height: number;
  /** Row by row from the top: 0 occupied, 254 free, 205 unknown. */
  greys: Uint8Array;
}

/** What can be exported. */
export interface SpatialAnswers {
  trajectory_tum: string;
  trajectory_matrices: string[];
  map_ply: Uint8Array;
  map_pcd: Uint8Array;
  map_ply_ascii: Uint8Array;
  map_pcd_ascii: Uint8Array;
  map_pcd_compressed: Uint8Array;
  report_json: string;
  /** How depth is read; undefined before the first frame. */
  decode_config: string | undefined;
  /** x y z qx qy qz qw of each frame before one: the motion of its points in the map to where they lay when that one was
   * registered, in the frame of the sensor before it. */
  map_before: Float64Array;
  /** What is kept of a frame for the map, for the surface; undefined where there is none. */
  kept_points: Uint8Array | undefined;
}

/** The one worker that holds the reconstruction. */
export interface RegistrarApi {
  start(module: WebAssembly.Module): SpatialFacts;
  create(settings: Partial<SpatialSettings>): void;
  /** Gives the reconstruction's memory back. */
  forget(): void;
  setIntrinsics(name: string, bytes: Uint8Array): void;
  /** Looks at the first file; returns what the preparing workers need. */
  begin(name: string, first_frame: Uint8Array): string;
  /** Adds a prepared frame and registers it; `ms`: what that took, without waiting; `spent`: its bytes, for others to come;
   * `decodeConfig`: what the preparing workers need from now on. */
  place(prepared: Uint8Array): Progress & { ms: number; spent: Uint8Array; decodeConfig: string | undefined };
  /** Does a piece of what is left to do after the last frame, until it is `done`: looks for frames again that were not
   * found, then closes the last loop. */
  finish(): Progress;

  setReference(name: string, bytes: Uint8Array, num_recorded: number): void;
  clearReference(): void;
  snapshot(): SpatialSnapshot;
  mapSize(voxel_size: number): SizedMap;
  /** The map flattened to a grid, as files. */
  floorGrid(wanted: FloorGrid): FloorGridFiles;
  /** `frame` matters for `map_before` and `kept_points` alone. */
  ask<K extends keyof SpatialAnswers>(kind: K, frame: number): SpatialAnswers[K];
}

/** A prepared frame, and the bytes that it was made from, for others to come. */
export interface PreparedBytes {
  prepared: Uint8Array;
  spent: Uint8Array;
  spentColor: Uint8Array | null;
}

/** A colour image, or why it cannot be read: the frame is used without it. */
export interface ColorFile {
  path: string;
  bytes: Uint8Array | null;
  problem: string | null;
}

/** The workers that decode and prepare frames; `spare`: where a prepared frame may be written. */
export interface PreparerApi {
  start(module: WebAssembly.Module): void;
  prepareFrame(
    decodeConfig: string,
    name: string,
    index: number,
    time: number | null,
    depth: Uint8Array,
    color: ColorFile | null,
    spare: Uint8Array | null,
  ): PreparedBytes;
  prepareCloud(
    decodeConfig: string,
    name: string,
    index: number,
    time: number | null,
    cloud: Uint8Array,
    spare: Uint8Array | null,
  ): PreparedBytes;
  /** The colours go from near to far. */
  depthPicture(name: string, bytes: Uint8Array, colors: Uint32Array): DepthColors;
  /** `fx`: focal length of the image (pixels). */
  topView(name: string, bytes: Uint8Array, fx: number): TopView;
}

/** The surfaces of a depth image from above: the camera in the middle of the last row, looking up. */
export interface TopView {
  columns: number;
  rows: number;
  /** Side of a square cell, in raw values of depth. */
  cell: number;
  /** Raw value within which all but the farthest of the pixels lie. */
  far: number;
  /** 0 to 255 a cell, row by row: the more pixels, the more. */
  density: Uint8Array;
}

/** A depth image in colours. */
export interface DepthColors {
  width: number;
  height: number;
  /** A colour each, row by row; 0 where nothing was measured. */
  pixels: Uint32Array;
  /** Raw values of what has the first and the last colour. */
  near: number;
  far: number;
  num_invalid: number;
}
