// @ts-check
/** A made-up room that a depth camera walks through, as PNG files, with the true path. */
import { deflateSync } from 'node:zlib';
import { crc32 } from '../../npm/base/crc32.js';

export const SIZE = 192;
/** Walls seen from inside, and furniture seen from outside: lower and upper corners (m; x right, y down, z forward). */
const ROOM = /** @type {const} */ ([-2, -1.3, -2, 2.4, 1.2, 3.2]);
const FURNITURE = /** @type {const} */ ([
  [-2, 0.2, 2.2, -0.9, 1.2, 3.2],
  [0.5, 0.3, 1.3, 1.1, 1.2, 1.9],
  [1.8, -1.3, 2.4, 2.4, 1.2, 3.2],
  [-1.6, -0.4, 0.6, -1.2, 1.2, 1.2],
  [-0.4, -1.3, 2.5, 0.2, -0.6, 3.2],
  [0.1, -0.2, 2.6, 0.5, 0.2, 3.2],
  [1.4, -0.9, 1.6, 1.8, -0.5, 2],
]);

/** @typedef {readonly [x: number, y: number, z: number, yaw: number]} Pose yaw: to the right (rad) */

/** @type {readonly Pose[]} */
export const WALK = [
  [0, 0, 0, 0],
  [0.04, 0, 0.08, 0.03],
  [0.06, 0.01, 0.16, 0.07],
  [0.1, 0.02, 0.23, 0.1],
  [0.12, 0.02, 0.3, 0.15],
  [0.12, 0.01, 0.38, 0.22],
];

/** The true path as TUM writes it. @param {readonly Pose[]} poses */
export function truthOf(poses) {
  return poses
    .map(([x, y, z, yaw], index) => `${index} ${x} ${y} ${z} 0 ${Math.sin(yaw / 2)} 0 ${Math.cos(yaw / 2)}\n`)
    .join('');
}

/**
 * What the camera sees: depth along its axis in millimetres, and colours. Its view spans a right angle: what the engine
 * takes a square image for.
 * @param {Pose} pose
 * @param {number} [width]
 * @param {number} [height]
 */
export function see([x, y, z, yaw], width = SIZE, height = SIZE) {
  const depth = new Uint16Array(width * height);
  const colours = new Uint8Array(3 * width * height);
  const focal = width / 2;
  const [origin, ray] = [Float64Array.of(x, y, z), new Float64Array(3)];
  const [sin, cos] = [Math.sin(yaw), Math.cos(yaw)];
  for (let pixel = 0; pixel < width * height; pixel += 1) {
    const u = ((pixel % width) - width / 2) / focal;
    ray[0] = u * cos + sin;
    ray[1] = (Math.floor(pixel / width) - height / 2) / focal;
    ray[2] = cos - u * sin;
    let reach = exit(ROOM, origin, ray);
    for (const box of FURNITURE) reach = Math.min(reach, entry(box, origin, ray));
    depth[pixel] = Math.round(1000 * reach);
    for (let axis = 0; axis < 3; axis += 1) {
      const seen = (ray[axis] ?? 0) * reach + (origin[axis] ?? 0);
      colours[3 * pixel + axis] = 128 + 100 * Math.sin(4 * seen);
    }
  }
  return { depth, colours };
}

/** @typedef {readonly [number, number, number, number, number, number]} Box */

/** Where a ray crosses a box's pairs of sides. @param {Box} box @param {Float64Array} origin @param {Float64Array} ray */
function crossings(box, origin, ray) {
  let [near, far] = [-Infinity, Infinity];
  for (let axis = 0; axis < 3; axis += 1) {
    const [start, along] = [origin[axis] ?? 0, ray[axis] || 1e-12];
    const [lower, upper] = [((box[axis] ?? 0) - start) / along, ((box[axis + 3] ?? 0) - start) / along];
    near = Math.max(near, Math.min(lower, upper));
    far = Math.min(far, Math.max(lower, upper));
  }
  return { near, far };
}

/** @param {Box} box @param {Float64Array} origin @param {Float64Array} ray */
function exit(box, origin, ray) {
  return crossings(box, origin, ray).far;
}

/** @param {Box} box @param {Float64Array} origin @param {Float64Array} ray */
function entry(box, origin, ray) {
  const { near, far } = crossings(box, origin, ray);
  return near > 0 && near < far ? near : Number.POSITIVE_INFINITY;
}

/** @param {Uint16Array} values @param {number} [width] @param {8 | 16} [bits] */
export function greyPng(values, width = SIZE, bits = 16) {
  const rows = Array.from({ length: values.length / width }, (_, row) => {
    const of = [...values.subarray(row * width, (row + 1) * width)];
    return Uint8Array.of(0, ...(bits === 8 ? of : of.flatMap((value) => [value >> 8, value & 255])));
  });
  return png(width, rows, bits, 0);
}

/** 8 bits of red, green and blue. @param {Uint8Array} values @param {number} [width] */
export function colourPng(values, width = SIZE) {
  const rows = Array.from({ length: values.length / 3 / width }, (_, row) => {
    return Uint8Array.of(0, ...values.subarray(3 * width * row, 3 * width * (row + 1)));
  });
  return png(width, rows, 8, 2);
}

/** @param {number} width @param {Uint8Array[]} rows @param {number} bits @param {number} colourType */
function png(width, rows, bits, colourType) {
  const header = new DataView(new ArrayBuffer(13));
  header.setUint32(0, width);
  header.setUint32(4, rows.length);
  header.setUint8(8, bits);
  header.setUint8(9, colourType);
  const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
  const parts = [
    chunk('IHDR', new Uint8Array(header.buffer)),
    chunk('IDAT', deflateSync(Buffer.concat(rows))),
    chunk('IEND', new Uint8Array()),
  ];
  return Buffer.concat([signature, ...parts]);
}

/** @param {string} type @param {Uint8Array} data */
function chunk(type, data) {
  const body = Buffer.concat([Buffer.from(type), data]);
  const framed = Buffer.alloc(body.length + 8);
  framed.writeUInt32BE(data.length);
  body.copy(framed, 4);
  framed.writeUInt32BE(crc32(body), body.length + 4);
  return framed;
}

/** What the camera sees at each pose of the walk. */
export const VIEWS = WALK.map((pose) => see(pose));

/**
 * The walk as files: rgb/N.png and depth/N.png from 1, and the truth.
 * @returns {Record<string, Uint8Array | string>}
 */
export function walkFiles() {
  const images = VIEWS.flatMap(({ depth, colours }, index) => [
    [`depth/${index + 1}.png`, greyPng(depth)],
    [`rgb/${index + 1}.png`, colourPng(colours)],
  ]);
  return { ...Object.fromEntries(images), 'groundtruth.txt': truthOf(WALK) };
}
