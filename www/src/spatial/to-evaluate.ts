/** A run in space, as the evaluation takes it over. */
import type { SpatialPose, SpatialResult } from '../engine/spatial-protocol.js';
import type { GivenFiles } from '../components/run-kind.js';

/**
 * The frames that were placed and, where the run has a reference, its poses. Those are taken from the comparison, not
 * from the file: there they are in the estimate's world, whatever the file's axes and quaternions were, and each stands at
 * its frame. Times are the numbers of the frames.
 */
export function trajectoriesToEvaluate(
  { frames, comparison }: SpatialResult,
  readMap: GivenFiles['readMap'],
): GivenFiles {
  const placed = frames.flatMap(({ T_world_sensor, status }, index) => {
    const reference = comparison?.reference[index] ?? null;
    return status === 'lost' || (comparison && !reference) ? [] : [{ index, pose: T_world_sensor, reference }];
  });
  const estimate = placed.map(({ index, pose }) => line(index, pose)).join('');
  const reference = placed.map(({ index, reference: pose }) => (pose ? line(index, pose) : '')).join('');
  return {
    reference: comparison && {
      name: comparison.name,
      bytes: new TextEncoder().encode(reference).buffer as ArrayBuffer,
    },
    estimate: { name: 'this run', text: estimate },
    readMap,
  };
}

function line(index: number, { x, y, z, qx, qy, qz, qw }: SpatialPose): string {
  return `${[index, x, y, z, qx, qy, qz, qw].join(' ')}\n`;
}
