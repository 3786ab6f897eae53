/**
 * Messages of ROS that tell where a sensor was or what it saw, from their bytes to plain values.
 *
 * Source of the fields: common_interfaces (sensor_msgs, geometry_msgs, nav_msgs, std_msgs) and geometry2 (tf2_msgs). Those of
 * ROS 1 are the same but for the header's number.
 */
import { CdrReader, MessageError } from './cdr.js';

export type Stamp = { sec: number; nsec: number };
type Header = { stamp: Stamp; frame: string };
export type Vector = [number, number, number];
/** x y z w */
export type Quaternion = [number, number, number, number];
export type Transform = { translation: Vector; rotation: Quaternion };
type ImageShape = { height: number; width: number; encoding: string };
/** step: bytes of a row */
export type ImageMessage = Header & ImageShape & { bigEndian: boolean; step: number; data: Uint8Array };
export type CompressedMessage = Header & { format: string; data: Uint8Array };
type PointField = { name: string; offset: number; datatype: number; count: number };
export type CloudMessage = Header & {
  height: number;
  width: number;
  fields: PointField[];
  bigEndian: boolean;
  pointStep: number;
  rowStep: number;
  data: Uint8Array;
};
/** Of an image; height and width 0: the whole image. */
type Region = { x: number; y: number; height: number; width: number };
export type CameraMessage = Header & {
  height: number;
  width: number;
  model: string;
  d: number[];
  k: number[];
  p: number[];
  binning: [number, number];
  region: Region;
};
/** rate: angular velocity in the frame of the message (rad/s); null where it says that it has none */
export type ImuMessage = Header & { rate: Vector | null };
export type ScanMessage = Header & {
  angleMin: number;
  /** Told by the number of readings as well, and often wrong by one. */
  angleMax: number;
  angleIncrement: number;
  rangeMin: number;
  rangeMax: number;
  ranges: Float32Array;
};
/** child: empty where the message names no frame */
export type PoseMessage = Header & { child: string; pose: Transform };

/** Bytes of a message that hold its header and the encoding of its image, with names of usual length. */
export const HEAD_BYTES = 1024;

/** So many bytes of a message hold its time. */
export const STAMP_BYTES = 16;

/** Bytes of a value of a PointCloud2, by PointField's number of its type. */
export const BYTES_OF_TYPE: Record<number, number> = { 1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 8: 8 };
/** Types of fields of a PointCloud2 (sensor_msgs/PointField). */
const UINT32 = 6;
const FLOAT32 = 7;

/** Types that are read, and what they are to people. */
export const TYPES = Object.freeze({
  'sensor_msgs/msg/Image': 'image',
  'sensor_msgs/msg/CompressedImage': 'packed image',
  'sensor_msgs/msg/CameraInfo': 'camera',
  'sensor_msgs/msg/PointCloud2': 'cloud',
  'livox_ros_driver/msg/CustomMsg': 'livox cloud',
  'livox_ros_driver2/msg/CustomMsg': 'livox cloud',
  'sensor_msgs/msg/LaserScan': 'laser scan',
  'sensor_msgs/msg/MultiEchoLaserScan': 'laser scan',
  'sensor_msgs/msg/Imu': 'imu',
  'nav_msgs/msg/Odometry': 'pose',
  'geometry_msgs/msg/PoseStamped': 'pose',
  'geometry_msgs/msg/PoseWithCovarianceStamped': 'pose',
  'geometry_msgs/msg/TransformStamped': 'pose',
  'nav_msgs/msg/Path': 'path',
  'tf2_msgs/msg/TFMessage': 'transforms',
});

function readHeader(r: CdrReader): Header {
  return { stamp: readStamp(r), frame: r.string('frame_id') };
}

function readStamp(r: CdrReader): Stamp {
  if (r.isRos1) r.u32('seq');
  return { sec: r.i32('stamp'), nsec: r.u32('stamp') };
}

/** The time of any message that has a header, from its first {@link STAMP_BYTES}. */
export function decodeStamp(bytes: Uint8Array) {
  return readStamp(new CdrReader(bytes));
}

