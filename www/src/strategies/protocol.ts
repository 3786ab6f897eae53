/** Strategies side by side: what the page and its worker say to each other. The names of the data are the engine's own. */
import type {
  Preset,
  StrategyFrame,
  StrategyResult,
  VoxelOdometrySettings as EngineSettings,
} from '../engine/package.js';
import type { SpatialSettings } from '../engine/spatial-protocol.js';

export type { StrategyFrame, StrategyResult } from '../engine/package.js';

export type VoxelOdometrySettings = Required<EngineSettings>;
export type StrategyPreset = Preset<VoxelOdometrySettings>;

/** The one worker that holds the maps of all strategies. */
export interface ComparerApi {
  start(module: WebAssembly.Module): StrategyPreset[];
  create(strategies: readonly Partial<VoxelOdometrySettings>[], settings: Partial<SpatialSettings>): void;
  setIntrinsics(name: string, bytes: Uint8Array): void;
  setReference(name: string, bytes: Uint8Array, num_recorded: number): void;
  begin(name: string, first_frame: Uint8Array): string;
  offer(prepared: Uint8Array): void;
  /** Places the frame on offer by one strategy; `milliseconds`: what that took in the worker. */
  place(strategy: number): { frame: StrategyFrame; milliseconds: number };
  result(strategy: number, milliseconds: readonly number[]): StrategyResult;
}
