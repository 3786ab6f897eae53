// @ts-check
/** What both kinds of reconstruction share: offering files to the engine, writing what came of them. */
import { basename } from 'node:path';
import { lookUp } from '../look_up.js';
import { reportHtml } from '../report/report.js';
import { CommandError, isScanstitchError } from './command.js';

/**
 * What a reconstruction is given.
 * @typedef {object} Task
 * @property {import('./command.js').Engine} engine
 * @property {import('./inputs.js').OpenedRecording} recording
 * @property {Options} options
 * @property {(problem: string) => void} complain reports what is left out, which makes the exit code 2
 * @property {readonly string[]} [problems] all that was complained of so far
 */

/**
 * @typedef {object} Options
 * @property {string} out
 * @property {string | undefined} reference
 * @property {string | undefined} odometry of planar scans
 * @property {string} [table] what the columns of tables of ranges are
 * @property {string | undefined} intrinsics
 * @property {string | undefined} preset
 * @property {string[]} set
 * @property {number} workers
 * @property {MapFormat} [mapFormat] of the map; binary PLY without
 */

/** @typedef {Parameters<import('../index.js').SpatialReconstruction['map_file']>[0]} MapFormat */

/** Formats of a map, as the command line calls them. @type {Readonly<Record<string, MapFormat>>} */
const MAP_FORMATS = Object.freeze({
  ply: 'ply',
  'ply-ascii': 'ply_ascii',
  pcd: 'pcd',
  'pcd-ascii': 'pcd_ascii',
  'pcd-compressed': 'pcd_binary_compressed',
});

/** @param {string | undefined} name @returns {MapFormat | undefined} */
export function readMapFormat(name) {
  if (name === undefined) return undefined;
  const known = lookUp(MAP_FORMATS, name);
  if (known) return known;
  throw new CommandError(`--map-format ${name}: it is one of ${Object.keys(MAP_FORMATS).join(', ')}`);
}

/** The name of the map's file, and its bytes. @param {{ map_file: (format: MapFormat) => Uint8Array }} reconstruction @param {Options} options */
export function mapFile(reconstruction, { mapFormat = 'ply' }) {
  const name = `map.${mapFormat.slice(0, 3)}`;
  return { name, bytes: reconstruction.map_file(mapFormat) };
}

/**
 * What the engine makes of settings it may refuse.
 * @template T
 * @param {() => T} make
 */
export function create(make) {
  try {
    return make();
  } catch (error) {
    if (isScanstitchError(error)) throw new CommandError(error.message);
    throw error;
  }
}

/**
 * Whether the engine took it; other faults are reported.
 * @param {() => void} offer
 * @param {(problem: string) => void} complain
 */
export function accepted(offer, complain) {
  try {
    offer();
    return true;
  } catch (error) {
    if (!isScanstitchError(error)) throw error;
    complain(error.message);
    return false;
  }
}

/** @param {number} metres */
export function millimetres(metres) {
  return (1000 * metres).toFixed(1);
}

/**
 * An error's figures; `format` writes a length with its unit.
 * @param {{ mean: number, rmse: number, max: number }} error
 * @param {(metres: number) => string} format
 */
export function errorFigures({ mean, rmse, max }, format) {
  return `mean ${format(mean)}, rmse ${format(rmse)}, max ${format(max)}`;
}

/**
 * The report to be read and printed.
 * @param {import('../report/report.js').PlanarResult | import('../report/report.js').SpatialResult} result
 * @param {Float32Array} points of the map
 * @param {Task} task
 */
export function reportFile(result, points, { recording, options, problems = [] }) {
  const { scans, clouds, depth_frames, reference, odometry, intrinsics } = recording;
  const images = depth_frames.flatMap(({ depth, color }) => [depth, color]);
  const beside = [options.reference ?? reference, options.odometry ?? odometry, options.intrinsics ?? intrinsics];
  const opened = [...scans, ...clouds, ...images, ...beside.flat()].filter((path) => path !== null);
  const num_frames = depth_frames.length + clouds.length;
  const title = basename(recording.root) || basename(opened[0] ?? '') || 'Recording';
  return { 'report.html': reportHtml(result, { title, opened, losses: problems, points, num_frames }) };
}