/** The header of any message that has one, or of its beginning. */
export function decodeHeader(bytes: Uint8Array) {
  return readHeader(new CdrReader(bytes));
}

function readImageShape(r: CdrReader): Header & ImageShape {
  return { ...readHeader(r), height: r.u32('height'), width: r.u32('width'), encoding: r.string('encoding') };
}

/** What an image is, from its beginning. */
export function decodeImageShape(bytes: Uint8Array) {
  return readImageShape(new CdrReader(bytes));
}

export function decodeImage(bytes: Uint8Array): ImageMessage {
  const r = new CdrReader(bytes);
  const shape = readImageShape(r);
  return { ...shape, bigEndian: r.u8('is_bigendian') !== 0, step: r.u32('step'), data: r.bytes('data') };
}

/** Format of a packed image, and as much of its data as its beginning has. */
export function decodeCompressedHead(bytes: Uint8Array) {
  const r = new CdrReader(bytes);
  const head = { ...readHeader(r), format: r.string('format') };
  r.u32('data');
  return { ...head, start: bytes.subarray(r.place) };
}

export function decodeCompressed(bytes: Uint8Array): CompressedMessage {
  const r = new CdrReader(bytes);
  return { ...readHeader(r), format: r.string('format'), data: r.bytes('data') };
}

function readCloudShape(r: CdrReader) {
  const shape = { ...readHeader(r), height: r.u32('height'), width: r.u32('width') };
  const fields = Array.from({ length: r.count(13, 'fields') }, () => ({
    name: r.string('name of a field'),
    offset: r.u32('offset of a field'),
    datatype: r.u8('datatype of a field'),
    count: r.u32('count of a field'),
  }));
  const isSplit = fields.some(({ name }) => name === 'y');
  return { ...shape, fields: isSplit ? fields : fields.flatMap(splitPosition) };
}

/** Names of a field that holds a whole position. */
const POSITION = /^(x|xyz|points?|positions?)$/i;

/** A field of three or four values that is a position, as fields x, y and z; others as they are. */
function splitPosition(field: PointField) {
  const bytes = BYTES_OF_TYPE[field.datatype] ?? 0;
  if (!POSITION.test(field.name) || field.count < 3 || field.count > 4) return [field];
  return ['x', 'y', 'z'].map((name, at) => ({ ...field, name, offset: field.offset + at * bytes, count: 1 }));
}

/** What a cloud is, from its beginning. */
export function decodeCloudShape(bytes: Uint8Array) {
  return readCloudShape(new CdrReader(bytes));
}

export function decodeCloud(bytes: Uint8Array): CloudMessage {
  const r = new CdrReader(bytes);
  const shape = readCloudShape(r);
  return {
    ...shape,
    bigEndian: r.u8('is_bigendian') !== 0,
    pointStep: r.u32('point_step'),
    rowStep: r.u32('row_step'),
    data: r.bytes('data'),
  };
}

export function decodeCamera(bytes: Uint8Array): CameraMessage {
  const r = new CdrReader(bytes);
  const header = {
    ...readHeader(r),
    height: r.u32('height'),
    width: r.u32('width'),
    model: r.string('distortion_model'),
  };
  const [d, k] = [r.f64Sequence('d'), r.f64s(9, 'k')];
  r.f64s(9, 'r');
  const p = r.f64s(12, 'p');
  const binning: [number, number] = [r.u32('binning_x'), r.u32('binning_y')];
  const [x, y] = [r.u32('roi.x_offset'), r.u32('roi.y_offset')];
  const region = { x, y, height: r.u32('roi.height'), width: r.u32('roi.width') };
  return { ...header, d, k, p, binning, region };
}

