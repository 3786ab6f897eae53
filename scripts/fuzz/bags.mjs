// @ts-check
/** Damaged messages of ROS 2, and damaged bags. What is wrong must be told as an error about the file. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { CdrReader, MessageError } from '../../npm/bag/cdr.js';
import { cloudFile } from '../../npm/bag/clouds.js';
import { colorFile, depthFile } from '../../npm/bag/images.js';
import { scanLine } from '../../npm/bag/laser_scans.js';
import {
  decodeCamera,
  decodeCloud,
  decodeCompressed,
  decodeImage,
  decodePoses,
  decodeScan,
} from '../../npm/bag/messages.js';
import { openBags } from '../../npm/bag/open.js';
import { packedFile } from '../../npm/bag/packed_images.js';
import { bagFile, db3Bytes, mcapBytes } from '../../tests/cli/bag_files.mjs';
import * as make from '../../tests/cli/bag_messages.mjs';
import { greyPng } from '../../tests/cli/depth_room.mjs';
import { ROOT } from '../steps.mjs';
import { mustBeTold } from './random.mjs';

const stamp = make.stampAt(3.5);
const grey = (/** @type {string} */ encoding, /** @type {number} */ bytes) =>
  make.image({ stamp, width: 6, height: 5, encoding, data: new Uint8Array(30 * bytes).fill(9) });
const fields = /** @type {[string, number, number][]} */ ([
  ['x', 0, 7],
  ['y', 4, 7],
  ['z', 8, 7],
  ['ring', 14, 4],
]);
const config = new Uint8Array(12).fill(65);
const png = greyPng(new Uint16Array(48).fill(777), 8);
/** @type {[string, Uint8Array, (bytes: Uint8Array) => unknown][]} */
const MESSAGES = [
  ['16UC1', grey('16UC1', 2), (bytes) => depthFile(decodeImage(bytes))],
  ['32FC1', grey('32FC1', 4), (bytes) => depthFile(decodeImage(bytes))],
  ['rgb8', grey('rgb8', 3), (bytes) => colorFile(decodeImage(bytes))],
  ['yuv422', grey('yuv422', 2), (bytes) => colorFile(decodeImage(bytes))],
  [
    'packed',
    make.compressedImage(stamp, '32FC1; compressedDepth png', Buffer.concat([config, png])),
    (bytes) => packedFile(decodeCompressed(bytes)),
  ],
  [
    'rvl',
    make.compressedImage(
      stamp,
      '16UC1; compressedDepth rvl',
      Buffer.concat([config, Uint8Array.of(4, 0, 0, 0, 2, 0, 0, 0), new Uint8Array(40).fill(37)]),
    ),
    (bytes) => packedFile(decodeCompressed(bytes)),
  ],
  [
    'cloud',
    make.pointCloud({ stamp, width: 7, height: 2, pointStep: 18, rowStep: 130, data: new Uint8Array(260), fields }),
    (bytes) => cloudFile(decodeCloud(bytes)),
  ],
  ['camera', make.cameraInfo(stamp, 4, 3, [5, 5, 2, 1]), decodeCamera],
  ['scan', make.laserScan(stamp, -1, 0.1, [0, 9], [1, 2, 3, 4]), (bytes) => scanLine(decodeScan(bytes))],
  [
    'odometry',
    make.odometry(stamp, 'odom', 'base', [1, 2, 3, 0, 0, 0, 1]),
    (bytes) => decodePoses('nav_msgs/msg/Odometry', bytes),
  ],
  [
    'tf',
    make.transforms([[stamp, 'a', 'b', [1, 2, 3, 0, 0, 0, 1]]]),
    (bytes) => decodePoses('tf2_msgs/msg/TFMessage', bytes),
  ],
  ['path', make.transforms([]), (bytes) => decodePoses('nav_msgs/msg/Path', bytes)],
  ['header', make.poseStamped(stamp, 'a', [1, 2, 3, 0, 0, 0, 1]), (bytes) => new CdrReader(bytes).string('text')],
];
const TOPICS = [
  { name: '/depth', type: 'sensor_msgs/msg/Image' },
  { name: '/odom', type: 'nav_msgs/msg/Odometry' },
];
const RECORDED = Array.from({ length: 12 }, (_, i) => [
  {
    topic: '/depth',
    time: BigInt(i),
    data: make.image({ stamp, width: 40, height: 30, encoding: '16UC1', data: new Uint8Array(2400) }),
  },
  { topic: '/odom', time: BigInt(i), data: make.odometry(stamp, 'odom', 'base', [i, 0, 0, 0, 0, 0, 1]) },
]).flat();
const stored = (/** @type {string} */ name) => new Uint8Array(readFileSync(join(ROOT, 'tests/data/bags', name)));
/** @type {[string, Uint8Array][]} */
const BAGS = [
  ['a.mcap', mcapBytes(TOPICS, RECORDED, { chunkBytes: 9000 })],
  ['b.mcap', mcapBytes(TOPICS, RECORDED, { isIndexed: false, hasChunks: false })],
  ['c.db3', db3Bytes(TOPICS, RECORDED)],
  ['zstd.mcap', stored('zstd.mcap')],
  ['lz4.mcap', stored('lz4.mcap')],
];

/** @param {string} name @param {Uint8Array} bytes */
async function readBag(name, bytes) {
  const { bags } = await openBags([bagFile(name, bytes)]);
  for (const bag of bags) {
    for (const topic of bag.topics) {
      for (let index = 0; index < Math.min(topic.count, 40); index += 1) {
        await bag.readHead(topic, index, 60).catch(mustBeTold);
        await bag.read(topic, index).catch(mustBeTold);
      }
    }
  }
}

/** Bytes of what was read. @param {import('./random.mjs').Random} random */
export async function messages(random) {
  const [, message = new Uint8Array(), convert] = random.one(MESSAGES);
  const damaged = random.damaged(message);
  try {
    convert(damaged);
  } catch (error) {
    if (!(error instanceof MessageError)) mustBeTold(error);
  }
  return damaged;
}

/** @param {import('./random.mjs').Random} random */
export async function bags(random) {
  const [name, bag] = random.one(BAGS);
  const damaged = random.damaged(bag);
  await readBag(name, damaged);
  return damaged;
}
