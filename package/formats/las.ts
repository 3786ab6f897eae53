/**
 * Clouds of LAS 1.0 to 1.4, as they are written without compression. Large coordinates, of a country's grid, are shifted by
 * whole kilometres: 32-bit floats would round them to decimetres.
 *
 * Source of the layout: ASPRS, "LAS Specification 1.4 - R15", tables 3 and 7 to 17.
 */
import { fileError, lost } from '../base/errors.js';
import { bytesOf, plyFile } from './ply.js';
import type { Convert } from './reader.js';

/** Coordinates up to here (m) are kept: 32-bit floats hold them to a millimetre. */
const MAX_KEPT = 10_000;
/** A shift is so many times some (m): neighbouring files have the same one. */
const SHIFT_STEP = 1000;
const MIN_HEADER = 227;
/** Of the header, as much as is used: that of version 1.4 up to its number of points. */
export const HEADER_BYTES = 255;
const COMPRESSED = 0x80;
/** x, y and z of every point record, 32-bit integers. */
const MIN_RECORD = 20;

interface LasHeader {
  /** Of the points in the file. */
  start: number;
  /** Bytes of a point. */
  record: number;
  /** Of the points that are there. */
  count: number;
  axes: { scale: number; offset: number; shift: number }[];
  /** What is worth knowing of it. */
  notes: string[];
  /** What is missing of it. */
  loss: string | null;
}

export const convert: Convert = async (file, { madeOf, notes }) => {
  const { path } = file;
  const header = lasHeader(path, await file.readHead(HEADER_BYTES), file.size);
  notes.push(...header.notes.map((reason) => ({ file: path, reason })));
  if (header.loss !== null) notes.push(lost(path, header.loss));
  return madeOf(file, async () => lasCloud(path, await file.read()).ply, { isCloud: true });
};

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
  if (format & COMPRESSED) {
    throw fileError(
      name,
      'This is a LAZ cloud, compressed, which is not read',
      `Convert it: pdal translate ${name} out.ply`,
    );
  }
  const legacyCount = view.getUint32(107, true);
  const isFour = view.getUint8(24) === 1 && view.getUint8(25) >= 4 && head.length >= HEADER_BYTES;
  const claimed = legacyCount === 0 && isFour ? Number(view.getBigUint64(247, true)) : legacyCount;
  if (record < MIN_RECORD || start < MIN_HEADER) {
    throw fileError(name, `Its header has points of ${record} bytes at byte ${start}`, 'Copy or export it again');
  }
  const count = Math.max(0, Math.min(claimed, Math.floor((size - start) / record)));
  const loss = count < claimed ? `cut off: ${count} of ${claimed} points are there` : null;
  const axes = [0, 1, 2].map((axis) => {
    const [high, low] = [view.getFloat64(179 + 16 * axis, true), view.getFloat64(187 + 16 * axis, true)];
    const isLarge = Math.max(Math.abs(low), Math.abs(high)) > MAX_KEPT;
    return {
      scale: view.getFloat64(131 + 8 * axis, true),
      offset: view.getFloat64(155 + 8 * axis, true),
      shift: isLarge ? SHIFT_STEP * Math.floor(low / SHIFT_STEP) : 0,
    };
  });
  const shifts = axes.map(({ shift }) => shift);
  const isShifted = shifts.some((shift) => shift !== 0);
  const notes = isShifted ? [`its coordinates are large and are shifted by -(${shifts.join(', ')}) m`] : [];
  return { start, record, count, axes, notes, loss };
}

/**
 * @param name for messages
 * @returns throws a ScanstitchError
 */
export function lasCloud(name: string, bytes: Uint8Array): Pick<LasHeader, 'notes' | 'loss'> & { ply: Uint8Array } {
  const { start, record, count, axes, notes, loss } = lasHeader(name, bytes, bytes.length);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const points = new Float32Array(3 * count);
  for (let point = 0; point < count; point += 1) {
    for (const [axis, { scale, offset, shift }] of axes.entries()) {
      const raw = view.getInt32(start + point * record + 4 * axis, true);
      points[3 * point + axis] = raw * scale + (offset - shift);
    }
  }
  return { ply: plyFile(bytesOf(points), count, ['x', 'y', 'z']), notes, loss };
}
