/** Points as a PLY file: what the readers of other clouds hand to the engine. */

/**
 * @param count points
 * @param names of the properties of a point, each a 32-bit float
 */
function plyHeader(count: number, names: readonly string[]) {
  const properties = names.map((name) => `property float ${name}\n`).join('');
  return new TextEncoder().encode(
    `ply\nformat binary_little_endian 1.0\nelement vertex ${count}\n${properties}end_header\n`,
  );
}

/**
 * @param points 32-bit floats, little endian
 * @param count of all points; there may be fewer here
 */
export function plyFile(points: Uint8Array, count: number, names: readonly string[]) {
  const header = plyHeader(count, names);
  const file = new Uint8Array(header.length + points.length);
  file.set(header);
  file.set(points, header.length);
  return file;
}

/** Floats as little-endian bytes, which is what they are on every machine that runs WebAssembly. */
export function bytesOf(values: Float32Array) {
  return new Uint8Array(values.buffer, values.byteOffset, values.byteLength);
}
