/** The thread that places every frame by each strategy in turn: one after the other, so that the clock is fair. */
import { init, strategy_presets, StrategyComparison } from '../engine/package.js';
import { timed } from '../../../package/run/strategy_race.js';
import { nothingLoaded, serve, type Served } from '../engine/serve.js';
import type { ComparerApi, StrategyPreset, VoxelOdometrySettings } from './protocol.js';

let comparison: StrategyComparison | null = null;

function engine(): StrategyComparison {
  if (!comparison) throw nothingLoaded();
  return comparison;
}

const api: Served<ComparerApi> = {
  async start(module): Promise<StrategyPreset<VoxelOdometrySettings>[]> {
    await init({ module_or_path: module });
    return strategy_presets() as StrategyPreset<VoxelOdometrySettings>[];
  },

  create(strategies, settings) {
    const next = new StrategyComparison(strategies, settings);
    comparison?.free();
    comparison = next;
  },

  setIntrinsics: (name, bytes) => engine().set_intrinsics(name, bytes),
  setReference: (name, bytes, num_recorded) => engine().set_reference(name, bytes, num_recorded),
  begin: (name, first_frame) => engine().begin(name, first_frame),
  offer: (prepared) => engine().offer(prepared),
  place: (strategy) => timed(engine()).place(strategy),
  result: (strategy, milliseconds) => engine().result(strategy, Float64Array.from(milliseconds)),
};

serve<ComparerApi>(api);
