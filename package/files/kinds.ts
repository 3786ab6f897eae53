/** What the extension of a name says about a file. Its content may differ: see classify.js and heads.js. */

const IMAGES = /\.(png|jpe?g|pgm|ppm|pnm|pfm|bmp|webp)$/i;
/** Images that hold distances in forms that are not read. */
const FOREIGN_DEPTH = /\.(tiff?|exr|npy|npz|bin|raw|dpt|depth)$/i;
const CLOUDS = /\.(ply|pcd)$/i;
const ARCHIVES = /\.(zip|tar|tgz|tbz2?|tzst|tar\.(gz|bz2|zst|zstd))$/i;

/** An image of a format that is read, or that at least shows by its first bytes what it is. */
export function isImageName(path: string) {
  return IMAGES.test(path);
}

/** What may hold distances in a form that is not read. */
export function isForeignDepthName(path: string) {
  return FOREIGN_DEPTH.test(path);
}

/** A cloud of a format that is read. */
export function isCloudName(path: string) {
  return CLOUDS.test(path);
}

/** An archive that is opened. */
export function isArchiveName(path: string) {
  return ARCHIVES.test(path);
}
