/** A run in space, as the evaluation takes it over. */
import type { SpatialPose, SpatialResult } from '../engine/spatial-protocol.js';
import type { GivenFiles } from '../components/run-view.js';

/**
 * The frames that were placed and, where the run has a truth, their true poses. Those are taken from the comparison, not
 * from the file: there they are in the estimate's world, whatever the file's axes and quaternions were, and each stands at
 * its frame. Times are the numbers of the frames.
 */
export function trajectoriesToEvaluate(
  { frames, comparison }: SpatialResult,
  readMap: GivenFiles['readMap'],
): GivenFiles {
  const placed = frames.flatMap(({ T_world_sensor, status }, index) => {
    const truth = comparison?.reference[index] ?? null;
    return status === 'lost' || (comparison && !truth) ? [] : [{ index, pose: T_world_sensor, truth }];
  });
  const estimate = placed.map(({ index, pose }) => line(index, pose)).join('');
  const truth = placed.map(({ index, truth: pose }) => (pose ? line(index, pose) : '')).join('');
  return {
    reference: comparison && { name: comparison.name, bytes: new TextEncoder().encode(truth).buffer as ArrayBuffer },
    estimate: { name: 'this run', text: estimate },
    readMap,
  };
}

function line(index: number, { x, y, z, qx, qy, qz, qw }: SpatialPose): string {
  return `${[index, x, y, z, qx, qy, qz, qw].join(' ')}\n`;
}
