/** Clouds of E57 and LAZ, unpacked by a part of the engine that is loaded with the first of them. */
import { byFormatsEngine } from '../archive/formats_engine.js';
import { fileError } from '../base/errors.js';
import { pointsFile } from './ply.js';
import type { Convert } from './reader.js';

function damagedAs(name: string, what: string) {
  return (reason: string) => fileError(name, `This ${what} is damaged (${reason})`, 'Copy or export it again');
}

/** The scans of an E57 file, each as a file. */
export const convert: Convert = async (file, { madeOf, notes }) => {
  const make = async () => e57Clouds(file.path, await file.read());
  const clouds = (await make()).map(({ count, num_invalid, ply }) => ({ count, num_invalid, size: ply.length }));
  const invalid = clouds.reduce((sum, { num_invalid }) => sum + num_invalid, 0);
  const number = clouds.reduce((sum, { count }) => sum + count, invalid);
  if (invalid > 0)
    notes.push({ file: file.path, reason: `${invalid} of its ${number} points are marked as invalid, and left out` });
  if (clouds.every(({ count }) => count === 0)) {
    throw fileError(file.path, 'There are no points in this E57 file', 'Export it again with its scans');
  }
  return clouds.flatMap(({ count, size }, at) => {
    const path = clouds.length > 1 ? file.path.replace(/\.e57$/i, `_${at + 1}.e57`) : file.path;
    const read = async () => (await make())[at]?.ply ?? new Uint8Array();
    return count > 0 ? [madeOf(file, read, { isCloud: true, path, size })] : [];
  });
};

/** The scans of an E57 file as PLY, each in the frame of its scanner. */
export async function e57Clouds(
  name: string,
  bytes: Uint8Array,
): Promise<{ ply: Uint8Array; count: number; num_invalid: number }[]> {
  const scans = await byFormatsEngine(({ read_e57 }) => read_e57(bytes), damagedAs(name, 'E57 cloud'));
  return scans.map((scan) => {
    const { positions, colors, num_invalid } = scan;
    scan.free();
    const ply = pointsFile(positions, { colors: colors.length > 0 ? colors : null, unit: 'm' });
    return { ply, count: positions.length / 3, num_invalid };
  });
}

/** The LAS that a LAZ was packed from. */
export function lasOfLaz(name: string, bytes: Uint8Array) {
  return byFormatsEngine(({ unpack_laz }) => unpack_laz(bytes), damagedAs(name, 'LAZ cloud'));
}