/** Points of Livox' own message, as a cloud of x y z and their times, ns from the stamp (Livox ROS driver: CustomMsg, CustomPoint). */
export function decodeLivoxCloud(bytes: Uint8Array): CloudMessage {
  const r = new CdrReader(bytes);
  const header = readHeader(r);
  r.f64('timebase'); // eight bytes
  r.u32('point_num');
  for (const field of ['lidar_id', 'rsvd', 'rsvd', 'rsvd']) r.u8(field);
  const width = r.count(19, 'points');
  const data = new Uint8Array(16 * width);
  const view = new DataView(data.buffer);
  for (let point = 0; point < width; point += 1) {
    view.setUint32(16 * point + 12, r.u32('offset_time'), true);
    for (let axis = 0; axis < 3; axis += 1) view.setFloat32(16 * point + 4 * axis, r.f32('a point'), true);
    for (const field of ['reflectivity', 'tag', 'line']) r.u8(field);
  }
  const field = (name: string, at: number, datatype: number) => ({ name, offset: 4 * at, datatype, count: 1 });
  const fields = [...['x', 'y', 'z'].map((name, at) => field(name, at, FLOAT32)), field('offset_time', 3, UINT32)];
  const layout = { height: 1, width, fields, bigEndian: false, pointStep: 16, rowStep: 16 * width };
  return { ...header, ...layout, data };
}

export function decodeImu(bytes: Uint8Array): ImuMessage {
  const r = new CdrReader(bytes);
  const header = readHeader(r);
  r.f64s(4, 'orientation');
  r.f64s(9, 'orientation_covariance');
  const [x = 0, y = 0, z = 0] = r.f64s(3, 'angular_velocity');
  // By its definition, -1 first stands for a measurement that is missing.
  const [isKnown] = r.f64s(9, 'angular_velocity_covariance');
  return { ...header, rate: isKnown === -1 ? null : [x, y, z] };
}

/** @param hasEchoes whether a reading has several, of which the first is taken */
export function decodeScan(bytes: Uint8Array, hasEchoes = false): ScanMessage {
  const r = new CdrReader(bytes);
  const header = readHeader(r);
  const angleMin = r.f32('angle_min');
  const angleMax = r.f32('angle_max');
  const angleIncrement = r.f32('angle_increment');
  r.f32('time_increment');
  r.f32('scan_time');
  return {
    ...header,
    angleMin,
    angleMax,
    angleIncrement,
    rangeMin: r.f32('range_min'),
    rangeMax: r.f32('range_max'),
    ranges: hasEchoes ? firstEchoes(r) : r.f32Sequence('ranges'),
  };
}

function firstEchoes(r: CdrReader) {
  const ranges = new Float32Array(r.count(4, 'ranges'));
  return ranges.map(() => r.f32Sequence('echoes')[0] ?? Number.NaN);
}

function readTransform(r: CdrReader): Transform {
  return {
    translation: [r.f64('x'), r.f64('y'), r.f64('z')],
    rotation: [r.f64('qx'), r.f64('qy'), r.f64('qz'), r.f64('qw')],
  };
}

function readTransformStamped(r: CdrReader): PoseMessage {
  return { ...readHeader(r), child: r.string('child_frame_id'), pose: readTransform(r) };
}

/** The poses of a message of one of these types: one, or those of a path or of several transforms. */
export function decodePoses(type: string, bytes: Uint8Array): PoseMessage[] {
  const r = new CdrReader(bytes);
  switch (type) {
    case 'nav_msgs/msg/Odometry':
    case 'geometry_msgs/msg/TransformStamped':
      return [readTransformStamped(r)];
    case 'geometry_msgs/msg/PoseStamped':
    case 'geometry_msgs/msg/PoseWithCovarianceStamped':
      return [{ ...readHeader(r), child: '', pose: readTransform(r) }];
    case 'nav_msgs/msg/Path': {
      const { frame } = readHeader(r);
      return Array.from({ length: r.count(68, 'poses') }, () => {
        const header = readHeader(r);
        return { ...header, frame: header.frame || frame, child: '', pose: readTransform(r) };
      });
    }
    case 'tf2_msgs/msg/TFMessage':
      return Array.from({ length: r.count(72, 'transforms') }, () => readTransformStamped(r));
    default:
      throw new MessageError(`${type} holds no poses`, 'Choose another topic');
  }
}
