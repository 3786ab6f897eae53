// @ts-check
/** Files of the tests as bags see them. */
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { listBags } from '../../npm/bag/bag_recordings.js';
import { Bag, openBags } from '../../npm/bag/open.js';
import { writeDb3, writeMcap } from './bag_writer.mjs';

/** @typedef {import('./bag_writer.mjs').TopicToWrite} TopicToWrite */
/** @typedef {import('./bag_writer.mjs').MessageToWrite} MessageToWrite */

/** @param {string} path @param {Uint8Array} bytes @returns {import('../../npm/bag/open.js').BagFile} */
export function bagFile(path, bytes) {
  return { path, source: async () => ({ size: bytes.length, read: async (start, end) => bytes.subarray(start, end) }) };
}

/** The bytes of a bag. @param {TopicToWrite[]} topics @param {MessageToWrite[]} messages @param {import('./bag_writer.mjs').McapOptions} [options] */
export function mcapBytes(topics, messages, options) {
  return bytesOf((path) => writeMcap(path, topics, messages, options));
}

/** @param {TopicToWrite[]} topics @param {MessageToWrite[]} messages */
export function db3Bytes(topics, messages) {
  return bytesOf((path) => writeDb3(path, topics, messages));
}

/** @param {(path: string) => void} write */
function bytesOf(write) {
  const folder = mkdtempSync(join(tmpdir(), 'scanstitch-bag-'));
  try {
    write(join(folder, 'bag'));
    return new Uint8Array(readFileSync(join(folder, 'bag')));
  } finally {
    rmSync(folder, { recursive: true });
  }
}

/** The only bag in these bytes, and what was said of it. @param {string} path @param {Uint8Array} bytes */
export async function openOne(path, bytes) {
  const { bags, notes } = await openBags([bagFile(path, bytes)]);
  return {
    bag: bags[0] ?? new Bag(path, []),
    numBags: bags.length,
    notes: [...notes, ...bags.flatMap((bag) => bag.notes)],
  };
}

/** @param {string} path @param {Uint8Array} bytes */
export async function listOne(path, bytes) {
  const { bags, notes } = await listBags([bagFile(path, bytes)]);
  const [listed] = bags;
  if (!listed) throw new Error(`no bag: ${JSON.stringify(notes)}`);
  return listed;
}
