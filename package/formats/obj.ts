/**
 * The vertices of a mesh or cloud as Wavefront OBJ: lines `v x y z`, behind which MeshLab and Open3D write a colour (0 to 1).
 *
 * Source: Wavefront Technologies, "Advanced Visualizer Manual", appendix B1, "Object Files (.obj)".
 */
import { fileError } from '../base/errors.js';
import { pointsFile } from './ply.js';
import type { Convert } from './reader.js';

const VERTEX = /^[ \t]*v[ \t]+(.+)$/gm;
const NUMBER = /^([+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?|[+-]?(nan|inf))$/i;

export const convert: Convert = async (file, { madeOf }) =>
  madeOf(file, async () => objCloud(file.path, await file.read()), { isCloud: true });

/** @param name for messages; returns PLY, with NaN for points that were not seen; throws a ScanstitchError */
export function objCloud(name: string, bytes: Uint8Array): Uint8Array {
  const rows = [...new TextDecoder().decode(bytes).matchAll(VERTEX)].map(([, row = '']) => row.trim().split(/\s+/));
  const bad = rows.find((row) => row.length < 3 || !row.every((word) => NUMBER.test(word)));
  if (bad) throw fileError(name, `Its vertex "v ${bad.join(' ')}" is no row of numbers`, 'Export it again');
  const colors = rows.every((row) => row.length >= 6)
    ? rows.flatMap((row) => row.slice(-3).map((part) => 255 * Number(part)))
    : null;
  return pointsFile(Float64Array.from(rows.flatMap((row) => row.slice(0, 3).map(Number))), { colors });
}
