/** What the worker sends of a growing map is joined to what the page knows. No page is needed. */
import { expect, test } from '@playwright/test';
import { GrowingSnapshot } from '../../www/src/engine/growing-snapshot.js';
import type { FrameResult, Growth, Snapshot } from '../../www/src/engine/protocol.js';

const frame = (index: number, x: number): FrameResult =>
  ({ index, T_world_sensor: { x, y: 0, theta: 0 } }) as FrameResult;
const growth = (changes: Partial<Growth>): Growth => ({
  result: null,
  first: 0,
  frames: [],
  poses: null,
  firstMapped: changes.first ?? 0,
  map_points: new Float32Array(0),
  mapCounts: new Uint32Array(0),
  timing: { load: 1, frames: [], joint: 0, total: 1 },
  ...changes,
});
const result = { notes: ['a note'] } as unknown as NonNullable<Growth['result']>;
const positions = ({ result: { frames } }: Snapshot): number[] => frames.map(({ T_world_sensor }) => T_world_sensor.x);
const points = ({ map_points, mapOffsets }: Snapshot, of: number): number[] => [
  ...map_points.subarray(2 * (mapOffsets[of] ?? 0), 2 * (mapOffsets[of + 1] ?? 0)),
];

test('frames and points come piece by piece, a lost frame without points', () => {
  const growing = new GrowingSnapshot();
  const first = growing.take(
    growth({
      result,
      frames: [frame(0, 0), frame(1, 1)],
      map_points: Float32Array.of(1, 2, 3, 4),
      mapCounts: Uint32Array.of(2, 0),
      timing: { load: 1, frames: [5, 6], joint: 0, total: 12 },
    }),
  );
  const second = growing.take(
    growth({
      first: 2,
      frames: [frame(2, 2)],
      map_points: Float32Array.of(5, 6),
      mapCounts: Uint32Array.of(1),
      timing: { load: 1, frames: [7], joint: 0, total: 19 },
    }),
  );
  expect(positions(second)).toEqual([0, 1, 2]);
  expect([0, 1, 2].map((of) => points(second, of))).toEqual([[1, 2, 3, 4], [], [5, 6]]);
  expect(second.timing).toEqual({ load: 1, frames: [5, 6, 7], joint: 0, total: 19 });
  expect(second.result.notes).toEqual(['a note']);
  // What was shown before is not touched.
  expect(positions(first)).toEqual([0, 1]);
  expect([0, 1].map((of) => points(first, of))).toEqual([[1, 2, 3, 4], []]);
});

test('frames that have moved bring new points, and more may follow', () => {
  const growing = new GrowingSnapshot();
  growing.take(
    growth({
      result,
      frames: [frame(0, 0), frame(1, 1)],
      map_points: Float32Array.of(1, 2, 3, 4),
      mapCounts: Uint32Array.of(1, 1),
    }),
  );
  const moved = growing.take(
    growth({
      first: 2,
      frames: [frame(2, 9)],
      poses: Float64Array.of(0, 0, 0, 8, 0, 0, 9, 0, 0),
      firstMapped: 0,
      map_points: Float32Array.of(1, 2, 30, 40, 50, 60),
      mapCounts: Uint32Array.of(1, 1, 1),
    }),
  );
  expect(positions(moved)).toEqual([0, 8, 9]);
  expect(points(moved, 1)).toEqual([30, 40]);
  const more = growing.take(
    growth({ first: 3, frames: [frame(3, 10)], map_points: Float32Array.of(7, 8), mapCounts: Uint32Array.of(1) }),
  );
  expect([0, 1, 2, 3].map((of) => points(more, of))).toEqual([
    [1, 2],
    [30, 40],
    [50, 60],
    [7, 8],
  ]);
});

test('a run that begins anew forgets what was there', () => {
  const growing = new GrowingSnapshot();
  const one = (x: number): Growth =>
    growth({ result, frames: [frame(0, x)], map_points: Float32Array.of(x, 0), mapCounts: Uint32Array.of(1) });
  growing.take(one(1));
  const again = growing.take(one(2));
  expect(positions(again)).toEqual([2]);
  expect(points(again, 0)).toEqual([2, 0]);
  expect(again.mapOffsets).toHaveLength(2);
});
