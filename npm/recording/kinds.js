// @ts-check
/** What the extension of a name says about a file. Its content may differ: see classify.js and heads.js. */

const IMAGES = /\.(png|jpe?g|pgm|ppm|pnm|pfm|bmp|webp)$/i;
/** Images that hold distances in forms that are not read. */
const FOREIGN_DEPTH = /\.(tiff?|exr|npy|npz|bin|raw|dpt|depth)$/i;
const CLOUDS = /\.(ply|pcd)$/i;
const ARCHIVES = /\.(zip|tar|tgz|tbz2?|tzst|tar\.(gz|bz2|zst|zstd))$/i;

/** An image of a format that is read, or that at least shows by its first bytes what it is. @param {string} path */
export function isImageName(path) {
  return IMAGES.test(path);
}

/** What may hold distances in a form that is not read. @param {string} path */
export function isForeignDepthName(path) {
  return FOREIGN_DEPTH.test(path);
}

/** A cloud of a format that is read. @param {string} path */
export function isCloudName(path) {
  return CLOUDS.test(path);
}

/** An archive that is opened. @param {string} path */
export function isArchiveName(path) {
  return ARCHIVES.test(path);
}
