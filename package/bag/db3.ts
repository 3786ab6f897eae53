/**
 * A bag of rosbag2's SQLite storage: the tables `topics` and `messages`. All rows are walked once, without the messages
 * themselves; a message is read when it is asked for.
 */
import type { ByteSource } from '../archive/window.js';
import { unpackZstd } from '../archive/zstd.js';
import { fileError, lost } from '../base/errors.js';
import type { Container, StoredTopic } from './container.js';
import { MessageIndex } from './message_index.js';
import { SqliteFile, type Value } from './sqlite.js';

/** What a message begins with that rosbag2 packed by itself. */
const ZSTD_MAGIC = [0x28, 0xb5, 0x2f, 0xfd];

/** @param name for messages */
export async function openDb3(name: string, source: ByteSource): Promise<Container> {
  const file = await SqliteFile.open(name, source);
  if (!file.has('topics') || !file.has('messages')) {
    throw fileError(
      name,
      'This SQLite file has no tables of topics and messages, so it is not a bag',
      'Give the bag itself',
    );
  }
  const topics = await readTopics(file);
  const [time = -1, topic = -1, data = -1] = ['timestamp', 'topic_id', 'data'].map((column) =>
    file.column('messages', column),
  );
  if (Math.min(time, topic, data) < 0) {
    throw fileError(name, 'Its messages have no column for their time, topic or data', 'Record it with rosbag2');
  }
  const strays = await indexMessages(file, topics, topic, time);
  const notes = file.notes;
  if (strays > 0) notes.push(lost(name, `${strays} messages have no topic or no integer time and are left out`));
  return { topics, notes, ...readersOf(file, data) };
}

/**
 * How messages of a bag are read, by their places.
 * @param data column of the messages
 */
function readersOf(file: SqliteFile, data: number): Pick<Container, 'read' | 'readHead'> {
  const blobOf = async ([page, cell]: [number, number], isWhole: boolean) => {
    const row = await file.row({ page, cell });
    const values = isWhole ? await file.valuesOf(row) : file.valuesInPage(row);
    const blob = values[data];
    return blob instanceof Uint8Array ? blob : new Uint8Array();
  };
  const read = async (place: [number, number]) => {
    const bytes = await blobOf(place, true);
    return isPacked(bytes) ? unpackZstd(bytes, null) : bytes;
  };
  return {
    read,
    readHead: async (place, length) => {
      const head = await blobOf(place, false);
      if (head.length >= length && !isPacked(head)) return head.subarray(0, length);
      return (await read(place)).subarray(0, length);
    },
  };
}

/**
 * Where the messages of each topic lie, in the order of their times.
 * @param topic column of the messages
 * @param time column of the messages
 * @returns messages without a topic or without an integer time
 */
async function indexMessages(
  file: SqliteFile,
  topics: readonly { id: number; messages: MessageIndex }[],
  topic: number,
  time: number,
): Promise<number> {
  const byId = new Map(topics.map(({ id, messages }) => [id, messages]));
  let strays = 0;
  for await (const { place, values } of file.rows('messages')) {
    const messages = byId.get(Number(values[topic]));
    const stamp = integerOf(values[time] ?? 0);
    if (messages && stamp !== null) messages.push(stamp, place.page, place.cell);
    else strays += 1;
  }
  for (const { messages } of topics) messages.sort();
  return strays;
}

async function readTopics(file: SqliteFile): Promise<(StoredTopic & { id: number })[]> {
  const place = (column: string) => file.column('topics', column);
  const [name, type, format] = [place('name'), place('type'), place('serialization_format')];
  const topics = [];
  for await (const { cell } of file.rows('topics')) {
    const values = await file.valuesOf(cell);
    topics.push({
      id: cell.rowid,
      name: String(values[name] ?? ''),
      type: String(values[type] ?? ''),
      format: String(values[format] ?? 'cdr'),
      messages: new MessageIndex(),
    });
  }
  return topics;
}

/** A whole number of any SQLite storage class; null for other values. */
function integerOf(value: Value) {
  return typeof value === 'bigint' || Number.isInteger(value) ? BigInt(value as number | bigint) : null;
}

function isPacked(bytes: Uint8Array) {
  return ZSTD_MAGIC.every((byte, index) => bytes[index] === byte);
}
