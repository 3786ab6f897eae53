// @ts-check
/** Clouds of E57 and LAZ, unpacked by a part of the engine that is loaded with the first of them. */
import { fileError } from '../errors.js';
import { pointsFile } from './ply.js';

const REMEDY = 'Copy or export it again';

/** @type {Promise<typeof import('#formats-engine')> | undefined} */
let loading;

function engine() {
  loading ??= import('#formats-engine')
    .then(async (module) => {
      await module.start();
      return module;
    })
    .catch((error) => {
      loading = undefined; // a failed download may succeed at the next try
      throw error;
    });
  return loading;
}

/**
 * @template T
 * @param {string} name
 * @param {() => T} unpack
 * @param {string} what
 */
function unpacked(name, unpack, what) {
  try {
    return unpack();
  } catch (error) {
    if (error instanceof WebAssembly.RuntimeError) loading = undefined; // it cannot go on
    throw fileError(name, `This ${what} is damaged (${/** @type {Error} */ (error).message})`, REMEDY);
  }
}

/**
 * The scans of an E57 file as PLY, each in the frame of its scanner.
 * @param {string} name
 * @param {Uint8Array} bytes
 * @returns {Promise<{ ply: Uint8Array, count: number, num_invalid: number }[]>}
 */
export async function e57Clouds(name, bytes) {
  const { read_e57 } = await engine();
  return unpacked(name, () => read_e57(bytes), 'E57 cloud').map((scan) => {
    const { positions, colors, num_invalid } = scan;
    scan.free();
    const ply = pointsFile(positions, { colors: colors.length > 0 ? colors : null, unit: 'm' });
    return { ply, count: positions.length / 3, num_invalid };
  });
}

/**
 * The LAS that a LAZ was packed from.
 * @param {string} name
 * @param {Uint8Array} bytes
 */
export async function lasOfLaz(name, bytes) {
  const { unpack_laz } = await engine();
  return unpacked(name, () => unpack_laz(bytes), 'LAZ cloud');
}
