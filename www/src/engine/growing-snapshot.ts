/** The page's side of a map that grows: what the worker sends is what is new, and here it is joined to what is known. */
import type { FrameResult, Growth, Snapshot } from './protocol.js';

/** Room for points grows by this factor, so that each point is moved a few times at most. */
const GROWTH_FACTOR = 1.5;

export class GrowingSnapshot {
  #snapshot: Snapshot | null = null;

  /** All there is to show, now that this has come. What was returned before stays as it was. */
  take(growth: Growth): Snapshot {
    const before = this.#snapshot;
    const kept = before?.result.frames.slice(0, growth.first) ?? [];
    const frames = [...(growth.poses ? moved(kept, growth.poses) : kept), ...growth.frames];
    const result = growth.result ?? before?.result;
    if (!result) throw new Error('A growing result has no beginning.');
    const times = [...(before?.timing.frames.slice(0, growth.first) ?? []), ...growth.timing.frames];
    this.#snapshot = {
      result: { ...result, frames },
      ...joined(before, growth),
      timing: { ...growth.timing, frames: times },
    };
    return this.#snapshot;
  }
}

function moved(frames: readonly FrameResult[], poses: Float64Array): FrameResult[] {
  return frames.map((frame, i) => {
    const [x = 0, y = 0, theta = 0] = poses.subarray(3 * i, 3 * i + 3);
    return { ...frame, T_world_sensor: { x, y, theta } };
  });
}

/** The points known so far up to those of `firstMapped`, and the new ones behind them. */
function joined(
  before: Snapshot | null,
  { firstMapped, map_points, mapCounts }: Growth,
): Pick<Snapshot, 'map_points' | 'mapOffsets'> {
  const mapOffsets = new Uint32Array(firstMapped + mapCounts.length + 1);
  if (before) mapOffsets.set(before.mapOffsets.subarray(0, firstMapped + 1));
  for (const [i, count] of mapCounts.entries()) {
    mapOffsets[firstMapped + i + 1] = (mapOffsets[firstMapped + i] ?? 0) + count;
  }
  const start = 2 * (mapOffsets[firstMapped] ?? 0);
  if (start === 0 || !before) return { map_points, mapOffsets };
  const length = start + map_points.length;
  const known = before.map_points;
  const room = new Float32Array(known.buffer, 0, known.buffer.byteLength / Float32Array.BYTES_PER_ELEMENT);
  const all = room.length < length ? new Float32Array(Math.ceil(GROWTH_FACTOR * length)) : room;
  if (all !== room) all.set(known.subarray(0, start));
  all.set(map_points, start);
  return { map_points: all.subarray(0, length), mapOffsets };
}
