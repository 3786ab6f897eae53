// @ts-check
/**
 * Messages of ROS that tell where a sensor was or what it saw, from their bytes to plain values.
 *
 * Source of the fields: common_interfaces (sensor_msgs, geometry_msgs, nav_msgs, std_msgs) and geometry2 (tf2_msgs). Those of
 * ROS 1 are the same but for the header's number.
 */
import { CdrReader, MessageError } from './cdr.js';

/** @typedef {{ sec: number, nsec: number }} Stamp */
/** @typedef {{ stamp: Stamp, frame: string }} Header */
/** @typedef {[number, number, number]} Vector */
/** x y z w @typedef {[number, number, number, number]} Quaternion */
/** @typedef {{ translation: Vector, rotation: Quaternion }} Transform */
/** @typedef {{ height: number, width: number, encoding: string }} ImageShape */
/** @typedef {Header & ImageShape & { bigEndian: boolean, step: number, data: Uint8Array }} ImageMessage step: bytes of a row */
/** @typedef {Header & { format: string, data: Uint8Array }} CompressedMessage */
/** @typedef {{ name: string, offset: number, datatype: number, count: number }} PointField */
/** @typedef {Header & { height: number, width: number, fields: PointField[], bigEndian: boolean, pointStep: number, rowStep: number, data: Uint8Array }} CloudMessage */
/** @typedef {{ x: number, y: number, height: number, width: number }} Region of an image; height and width 0: the whole image */
/** @typedef {Header & { height: number, width: number, model: string, d: number[], k: number[], p: number[], binning: [number, number], region: Region }} CameraMessage */
/** @typedef {Header & { angleMin: number, angleIncrement: number, rangeMin: number, rangeMax: number, ranges: Float32Array }} ScanMessage */
/** @typedef {Header & { child: string, pose: Transform }} PoseMessage child: empty where the message names no frame */

/** Bytes of a message that hold its header and the encoding of its image, with names of usual length. */
export const HEAD_BYTES = 1024;

/** So many bytes of a message hold its time. */
export const STAMP_BYTES = 16;

/** A field of a PointCloud2 that is a 32-bit float (sensor_msgs/PointField). */
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
  'nav_msgs/msg/Odometry': 'pose',
  'geometry_msgs/msg/PoseStamped': 'pose',
  'geometry_msgs/msg/PoseWithCovarianceStamped': 'pose',
  'geometry_msgs/msg/TransformStamped': 'pose',
  'nav_msgs/msg/Path': 'path',
  'tf2_msgs/msg/TFMessage': 'transforms',
});

/** @param {CdrReader} r @returns {Header} */
function readHeader(r) {
  return { stamp: readStamp(r), frame: r.string('frame_id') };
}

/** @param {CdrReader} r @returns {Stamp} */
function readStamp(r) {
  if (r.isRos1) r.u32('seq');
  return { sec: r.i32('stamp'), nsec: r.u32('stamp') };
}

/** The time of any message that has a header, from its first {@link STAMP_BYTES}. @param {Uint8Array} bytes */
export function decodeStamp(bytes) {
  return readStamp(new CdrReader(bytes));
}

/** The header of any message that has one, or of its beginning. @param {Uint8Array} bytes */
export function decodeHeader(bytes) {
  return readHeader(new CdrReader(bytes));
}

/** @param {CdrReader} r @returns {Header & ImageShape} */
function readImageShape(r) {
  return { ...readHeader(r), height: r.u32('height'), width: r.u32('width'), encoding: r.string('encoding') };
}

/** What an image is, from its beginning. @param {Uint8Array} bytes */
export function decodeImageShape(bytes) {
  return readImageShape(new CdrReader(bytes));
}

/** @param {Uint8Array} bytes @returns {ImageMessage} */
export function decodeImage(bytes) {
  const r = new CdrReader(bytes);
  const shape = readImageShape(r);
  return { ...shape, bigEndian: r.u8('is_bigendian') !== 0, step: r.u32('step'), data: r.bytes('data') };
}

/** Format of a packed image, and as much of its data as its beginning has. @param {Uint8Array} bytes */
export function decodeCompressedHead(bytes) {
  const r = new CdrReader(bytes);
  const head = { ...readHeader(r), format: r.string('format') };
  r.u32('data');
  return { ...head, start: bytes.subarray(r.place) };
}

