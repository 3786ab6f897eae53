// @ts-check
/** Points as a PLY file: what the readers of other clouds hand to the engine. */

/**
 * @param {number} count points
 * @param {readonly string[]} names of the properties of a point, each a 32-bit float
 */
function plyHeader(count, names) {
  const properties = names.map((name) => `property float ${name}\n`).join('');
  return new TextEncoder().encode(
    `ply\nformat binary_little_endian 1.0\nelement vertex ${count}\n${properties}end_header\n`,
  );
}

/**
 * @param {Uint8Array} points 32-bit floats, little endian
 * @param {number} count of all points; there may be fewer here
 * @param {readonly string[]} names
 */
export function plyFile(points, count, names) {
  const header = plyHeader(count, names);
  const file = new Uint8Array(header.length + points.length);
  file.set(header);
  file.set(points, header.length);
  return file;
}

/** Floats as little-endian bytes, which is what they are on every machine that runs WebAssembly. @param {Float32Array} values */
export function bytesOf(values) {
  return new Uint8Array(values.buffer, values.byteOffset, values.byteLength);
}
