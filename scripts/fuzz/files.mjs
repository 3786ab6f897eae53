// @ts-check
/** Damaged archives, and files of any name and content: what they are is understood, or told, in little time. */
import { zipSync } from 'fflate';
import { openArchive } from '../../npm/archive/archive.js';
import { printable } from '../../npm/base/printable.js';
import { joinPoses } from '../../npm/recording/pose_file.js';
import { understand } from '../../npm/recording/understand.js';
import { asciiPly, ROOM_FILES } from '../../tests/cli/support.mjs';
import { greyPng } from '../../tests/cli/depth_room.mjs';
import { mustBeTold } from './random.mjs';

/** @typedef {import('./random.mjs').Random} Random */

const encode = (/** @type {string} */ text) => new TextEncoder().encode(text);
const NOISE = Uint8Array.from({ length: 3000 }, (_, i) => (i * 2654435761) >>> 13);
const ZIPS = [
  zipSync({ 'a.png': NOISE, 'folder/b.png': [NOISE, { level: 0 }], 'c.txt': encode('hello') }),
  zipSync(Object.fromEntries(Object.entries(ROOM_FILES).map(([name, text]) => [name, encode(text)]))),
];

/** @param {Uint8Array} bytes */
function sourceOf(bytes) {
  return {
    size: bytes.length,
    read: async (/** @type {number} */ start, /** @type {number} */ end) => bytes.subarray(start, end),
  };
}

/** @param {Random} random */
export async function zips(random) {
  const bytes = random.damaged(random.one(ZIPS));
  try {
    const archive = await openArchive('a.zip', sourceOf(bytes));
    for (const { path } of archive.files) {
      await archive.readHead(path, 100).catch(mustBeTold);
      await archive.read(path).catch(mustBeTold);
    }
  } catch (error) {
    mustBeTold(error);
  }
  return bytes;
}

const WORDS = [
  ...[
    'depth',
    'rgb',
    'frame-',
    '000001',
    '1305031102.175304',
    'color',
    'camera-intrinsics',
    'groundtruth',
    'pose',
    'scan',
  ],
  ...[
    '.png',
    '.jpg',
    '.pgm',
    '.ply',
    '.pcd',
    '.txt',
    '.tum',
    '.log',
    '.json',
    '.npy',
    '.zip',
    '.db3',
    '.mcap',
    'metadata.yaml',
  ],
  ...['1', '99', '1234567890123456789', 'constructor', '__proto__', 'map', 'trajectory', 'report'],
];
const CONTENTS = [
  ...[greyPng(new Uint16Array(48).fill(777), 8), new Uint8Array(), NOISE, encode('0 1 2 3 4 5 6 7\n1 2 3 4 5 6 7 8\n')],
  ...[encode(asciiPly([[1, 2, 0]])), encode(asciiPly([[1, 2, 3]])), encode('FLASER 3 1 2 3 0 0 0 0 0 0 0 host 0\n')],
  ...[
    encode('# a\n1.5 depth/1.png\n'),
    encode('{"nrays":2,"min_theta":0}\n'),
    encode('525 0 319.5\n0 525 239.5\n0 0 1\n'),
  ],
];

/** Milliseconds in which a hundred files must be understood, also on a busy machine. */
const MOST_MILLISECONDS = 5000;

/** @param {Random} random */
export async function classification(random) {
  /** @type {Map<string, Uint8Array>} */
  const files = new Map();
  for (let count = 1 + random.below(100); count > 0; count -= 1) {
    const content = random.one(CONTENTS);
    const path = random.text(WORDS, random.below(50) === 0 ? 500 : 6);
    files.set(path, content.length > 0 && random.below(3) === 0 ? random.damaged(content) : content);
  }
  const listed = [...files].map(([path, { length }]) => ({ path, size: length }));
  const start = performance.now();
  const recording = await understand(listed, async (path, length) =>
    (files.get(path) ?? new Uint8Array()).subarray(0, length),
  );
  const milliseconds = performance.now() - start;
  if (milliseconds > MOST_MILLISECONDS) throw new Error(`understood after ${milliseconds} ms`);
  joinPoses(recording.reference.flatMap((path) => files.get(path) ?? []));
  const named = [...recording.scans, ...recording.clouds, ...recording.depth_frames.map(({ depth }) => depth)];
  const absent = named.find((path) => !files.has(path));
  if (absent !== undefined) throw new Error(`${printable(absent)} is used, and was not given`);
  return encode(listed.map(({ path }) => path).join('\n'));
}
