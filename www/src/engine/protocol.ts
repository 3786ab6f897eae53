/**
 * What the page and the worker say to each other. The names of the data are the engine's own: the types come from the
 * package it is built into, so a name that changes there fails the type check here.
 */
import type {
  CleaningReport,
  Consequence,
  Edit,
  FrameResult as EngineFrameResult,
  GraphLoops,
  IterationRecord,
  PlacedPlan,
  PlanarPose,
  Preset as EnginePreset,
  SettingDescription as EngineSettingDescription,
  Settings as EngineSettings,
  Progress,
  ReconstructionResult,
  RecordingChanges,
  RefusedEdit,
  ScanAt,
  TableFacts,
} from './package.js';

export type * from './package.js';

/** All settings. The engine takes some of them, and so calls each one optional. */
export type Settings = Required<EngineSettings>;

/** A setting's description; its name and unit are known more closely than the engine's types say. */
export type SettingDescription = EngineSettingDescription & { name: keyof Settings; unit: 'm' | 'rad' | '' };

/** A preset gives every setting. */
export type Preset = EnginePreset<Settings>;

/** What is known of a scan. */
export type FrameResult = EngineFrameResult<PlanarPose, CleaningReport, PlanarPose>;

/** A file as the page holds it: `name` is its path inside what was dropped. */
export interface InputFile {
  name: string;
  bytes: ArrayBuffer;
  /** Whether it holds many scans. */
  isLog?: boolean;
  /** Whether it is a log whose columns somebody may want to name. */
  isTable?: boolean;
  /** What its columns are, where it is a table of ranges and somebody has said so. */
  table?: string;
}

export interface Inputs {
  /** Files of one scan each, or logs of many. */
  scans: readonly InputFile[];
  reference: InputFile | null;
  /** Wheel odometry, for the initial guesses. */
  odometry: InputFile | null;
}

/** What is free and what is occupied in a piece of the map. */
export interface Grid {
  width: number;
  height: number;
  /** Side of a cell, m. */
  resolution: number;
  /** x and y of the corner of the cell with the least of both, m. */
  origin: Float64Array;
  /** Row by row from the largest y down: 0 occupied, 254 free, 205 unknown. */
  grey_values: Uint8Array;
}

export type Place = { line: number } | { byte: number } | null;

/** Why a file, or a setting, could not be used. */
export interface Problem {
  /** Empty when it is not about a file. */
  file: string;
  place: Place;
  problem: string;
  remedy: string;
}

/** What the engine reports of itself when it has started. */
export interface EngineFacts {
  version: string;
  descriptions: SettingDescription[];
  presets: Preset[];
}

/** Milliseconds of computing, measured around each call of the engine: drawing and waiting are not in them. */
export interface Timing {
  /** Reading and cleaning all scans. */
  load: number;
  /** Per frame: its own steps. */
  frames: number[];
  /** Steps that belong to no single frame: the joint solution, the evaluation. */
  joint: number;
  total: number;
}

/** All there is to show, at one moment. */
export interface Snapshot {
  /** Without the iterations of the frames: `history` is empty, and can be asked for. */
  result: ReconstructionResult;
  /** x y x y ..., world frame, m, frame by frame. */
  map_points: Float32Array;
  /** Frame f has the points from `map_offsets[f]` to `map_offsets[f + 1]`. */
  mapOffsets: Uint32Array;
  timing: Timing;
}

/** Changes since the last message of this run. The first and the last message of a run are complete. */
export interface Growth {
  /** All of the result but its frames; null where nothing of it is new. */
  result: Omit<ReconstructionResult, 'frames'> | null;
  /** The frames from this one on. */
  first: number;
  frames: FrameResult[];
  /** x y theta of every frame, where those before `first` have moved; else null. */
  poses: Float64Array | null;
  /** The points of the frames from this one on, and how many each of these has. */
  firstMapped: number;
  map_points: Float32Array;
  mapCounts: Uint32Array;
  /** `frames`: of those from `first` on. */
  timing: Timing;
}

export type RunState = 'running' | 'stopped' | 'done';

/** A registration as the run did it: a scan, and the map of the scans before it as it was at that time. */
export interface ScanToMap {
  /** x y z x y z ..., m: the scan in its sensor's frame, the map in its own. */
  source: Float32Array<ArrayBuffer>;
  target: Float32Array<ArrayBuffer>;
  /** Unit normals of the map's points, NaN where one has none; null where the metric needs none. */
  target_normals: Float32Array<ArrayBuffer> | null;
  /** Where the registration began: 4 x 4, row by row. */
  init_T_target_source: readonly number[];
}

/** What the engine can be asked for, between two steps or at rest; the first three are those of one frame. */
export interface Answers {
  correspondences: Float32Array;
  history: IterationRecord[];
  /** Null where the frame was registered to nothing. */
  scan_to_map: ScanToMap | null;
  trajectory_tum: string;
  trajectory_matrices: string[];
  map_ply: Uint8Array;
  /** Of the main piece of the map. */
  occupancy_grid: Grid;
  /** Of all pieces, as files of ROS's map_server. */
  gridFiles: Record<string, Uint8Array | string>;
  report_json: string;
  /** Of a run that is done; the full engine alone tells them. */
  graph_loops: GraphLoops;
  graph_g2o: string;
  unused_edits: RefusedEdit[];
  changes: RecordingChanges[];
  /** The building plan behind the map; null where there is none. */
  plan: PlacedPlan | null;
}

/** What became of the files that were to be read. */
export interface ReadOutcome {
  /** Names of the scans that were read; empty: what was there before is still there. */
  accepted: string[];
  /** Names of the other files that were not taken. */
  refused: string[];
  problems: Problem[];
  /** What is worth knowing of the files, though nothing is lost. */
  notes: { file: string; text: string }[];
  /** Whether somebody stopped it: none of it is used. */
  isStopped?: boolean;
}

/** The worker of planar scans. `run` numbers the client's orders: events of an order that has been overtaken are dropped. */
export interface PlanarApi {
  start(module: WebAssembly.Module): EngineFacts;
  /** Reads the files, then computes unless `hold` is set; null where a later command has superseded it. */
  load(run: number, inputs: Inputs, settings: Partial<Settings>, hold: boolean): ReadOutcome | null;
  configure(run: number, settings: Partial<Settings>): void;
  stop(): void;
  resume(run: number): void;
  /** `frame` matters for `correspondences`, `history` and `scan_to_map` alone. */
  ask<K extends keyof Answers>(kind: K, frame: number): Answers[K];
  /** Takes these steps of mending, and none that were taken before; those that it refused. */
  mend(run: number, steps: readonly Edit[]): RefusedEdit[];
  /** What the last of these steps would change. */
  previewEdit(steps: readonly Edit[]): Consequence;
  /** Where the last of these steps lays a plan; null where it lays none. */
  previewPlan(steps: readonly Edit[]): PlacedPlan | null;
  /** The scans with beams that met a cell of this side (m). */
  scansAt(x: number, y: number, side: number): ScanAt[];
  /** A table as it would be read by `format`, or by a guess, with one of its scans; null where the file is no table. */
  describeTable(file: InputFile, format: string | null, scan: number): TableFacts | null;
}

export type PlanarEvent =
  | { type: 'reading'; run: number; file: string; done: number; total: number }
  | { type: 'progress'; run: number; progress: Progress }
  | { type: 'growth'; run: number; state: RunState; growth: Growth };
