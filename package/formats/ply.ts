/** Points as a PLY file: what the readers of other clouds hand to the engine. */

/**
 * @param count points
 * @param names of the properties of a point, each a 32-bit float or, as doubles, a 64-bit one
 */
function plyHeader(count: number, names: readonly string[], type: 'float' | 'double') {
  const properties = names.map((name) => `property ${type} ${name}\n`).join('');
  return new TextEncoder().encode(
    `ply\nformat binary_little_endian 1.0\nelement vertex ${count}\n${properties}end_header\n`,
  );
}

/**
 * @param points floats of the type, little endian
 * @param count of all points; there may be fewer here
 */
export function plyFile(
  points: Uint8Array,
  count: number,
  names: readonly string[],
  type: 'float' | 'double' = 'float',
) {
  const header = plyHeader(count, names, type);
  const file = new Uint8Array(header.length + points.length);
  file.set(header);
  file.set(points, header.length);
  return file;
}

/** Floats as little-endian bytes, which is what they are on every machine that runs WebAssembly. */
export function bytesOf(values: Float32Array) {
  return new Uint8Array(values.buffer, values.byteOffset, values.byteLength);
}

/** Coordinates beyond this (m) have steps of more than a hundredth of a millimetre in single precision. */
const MAX_SINGLE = 128;

/**
 * Points as a cloud: in double precision where single precision would lose some of it.
 * @param positions x y z, point by point
 * @param more colors: red green blue, point by point, up to 255 or 65,535; unit: of the coordinates, where it is known
 */
export function pointsFile(
  positions: Float64Array,
  { colors = null, unit = null }: { colors?: ArrayLike<number> | null; unit?: string | null } = {},
) {
  const count = positions.length / 3;
  const isLong = positions.some((value) => Math.abs(value) > MAX_SINGLE);
  const type = isLong ? 'double' : 'float';
  const comment = unit === null ? '' : `comment unit ${unit}\n`;
  const coordinates = ['x', 'y', 'z'].map((name) => `property ${type} ${name}\n`).join('');
  const shades = colors ? ['red', 'green', 'blue'].map((name) => `property uchar ${name}\n`).join('') : '';
  const text = `ply\nformat binary_little_endian 1.0\n${comment}element vertex ${count}\n${coordinates}${shades}end_header\n`;
  const header = new TextEncoder().encode(text);
  const [size, step] = [isLong ? 8 : 4, (isLong ? 24 : 12) + (colors ? 3 : 0)];
  const file = new Uint8Array(header.length + count * step);
  file.set(header);
  const view = new DataView(file.buffer, header.length);
  const full = colors && largestOf(colors) > 255 ? 65_535 : 255;
  for (let point = 0; point < count; point += 1) {
    for (let axis = 0; axis < 3; axis += 1) {
      const [at, value] = [point * step + axis * size, positions[3 * point + axis] ?? 0];
      if (isLong) view.setFloat64(at, value, true);
      else view.setFloat32(at, value, true);
      if (colors)
        view.setUint8(point * step + 3 * size + axis, Math.round(((colors[3 * point + axis] ?? 0) / full) * 255));
    }
  }
  return file;
}

function largestOf(values: ArrayLike<number>) {
  let largest = 0;
  for (let at = 0; at < values.length; at += 1) largest = Math.max(largest, values[at] ?? 0);
  return largest;
}
