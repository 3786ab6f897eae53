/** What only recordings in space need, loaded with the first that may be one: a page with planar scans is there sooner. */
export { timesOfClouds } from '../formats/kitti.js';
export { findExif, findIntrinsics } from './cameras.js';
export { findDepthRecordings, framesOf, isApart, leftAside } from './depth_images.js';
export { isListName } from './lists.js';
export { findReference } from './reference.js';