/** @param {Uint8Array} bytes @returns {CompressedMessage} */
export function decodeCompressed(bytes) {
  const r = new CdrReader(bytes);
  return { ...readHeader(r), format: r.string('format'), data: r.bytes('data') };
}

/** @param {CdrReader} r */
function readCloudShape(r) {
  const shape = { ...readHeader(r), height: r.u32('height'), width: r.u32('width') };
  const fields = Array.from({ length: r.count(13, 'fields') }, () => ({
    name: r.string('name of a field'),
    offset: r.u32('offset of a field'),
    datatype: r.u8('datatype of a field'),
    count: r.u32('count of a field'),
  }));
  return { ...shape, fields };
}

/** What a cloud is, from its beginning. @param {Uint8Array} bytes */
export function decodeCloudShape(bytes) {
  return readCloudShape(new CdrReader(bytes));
}

/** @param {Uint8Array} bytes @returns {CloudMessage} */
export function decodeCloud(bytes) {
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

/** @param {Uint8Array} bytes @returns {CameraMessage} */
export function decodeCamera(bytes) {
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
  /** @type {[number, number]} */
  const binning = [r.u32('binning_x'), r.u32('binning_y')];
  const [x, y] = [r.u32('roi.x_offset'), r.u32('roi.y_offset')];
  const region = { x, y, height: r.u32('roi.height'), width: r.u32('roi.width') };
  return { ...header, d, k, p, binning, region };
}

/** Points of Livox' own message, as a cloud of x y z (Livox ROS driver: CustomMsg, CustomPoint). @param {Uint8Array} bytes @returns {CloudMessage} */
export function decodeLivoxCloud(bytes) {
  const r = new CdrReader(bytes);
  const header = readHeader(r);
  r.f64('timebase'); // eight bytes
  r.u32('point_num');
  for (const field of ['lidar_id', 'rsvd', 'rsvd', 'rsvd']) r.u8(field);
  const width = r.count(19, 'points');
  const data = new Float32Array(3 * width);
  for (let point = 0; point < width; point += 1) {
    r.u32('offset_time');
    for (let axis = 0; axis < 3; axis += 1) data[3 * point + axis] = r.f32('a point');
    for (const field of ['reflectivity', 'tag', 'line']) r.u8(field);
  }
  const fields = ['x', 'y', 'z'].map((name, at) => ({ name, offset: 4 * at, datatype: FLOAT32, count: 1 }));
  const layout = { height: 1, width, fields, bigEndian: false, pointStep: 12, rowStep: 12 * width };
  return { ...header, ...layout, data: new Uint8Array(data.buffer) };
}

/** @param {Uint8Array} bytes @param {boolean} [hasEchoes] whether a reading has several, of which the first is taken @returns {ScanMessage} */
export function decodeScan(bytes, hasEchoes = false) {
  const r = new CdrReader(bytes);
  const header = readHeader(r);
  const angleMin = r.f32('angle_min');
  r.f32('angle_max'); // told by the number of readings, and often wrong by one
  const angleIncrement = r.f32('angle_increment');
  r.f32('time_increment');
  r.f32('scan_time');
  return {
    ...header,
    angleMin,
    angleIncrement,
    rangeMin: r.f32('range_min'),
    rangeMax: r.f32('range_max'),
    ranges: hasEchoes ? firstEchoes(r) : r.f32Sequence('ranges'),
  };
}

/** @param {CdrReader} r */
function firstEchoes(r) {
  const ranges = new Float32Array(r.count(4, 'ranges'));
  return ranges.map(() => r.f32Sequence('echoes')[0] ?? Number.NaN);
}

/** @param {CdrReader} r @returns {Transform} */
function readTransform(r) {
  return {
    translation: [r.f64('x'), r.f64('y'), r.f64('z')],
    rotation: [r.f64('qx'), r.f64('qy'), r.f64('qz'), r.f64('qw')],
  };
}

/** @param {CdrReader} r @returns {PoseMessage} */
function readTransformStamped(r) {
  return { ...readHeader(r), child: r.string('child_frame_id'), pose: readTransform(r) };
}

/**
 * The poses of a message of one of these types: one, or those of a path or of several transforms.
 * @param {string} type
 * @param {Uint8Array} bytes
 * @returns {PoseMessage[]}
 */
export function decodePoses(type, bytes) {
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
