/** Strategies side by side: what the page and its worker say to each other. The names of the data are the engine's own. */
import type {
  Preset,
  StrategyFrame,
  StrategyResult,
  VoxelOdometrySettings as EngineSettings,
} from '../engine/package.js';
import type { Compared } from '../../../package/report/strategy_table.js';
import type { GivenRecording, GivenScans } from '../run/run-kind.js';
import type { Problem } from '../engine/protocol.js';
import type { PointSet } from '../views/point-layer.js';
import type { WorkerFaults } from '../engine/worker-host.js';
import type { SpatialSettings } from '../engine/spatial-protocol.js';

export type { StrategyFrame, StrategyResult } from '../engine/package.js';

export type VoxelOdometrySettings = Required<EngineSettings>;
export type StrategyPreset<Settings = object> = Preset<Settings>;

/** A recording to compare strategies on: depth images and clouds, or planar scans. */
export type GivenToCompare = GivenRecording | GivenScans;
export const isPlanar = (given: GivenToCompare | null): given is GivenScans =>
  given !== null && 'scans' in given.inputs;

export function sameRecording(a: GivenToCompare, b: GivenToCompare): boolean {
  if (isPlanar(a) || isPlanar(b)) return a.inputs === b.inputs;
  return a.inputs.jobs === b.inputs.jobs && a.inputs.reference?.path === b.inputs.reference?.path;
}

export interface StrategyListener extends WorkerFaults {
  /** `done` of `total` are computed; `words`: where these are no frames that went through all strategies. */
  progressed(done: number, total: number, words?: string): void;
  /** One entry a strategy. Only planar scans have maps to draw. */
  results(results: readonly Compared[], milliseconds: readonly (readonly number[])[], maps?: readonly PointSet[]): void;
  problem(problem: Problem): void;
}

/** Runs strategies on recordings of one kind, one comparison at a time: a new one ends the one before it. */
export interface StrategyRunner {
  /** What can be compared on this recording. */
  presets(given: GivenToCompare | null): Promise<readonly StrategyPreset[]>;
  /** Whether all strategies went through to the end. */
  run(given: GivenToCompare, strategies: readonly StrategyPreset[]): Promise<boolean>;
  stop(): void;
  /** Leaves a strategy as it stands; the others go on. */
  retire(strategy: number): void;
  dispose(): void;
}

/** The one worker that holds the maps of all strategies. */
export interface ComparerApi {
  start(module: WebAssembly.Module): StrategyPreset<VoxelOdometrySettings>[];
  create(strategies: readonly Partial<VoxelOdometrySettings>[], settings: Partial<SpatialSettings>): void;
  setIntrinsics(name: string, bytes: Uint8Array): void;
  setReference(name: string, bytes: Uint8Array, num_recorded: number): void;
  begin(name: string, first_frame: Uint8Array): string;
  offer(prepared: Uint8Array): void;
  /** Places the frame on offer by one strategy; `milliseconds`: what that took in the worker. */
  place(strategy: number): { frame: StrategyFrame; milliseconds: number };
  result(strategy: number, milliseconds: readonly number[]): StrategyResult;
}
