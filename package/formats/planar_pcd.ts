/** Planar scans as PCD files (all z are 0), which the engine reads as PLY. Source: the PCD file format, version 0.7 (PCL). */
import { lookUp } from '../base/look_up.js';
import { MAX_OFF_PLANE } from '../files/heads.js';
import { NUMBER_TYPES, type NumberType } from './number_types.js';
import { bytesOf, plyFile } from './ply.js';

/** of x, y and z; stride: bytes of a point */
type Layout = {
  columns: number[];
  offsets: number[];
  types: NumberType[];
  stride: number;
  numPoints: number;
  start: number;
  isText: boolean;
};

/** @returns null: compressed, without z, or no PCD */
function layoutOf(head: Uint8Array): Layout | null {
  const text = new TextDecoder('latin1').decode(head.subarray(0, 4096));
  const [header, data] = /^(?:#.*\n)*VERSION[^]*?\nDATA (ascii|binary)\r?\n/.exec(text) ?? [];
  if (header === undefined) return null;
  const values = (name: string) => (new RegExp(`^${name} (.*)$`, 'm').exec(header)?.[1] ?? '').trim().split(/\s+/);
  const names = values('FIELDS');
  const sizes = values('SIZE').map(Number);
  const counts = header.includes('\nCOUNT') ? values('COUNT').map(Number) : names.map(() => 1);
  const kinds = values('TYPE');
  const before = (lengths: readonly number[], at: number) =>
    lengths.slice(0, at).reduce((total, length) => total + length, 0);
  const bytes = sizes.map((size, at) => size * (counts[at] ?? 1));
  const found = ['x', 'y', 'z'].map((name) => names.indexOf(name));
  const types = found
    .map((at) => lookUp(NUMBER_TYPES, `${kinds[at]}${sizes[at]}`.toLowerCase()))
    .filter((type) => type !== undefined);
  const stride = before(bytes, bytes.length);
  if (found.some((at) => at < 0) || types.length < found.length || !(stride > 0)) return null;
  return {
    columns: found.map((at) => before(counts, at)),
    offsets: found.map((at) => before(bytes, at)),
    types,
    stride,
    numPoints: Number(values('POINTS')[0]),
    start: header.length,
    isText: data === 'ascii',
  };
}

/** x, y and z of all points that are there. */
function pointsOf(
  bytes: Uint8Array,
  { columns, offsets, types, stride, numPoints, start, isText }: Layout,
): number[][] {
  const body = bytes.subarray(start);
  if (isText) {
    const lines = new TextDecoder('latin1')
      .decode(body)
      .split('\n')
      .filter((line) => line.trim() !== '');
    return lines.slice(0, numPoints).map((line) => {
      const words = line.trim().split(/\s+/);
      return columns.map((column) => Number(words[column] ?? Number.NaN));
    });
  }
  const view = new DataView(body.buffer, body.byteOffset, body.byteLength);
  const count = Math.min(numPoints || 0, Math.floor(body.byteLength / stride));
  return Array.from({ length: count }, (_, point) =>
    offsets.map((offset, axis) => types[axis]?.[1](view, stride * point + offset, true) ?? Number.NaN),
  );
}

/** Whether the points at the beginning of a PCD lie in the plane z = 0. */
export function isPlanarPcd(head: Uint8Array) {
  const layout = layoutOf(head);
  if (!layout) return false;
  // The last line may be cut off.
  const points = pointsOf(head, layout).slice(0, layout.isText && layout.numPoints > 1 ? -1 : undefined);
  const heights = points.map(([, , z = Number.NaN]) => z).filter(Number.isFinite);
  return heights.length > 1 && heights.every((z) => Math.abs(z) <= MAX_OFF_PLANE);
}

/** A planar PCD as PLY; what turns out to leave the plane keeps its z. */
export function plyOfPcd(bytes: Uint8Array) {
  const layout = layoutOf(bytes);
  const points = layout ? pointsOf(bytes, layout) : [];
  return plyFile(bytesOf(Float32Array.from(points.flat())), points.length, ['x', 'y', 'z']);
}
