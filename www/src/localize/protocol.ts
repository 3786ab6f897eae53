/** Localisation in a map: what the page and its worker say to each other. The names of the data are the engine's own. */
import type { LocalizationResult, LocatedScan, ParticleOptions } from '../engine/package.js';
import type { Inputs, Problem, Settings } from '../engine/protocol.js';

export type { LocatedPose, LocatedScan, ParticleOptions } from '../engine/package.js';

export interface GivenFile {
  name: string;
  bytes: Uint8Array<ArrayBuffer>;
}

/** The files of a map. */
export type MapSource =
  | { kind: 'yaml'; yaml: GivenFile; picture: GivenFile }
  /** `resolution`: side of a pixel, m. */
  | { kind: 'picture'; picture: GivenFile; resolution: number }
  | { kind: 'probabilities'; table: GivenFile };

/** A map as it is drawn: row by row from the top, 0 occupied, 254 free, 205 unknown. */
export interface GridPicture {
  width: number;
  height: number;
  /** Side of a cell, m. */
  resolution: number;
  /** The lower left corner in the world, m, and the turn of the grid's x axis from the world's, rad. */
  originX: number;
  originY: number;
  yaw: number;
  grey_values: Uint8Array;
  /** What is worth knowing of it; empty where there is nothing. */
  remark: string;
}

/** What became of the files of a recording. */
export interface ScansRead {
  num_scans: number;
  problems: Problem[];
  notes: { file: string; text: string }[];
}

/** What is known so far. */
export interface Located {
  outcome: Omit<LocalizationResult, 'scans'>;
  /** Status (0 good, 1 doubtful, 2 lost), x, y, theta of each scan so far; NaN where it has no place. */
  track: Float64Array;
  num_scans: number;
}

/** A scan with its places. */
export interface ScanDetails {
  index: number;
  scan: LocatedScan;
  /** Its returns at its most likely place: x y x y ..., world frame, m. */
  points: Float32Array;
}

/** A particle filter after a scan. */
export interface ParticleState {
  /** Index of the scan. */
  scan: number;
  /** Chosen by hand, and the engine's defaults. */
  options: ParticleOptions;
  /** Whether it is the one that was asked for. */
  isThere: boolean;
  /** x, y (m), theta (rad) and weight of each particle; the weights sum up to 1. */
  values: Float32Array;
  /** Effective number of particles after each scan on the way: scan and number. */
  passed: [scan: number, effectiveNumber: number][];
}

/** What the command line writes as well; the picture as pixels: red, green, blue, alpha. */
export interface Files {
  trajectory: string;
  report: string;
  picture: { width: number; height: number; rgba: Uint8ClampedArray<ArrayBuffer> };
}

export interface LocalizeApi {
  start(module: WebAssembly.Module): void;
  /** Takes the place of the map before, if it can be read. */
  openMap(source: MapSource): GridPicture;
  /** Takes the place of the scans before, if any can be read. */
  openScans(inputs: Pick<Inputs, 'scans' | 'odometry'>, settings: Partial<Settings>): ScansRead;
  /** Locates the scans in the map from the first one on; the number of scans. */
  locate(run: number): number;
  /** Ends that; what has been located stays. */
  stop(): void;
  scan(index: number): ScanDetails;
  file<K extends keyof Files>(kind: K): Files[K];
  /** Goes on with a particle filter to this scan, for a moment; with other options it starts anew. */
  particles(options: Partial<ParticleOptions>, scan: number): ParticleState;
  /** How likely a return in each cell of the map is, row by row from the top: 0 to 255. */
  likelihoodField(): Uint8Array;
}

/** `details`: of the last scan located. */
export interface LocalizeEvent {
  run: number;
  state: 'running' | 'done';
  located: Located;
  details: ScanDetails | null;
}
