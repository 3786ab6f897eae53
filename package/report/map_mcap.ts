/** The map of planar scans as an MCAP file that Foxglove, rviz and other readers of ROS 2 open: grid, scans, poses and path. */
import { joined } from '../base/bytes.js';
import { CdrWriter } from '../bag/cdr_writer.js';
import { McapWriter, type WrittenTopic } from '../bag/mcap_writer.js';

/** What is written. */
export interface PlanarMap {
  /** TUM: t x y z qx qy qz qw of each scan, as the engine tells it. */
  trajectory: string;
  /** x y x y ... of the map, world frame (m), and how many points each scan has in it. */
  points: Float32Array;
  sizes: ArrayLike<number>;
  /** Of the main piece: rows from the largest y down, 0 occupied, 254 free, 205 unknown. */
  grid: { width: number; height: number; resolution: number; origin: ArrayLike<number>; grey_values: Uint8Array };
}

const [MAP, LASER] = ['map', 'laser'];
/** Of the grid's cells, in nav_msgs/OccupancyGrid: per cent, and unknown. */
const OCCUPANCY: Record<number, number> = { 0: 100, 254: 0 };
const UNKNOWN = 0xff; // -1 as int8
/** A field of a PointCloud2 that is a 32-bit float. */
const FLOAT32 = 7;

const TIME = 'builtin_interfaces/Time\nint32 sec\nuint32 nanosec';
const HEADER = ['std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id', TIME];
const QUATERNION = 'geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w';
const POSE = [
  'geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation',
  'geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z',
  QUATERNION,
];

/** The definition of a type, after common_interfaces and geometry2, with those that it is made of. */
function topic(name: string, type: string, fields: string, parts: readonly string[]): WrittenTopic {
  const text = [fields, ...parts.map((part) => `MSG: ${part}`)].join(`\n${'='.repeat(80)}\n`);
  return { name, type, encoding: 'cdr', schema: { encoding: 'ros2msg', data: new TextEncoder().encode(text) } };
}

const GRID = topic(
  '/map',
  'nav_msgs/msg/OccupancyGrid',
  'std_msgs/Header header\nnav_msgs/MapMetaData info\nint8[] data',
  [
    'nav_msgs/MapMetaData\nbuiltin_interfaces/Time map_load_time\nfloat32 resolution\nuint32 width\nuint32 height\ngeometry_msgs/Pose origin',
    ...HEADER,
    ...POSE,
  ],
);
const PATH = topic('/path', 'nav_msgs/msg/Path', 'std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses', [
  'geometry_msgs/PoseStamped\nstd_msgs/Header header\ngeometry_msgs/Pose pose',
  ...HEADER,
  ...POSE,
]);
const TF = topic('/tf', 'tf2_msgs/msg/TFMessage', 'geometry_msgs/TransformStamped[] transforms', [
  'geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform',
  'geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation',
  'geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z',
  QUATERNION,
  ...HEADER,
]);
const SCANS = topic(
  '/scan_points',
  'sensor_msgs/msg/PointCloud2',
  'std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense',
  ['sensor_msgs/PointField\nstring name\nuint32 offset\nuint8 datatype\nuint32 count', ...HEADER],
);

type Placed = { time: bigint; pose: number[] };

export function mapMcap({ trajectory, points, sizes, grid }: PlanarMap): Uint8Array<ArrayBuffer> {
  const parts: Uint8Array[] = [];
  const mcap = new McapWriter((bytes) => parts.push(bytes), 'ros2');
  const placed = trajectory
    .split('\n')
    .filter((line) => /^[^#]/.test(line))
    .map(placedOf);
  const [start = 0n, end = 0n] = [placed[0]?.time, placed.at(-1)?.time];
  mcap.message(GRID, start, gridMessage(grid, start));
  let first = 0;
  for (const [frame, { time, pose }] of placed.entries()) {
    const size = sizes[frame] ?? 0;
    if (size === 0) continue; // its place is not known
    mcap.message(
      TF,
      time,
      header(new CdrWriter().u32(1), time, MAP)
        .string(LASER)
        .f64(...pose)
        .done(),
    );
    mcap.message(SCANS, time, scanMessage(time, inFrame(points.subarray(2 * first, 2 * (first + size)), pose)));
    first += size;
  }
  mcap.message(
    PATH,
    end,
    pathMessage(
      placed.filter((_, frame) => (sizes[frame] ?? 0) > 0),
      end,
    ),
  );
  mcap.end();
  return joined(parts);
}

function placedOf(line: string): Placed {
  const [time = '', ...pose] = line.trim().split(/\s+/);
  return { time: nanoseconds(time), pose: pose.map(Number) };
}

/** By the digits, of which a number of seconds since 1970 would lose some; what is before 0 is 0, for ROS has no such times. */
function nanoseconds(text: string) {
  const [, seconds, fraction = ''] = /^(\d+)(?:\.(\d+))?$/.exec(text) ?? [];
  if (seconds === undefined) return BigInt(Math.max(0, Math.round(Number(text) * 1e9)));
  return BigInt(seconds) * 1_000_000_000n + BigInt(fraction.slice(0, 9).padEnd(9, '0'));
}

function header(writer: CdrWriter, time: bigint, frame: string) {
  return writer.time(time).string(frame);
}

function gridMessage({ width, height, resolution, origin, grey_values: grey }: PlanarMap['grid'], time: bigint) {
  const cells = new Uint8Array(width * height);
  for (let row = 0; row < height; row += 1) {
    for (let column = 0; column < width; column += 1) {
      // ROS begins with the least y.
      cells[(height - 1 - row) * width + column] = OCCUPANCY[grey[row * width + column] ?? 205] ?? UNKNOWN;
    }
  }
  const writer = header(new CdrWriter(), time, MAP).time(time).f32(resolution).u32(width, height);
  return writer
    .f64(origin[0] ?? 0, origin[1] ?? 0, 0, 0, 0, 0, 1)
    .bytes(cells)
    .done();
}

function scanMessage(time: bigint, points: Float32Array) {
  const writer = header(new CdrWriter(), time, LASER).u32(1, points.length / 3, 3);
  for (const [index, name] of ['x', 'y', 'z'].entries())
    writer
      .string(name)
      .u32(4 * index)
      .u8(FLOAT32)
      .u32(1);
  const bytes = new Uint8Array(points.buffer, points.byteOffset, points.byteLength);
  return writer.u8(0).u32(12, points.byteLength).bytes(bytes).u8(1).done();
}

function pathMessage(placed: readonly Placed[], end: bigint) {
  const writer = header(new CdrWriter(), end, MAP).u32(placed.length);
  for (const { time, pose } of placed) header(writer, time, MAP).f64(...pose);
  return writer.done();
}

/** x y z of points of the world, as the laser saw them. */
function inFrame(points: Float32Array, [x = 0, y = 0, , , , qz = 0, qw = 1]: number[]) {
  const [sin, cos] = [2 * qz * qw, qw * qw - qz * qz];
  return Float32Array.from({ length: (3 * points.length) / 2 }, (_, index) => {
    const point = 2 * Math.floor(index / 3);
    const [dx, dy] = [(points[point] ?? 0) - x, (points[point + 1] ?? 0) - y];
    return [cos * dx + sin * dy, cos * dy - sin * dx, 0][index % 3] ?? 0;
  });
}
