/**
 * Records of a bag of ROS 1, from their bytes to plain values.
 *
 * Source of the layout: "Bags/Format/2.0", ROS wiki. A record is the length of its header, the header, the length of its
 * data, the data; a header is fields of `name=value`, each behind its length. Numbers have their low byte first.
 */

export const OP = Object.freeze({
  message: 0x02,
  bagHeader: 0x03,
  index: 0x04,
  chunk: 0x05,
  chunkInfo: 0x06,
  connection: 0x07,
});
const MAGIC = '#ROSBAG V';
/** The version line of the bags that are read: those since 2010. */
export const MAGIC_2_0 = '#ROSBAG V2.0\n';
/** A header has a few fields and the name of a topic. */
export const MAX_HEADER_BYTES = 2 ** 16;
const LENGTH_BYTES = 4;

type Fields = Map<string, Uint8Array>;
export type Connection = { id: number; topic: string; type: string };
/** places in what it was read from; start: of the record; end: behind its data, which may lie behind what there is */
export type RecordHead = {
  start: number;
  op: number;
  fields: Fields;
  dataStart: number;
  dataLength: number;
  end: number;
};

/** Whether a file that begins like this is a bag of ROS 1, of any version. */
export function isRos1(head: Uint8Array) {
  return new TextDecoder('latin1').decode(head.subarray(0, MAGIC.length)) === MAGIC;
}

/**
 * The head of the record at a place. A RangeError where there is none: the bytes end before it does, or are no header.
 */
export function readRecordHead(bytes: Uint8Array, start = 0): RecordHead {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const headerLength = view.getUint32(start, true);
  const headerStart = start + LENGTH_BYTES;
  const headerEnd = headerStart + headerLength;
  if (headerLength > MAX_HEADER_BYTES) throw new RangeError('a record has no header');
  const dataLength = view.getUint32(headerEnd, true);
  const fields = readFields(bytes.subarray(headerStart, headerEnd));
  const dataStart = headerEnd + LENGTH_BYTES;
  return { start, op: u8(fields, 'op'), fields, dataStart, dataLength, end: dataStart + dataLength };
}

/** Records that lie whole in these bytes, one after the other. */
export function* recordsIn(bytes: Uint8Array): Generator<RecordHead & { data: Uint8Array }> {
  for (let place = 0; place < bytes.length;) {
    const head = readRecordHead(bytes, place);
    if (head.end > bytes.length) throw new RangeError('a record ends before its data does');
    yield { ...head, data: bytes.subarray(head.dataStart, head.end) };
    place = head.end;
  }
}

function readFields(header: Uint8Array): Fields {
  const view = new DataView(header.buffer, header.byteOffset, header.byteLength);
  const fields: Fields = new Map();
  for (let place = 0; place < header.length;) {
    const start = place + LENGTH_BYTES;
    const end = start + view.getUint32(place, true);
    const equals = header.indexOf(0x3d, start);
    if (end > header.length || equals < start || equals >= end) throw new RangeError('a header is damaged');
    fields.set(text(header.subarray(start, equals)), header.subarray(equals + 1, end));
    place = end;
  }
  return fields;
}

/** A connection is a topic as one publisher sends it. */
export function readConnection(fields: Fields, data: Uint8Array): Connection {
  const type = readFields(data).get('type');
  if (!type) throw new RangeError('a connection names no type');
  return { id: u32(fields, 'conn'), topic: textOf(fields, 'topic'), type: text(type) };
}

/** Times (ns) and places in the chunk of one connection's messages. */
export function readIndex(fields: Fields, data: Uint8Array) {
  const [id, count] = [u32(fields, 'conn'), u32(fields, 'count')];
  if (u32(fields, 'ver') !== 1 || data.length < 12 * count) throw new RangeError('an index is damaged');
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const entries = Array.from({ length: count }, (_, index) => {
    return { time: timeAt(view, 12 * index), offset: view.getUint32(12 * index + 8, true) };
  });
  return { id, entries };
}

/** Time of a message (ns) and its connection. */
export function readMessage(fields: Fields) {
  return { id: u32(fields, 'conn'), time: timeAt(viewOf(fields, 'time', 8), 0) };
}

/** Where a part of the file begins; 0: nobody wrote it down, for the recorder was not closed. */
export function placeOf(fields: Fields, name: 'index_pos' | 'chunk_pos') {
  return Number(viewOf(fields, name, 8).getBigUint64(0, true));
}

export function u32(fields: Fields, name: string) {
  return viewOf(fields, name, 4).getUint32(0, true);
}

function u8(fields: Fields, name: string) {
  return viewOf(fields, name, 1).getUint8(0);
}

export function textOf(fields: Fields, name: string) {
  const value = fields.get(name);
  if (!value) throw new RangeError(`a header has no ${name}`);
  return text(value);
}

function viewOf(fields: Fields, name: string, size: number) {
  const value = fields.get(name);
  if (!value || value.length < size) throw new RangeError(`a header has no ${name}`);
  return new DataView(value.buffer, value.byteOffset, value.byteLength);
}

/** Seconds and nanoseconds. */
function timeAt(view: DataView, place: number) {
  return BigInt(view.getUint32(place, true)) * 1_000_000_000n + BigInt(view.getUint32(place + 4, true));
}

function text(bytes: Uint8Array) {
  return new TextDecoder().decode(bytes);
}
