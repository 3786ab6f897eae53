/**
 * Clouds of LAS 1.0 to 1.4, as they are written without compression.
 *
 * Source of the layout: ASPRS, "LAS Specification 1.4 - R15", tables 3 and 7 to 17.
 */
import { fileError, lost } from '../base/errors.js';
import { metresOfLas } from './las_units.js';
import { pointsFile } from './ply.js';
import type { Convert } from './reader.js';

const MIN_HEADER = 227;
/** Of the header, as much as is used: that of version 1.4 up to its number of points. */
export const HEADER_BYTES = 255;
const COMPRESSED = 0x80;
/** x, y and z of every point record, 32-bit integers. */
const MIN_RECORD = 20;
/** Records before the points that are looked into for the unit. */
const MAX_RECORDS_BYTES = 2 ** 18;
/** Bytes before red, green and blue of 16 bits, by the format of the points. */
const COLORS_AT: Record<number, number> = { 2: 20, 3: 28, 5: 28, 7: 30, 8: 30, 10: 30 };

interface LasHeader {
  /** Of the points in the file. */
  start: number;
  /** Bytes of a point. */
  record: number;
  /** Of the points that are there. */
  count: number;
  axes: { scale: number; offset: number }[];
  /** Bytes before the colours in a point. */
  colorsAt: number | null;
  /** What is missing of it. */
  loss: string | null;
}

export const convert: Convert = async (file, { madeOf, notes }) => {
  const { path } = file;
  const head = await file.readHead(HEADER_BYTES);
  const { loss, start } = lasHeader(path, head, file.size);
  if (loss !== null) notes.push(lost(path, loss));
  const metres = metresOfLas(path, await file.readHead(Math.min(start, MAX_RECORDS_BYTES)));
  if (metres.some((unit) => unit !== 1)) {
    notes.push({
      file: path,
      reason: `its header says feet (${metres.join(', ')} m along x, y, z): it is read in metres`,
    });
  }
  const unpack = async () => {
    const bytes = await file.read();
    return isLaz(head) ? (await import('./packed_clouds.js')).lasOfLaz(path, bytes) : bytes;
  };
  return madeOf(file, async () => lasCloud(path, await unpack(), metres), { isCloud: true });
};

/** Whether the points of a LAS are packed: then it is a LAZ. */
export function isLaz(head: Uint8Array) {
  return ((head[104] ?? 0) & COMPRESSED) !== 0;
}

/**
 * @param name for messages
 * @param head the first {@link HEADER_BYTES} of the file, or more
 * @param size of the file (bytes)
 * @returns throws a ScanstitchError
 */
export function lasHeader(name: string, head: Uint8Array, size: number): LasHeader {
  const view = new DataView(head.buffer, head.byteOffset, head.byteLength);
  if (head.length < MIN_HEADER || view.getUint32(0, false) !== 0x4c415346) {
    throw fileError(name, 'This is not a LAS cloud, or it is cut off in its header', 'Copy or export it again');
  }
  const [start, format, record] = [view.getUint32(96, true), view.getUint8(104), view.getUint16(105, true)];
  const legacyCount = view.getUint32(107, true);
  const isFour = view.getUint8(24) === 1 && view.getUint8(25) >= 4 && head.length >= HEADER_BYTES;
  const claimed = legacyCount === 0 && isFour ? Number(view.getBigUint64(247, true)) : legacyCount;
  if (record < MIN_RECORD || start < MIN_HEADER) {
    throw fileError(name, `Its header has points of ${record} bytes at byte ${start}`, 'Copy or export it again');
  }
  const isPacked = isLaz(head);
  const count = isPacked ? claimed : Math.max(0, Math.min(claimed, Math.floor((size - start) / record)));
  const loss = count < claimed ? `cut off: ${count} of ${claimed} points are there` : null;
  const axes = [0, 1, 2].map((axis) => ({
    scale: view.getFloat64(131 + 8 * axis, true),
    offset: view.getFloat64(155 + 8 * axis, true),
  }));
  return { start, record, count, axes, colorsAt: COLORS_AT[format & 0x3f] ?? null, loss };
}

/**
 * @param name for messages
 * @param metres of a unit of each axis
 * @returns PLY; throws a ScanstitchError
 */
export function lasCloud(name: string, bytes: Uint8Array, metres: readonly number[] = [1, 1, 1]): Uint8Array {
  const { start, record, count, axes, colorsAt } = lasHeader(name, bytes, bytes.length);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const points = new Float64Array(3 * count);
  const colors = colorsAt !== null && colorsAt + 6 <= record ? new Uint16Array(3 * count) : null;
  for (let point = 0; point < count; point += 1) {
    const at = start + point * record;
    for (const [axis, { scale, offset }] of axes.entries()) {
      points[3 * point + axis] = (view.getInt32(at + 4 * axis, true) * scale + offset) * (metres[axis] ?? 1);
      if (colors) colors[3 * point + axis] = view.getUint16(at + (colorsAt ?? 0) + 2 * axis, true);
    }
  }
  return pointsFile(points, { colors: colors?.some((value) => value > 0) ? colors : null, unit: 'm' });
}
