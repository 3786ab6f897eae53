// @ts-check
/** The map of planar scans as MCAP: what readers of ROS 2 find in it. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CdrReader } from '../../npm/bag/cdr.js';
import { openRecording } from '../../npm/recording_reader.js';
import { mapMcap } from '../../npm/report/map_mcap.js';
import { openOne } from './bag_files.mjs';
import { SMALL_GRID } from './exported_files.mjs';

const HALF = Math.SQRT1_2;
/** Three scans, of which the second has no place; the first looks along y. */
const MAP = {
  trajectory: `# timestamp tx ty tz qx qy qz qw\n1700000000.123456789 1.0 2.0 0.0 0.0 0.0 ${HALF} ${HALF}\n1700000001 9 9 0 0 0 0 1\n1700000002.5 3.0 2.0 0.0 0.0 0.0 0.0 1.0\n`,
  points: Float32Array.of(1, 3, 0, 2, 4, 2.5),
  sizes: [2, 0, 1],
  grid: SMALL_GRID,
};

/** The fields before the data. @param {CdrReader} reader */
function readGrid(reader) {
  const stamp = [reader.i32('sec'), reader.u32('nanosec')];
  const frame = reader.string('frame');
  reader.i32('sec');
  reader.u32('nanosec');
  const resolution = reader.f32('resolution');
  const size = [reader.u32('width'), reader.u32('height')];
  return { stamp, frame, resolution, size, origin: reader.f64s(7, 'origin'), data: [...reader.bytes('data')] };
}

test('the grid begins with the least y, scans lie in the frame of the laser, and /tf places them', async () => {
  const bytes = mapMcap(MAP);
  const { bag, notes } = await openOne('map.mcap', bytes);
  assert.deepEqual(notes, []);
  assert.deepEqual(
    bag.topics.map(({ name, type, count }) => [name, type, count]),
    [
      ['/map', 'nav_msgs/msg/OccupancyGrid', 1],
      ['/path', 'nav_msgs/msg/Path', 1],
      ['/scan_points', 'sensor_msgs/msg/PointCloud2', 2],
      ['/tf', 'tf2_msgs/msg/TFMessage', 2],
    ],
  );
  const grid = bag.topic('/map');
  assert.ok(grid);
  assert.deepEqual(readGrid(new CdrReader(await bag.read(grid, 0))), {
    stamp: [1_700_000_000, 123_456_789],
    frame: 'map',
    resolution: 0.5,
    size: [3, 2],
    origin: [-1, 1.5, 0, 0, 0, 0, 1],
    data: [0, 0, 100, 100, 0, 255],
  });

  const recording = await openRecording([{ path: 'map.mcap', blob: new Blob([bytes]) }]);
  assert.equal(recording.kind, 'clouds');
  assert.deepEqual(recording.cloud_times, [1_700_000_000.1234568, 1_700_000_002.5]);
  const [first, last] = await Promise.all(recording.clouds.map((path) => recording.read(path)));
  const xyz = (/** @type {Uint8Array | undefined} */ file) => {
    const start = (file?.indexOf(0x0a, Buffer.from(file).indexOf('DATA')) ?? 0) + 1;
    const values = new Float32Array(file?.slice(start).buffer ?? []);
    return Array.from(values, (value) => Math.round(1e6 * value) / 1e6 + 0);
  };
  assert.deepEqual([xyz(first), xyz(last)], [[1, 0, 0, 0, 1, 0], [1, 0.5, 0]]); // prettier-ignore
  const [reference = ''] = recording.reference;
  const path = new TextDecoder()
    .decode(await recording.read(reference))
    .trim()
    .split('\n');
  assert.deepEqual(
    path.map((line) => line.split(' ').slice(0, 3).map(Number)),
    [
      [1_700_000_000.1234568, 1, 2],
      [1_700_000_002.5, 3, 2],
    ],
  );
});
