// @ts-check
/** Messages of ROS 2 as the tests need them, serialised as CDR. */

/** @typedef {{ sec: number, nsec: number }} Stamp */

export class CdrWriter {
  #bytes;
  #length = 4;
  #view;
  #isLittle;

  /** @param {boolean} [isLittle] @param {number} [capacity] */
  constructor(isLittle = true, capacity = 4096) {
    this.#bytes = new Uint8Array(capacity);
    this.#view = new DataView(this.#bytes.buffer);
    this.#isLittle = isLittle;
    this.#bytes[1] = isLittle ? 1 : 0;
  }

  /** @param {number} size @param {number} alignment */
  #take(size, alignment) {
    const start = this.#length + ((4 - this.#length) & (alignment - 1));
    if (start + size > this.#bytes.length) {
      const larger = new Uint8Array(2 * (start + size));
      larger.set(this.#bytes);
      this.#bytes = larger;
      this.#view = new DataView(larger.buffer);
    }
    this.#length = start + size;
    return start;
  }

  /** @param {number} value */
  u8(value) {
    const place = this.#take(1, 1);
    this.#view.setUint8(place, value);
    return this;
  }

  /** @param {number} value */
  u32(value) {
    const place = this.#take(4, 4);
    this.#view.setUint32(place, value, this.#isLittle);
    return this;
  }

  /** @param {number} value */
  f32(value) {
    const place = this.#take(4, 4);
    this.#view.setFloat32(place, value, this.#isLittle);
    return this;
  }

  /** @param {number[]} values */
  f64(...values) {
    for (const value of values) {
      const place = this.#take(8, 8);
      this.#view.setFloat64(place, value, this.#isLittle);
    }
    return this;
  }

  /** @param {string} text */
  string(text) {
    return this.bytes(new TextEncoder().encode(`${text}\0`));
  }

  /** @param {Uint8Array} bytes */
  bytes(bytes) {
    this.u32(bytes.length);
    const place = this.#take(bytes.length, 1);
    this.#bytes.set(bytes, place);
    return this;
  }

  /** @param {Stamp} stamp @param {string} frame */
  header({ sec, nsec }, frame) {
    return this.u32(sec).u32(nsec).string(frame);
  }

  done() {
    return this.#bytes.slice(0, this.#length);
  }
}

/** @param {number} seconds @returns {Stamp} */
export function stampAt(seconds) {
  return { sec: Math.floor(seconds), nsec: Math.round((seconds % 1) * 1e9) };
}

/**
 * @param {{ stamp: Stamp, width: number, height: number, encoding: string, data: Uint8Array, step?: number, bigEndian?: boolean,
 *   frame?: string, isLittle?: boolean }} image
 */
export function image({
  stamp,
  width,
  height,
  encoding,
  data,
  step = 0,
  bigEndian = false,
  frame = 'camera',
  isLittle = true,
}) {
  const writer = new CdrWriter(isLittle, data.length + 256)
    .header(stamp, frame)
    .u32(height)
    .u32(width)
    .string(encoding);
  return writer.u8(Number(bigEndian)).u32(step).bytes(data).done();
}

/** @param {Stamp} stamp @param {string} format @param {Uint8Array} data */
export function compressedImage(stamp, format, data) {
  return new CdrWriter(true, data.length + 256).header(stamp, 'camera').string(format).bytes(data).done();
}

/**
 * @param {Stamp} stamp @param {number} width @param {number} height @param {[number, number, number, number]} camera fx fy cx cy
 * @param {number[]} [region] x y height width
 * @param {[number, number]} [binning]
 */
export function cameraInfo(stamp, width, height, [fx, fy, cx, cy], region = [0, 0, 0, 0], [binX, binY] = [0, 0]) {
  const writer = new CdrWriter().header(stamp, 'camera').u32(height).u32(width).string('plumb_bob').u32(0);
  writer.f64(fx, 0, cx, 0, fy, cy, 0, 0, 1).f64(1, 0, 0, 0, 1, 0, 0, 0, 1).f64(fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0);
  writer.u32(binX).u32(binY);
  for (const value of region) writer.u32(value);
  return writer.u8(0).done();
}

/**
 * @param {{ stamp: Stamp, width: number, height?: number, fields: [name: string, offset: number, datatype: number, count?: number][],
 *   pointStep: number, rowStep?: number, data: Uint8Array, bigEndian?: boolean, frame?: string }} cloud
 */
export function pointCloud({
  stamp,
  width,
  height = 1,
  fields,
  pointStep,
  rowStep = width * pointStep,
  data,
  bigEndian = false,
  frame = 'lidar',
}) {
  const writer = new CdrWriter(true, data.length + 1024).header(stamp, frame).u32(height).u32(width).u32(fields.length);
  for (const [name, offset, datatype, count = 1] of fields) writer.string(name).u32(offset).u8(datatype).u32(count);
  return writer.u8(Number(bigEndian)).u32(pointStep).u32(rowStep).bytes(data).u8(1).done();
}

/** @param {Stamp} stamp @param {number} angleMin @param {number} increment @param {[number, number]} limits @param {number[]} ranges */
export function laserScan(stamp, angleMin, increment, [rangeMin, rangeMax], ranges, frame = 'laser') {
  const writer = new CdrWriter()
    .header(stamp, frame)
    .f32(angleMin)
    .f32(angleMin + increment * ranges.length)
    .f32(increment);
  writer.f32(0).f32(0.1).f32(rangeMin).f32(rangeMax).u32(ranges.length);
  for (const range of ranges) writer.f32(range);
  return writer.u32(0).done();
}

/** x y z qx qy qz qw @typedef {[number, number, number, number, number, number, number]} Pose */

/** @param {Stamp} stamp @param {string} frame @param {string} child @param {Pose} pose */
export function odometry(stamp, frame, child, pose) {
  const writer = new CdrWriter()
    .header(stamp, frame)
    .string(child)
    .f64(...pose, ...Array(36).fill(0));
  return writer.f64(...Array(6).fill(0), ...Array(36).fill(0)).done();
}

/** Without an orientation and an acceleration; `isMissing`: without an angular velocity either. @param {Stamp} stamp @param {string} frame @param {number[]} rate rad/s */
export function imu(stamp, frame, rate, isMissing = false) {
  const [unknown, zeros] = [[-1, ...Array(8).fill(0)], Array(9).fill(0)];
  const head = new CdrWriter().header(stamp, frame).f64(0, 0, 0, 1, ...unknown);
  const writer = head.f64(...rate, ...(isMissing ? unknown : zeros));
  return writer.f64(0, 0, 9.81, ...zeros).done();
}

/** @param {Stamp} stamp @param {string} frame @param {Pose} pose */
export function poseStamped(stamp, frame, pose) {
  return new CdrWriter()
    .header(stamp, frame)
    .f64(...pose)
    .done();
}

/** @param {[stamp: Stamp, frame: string, child: string, pose: Pose][]} transforms */
export function transforms(transforms) {
  const writer = new CdrWriter().u32(transforms.length);
  for (const [stamp, frame, child, pose] of transforms)
    writer
      .header(stamp, frame)
      .string(child)
      .f64(...pose);
  return writer.done();
}
