// @ts-check
/** Relations between poses that are known to be right: how far a trajectory is from them, in words and figures. */
import { basename } from 'node:path';
import { relate } from '../evaluation/compare.js';
import { table } from './command.js';
import { readInput } from './inputs.js';

/** @typedef {import('../index.js').RelationErrors} RelationErrors */
/** @typedef {import('./command.js').Engine} Engine */

/**
 * The file of relations; null where it cannot be read, which is reported.
 * @param {string} path
 * @param {(problem: string) => void} complain
 */
export function readRelations(path, complain) {
  const name = basename(path);
  const bytes = readInput({ name, path }, complain);
  return bytes && { name, bytes };
}

/**
 * The errors of a trajectory; null where nothing can be compared, which is reported. So is what fits too little.
 * @param {Engine} engine
 * @param {import('../index.js').Trajectory} trajectory
 * @param {string} name of the trajectory
 * @param {{ name: string, bytes: Uint8Array }} file
 * @param {import('../evaluation/compare.js').RelationOptions} options
 * @param {(problem: string) => void} complain
 */
export function compareRelations(engine, trajectory, name, file, options, complain) {
  const { relations, problems } = relate(engine, trajectory, file, options);
  for (const problem of problems) complain(`${name}: ${problem}`);
  return relations;
}

/**
 * As JSON has them: with the rotations in degrees as well, and single errors where they are asked for.
 * @param {RelationErrors | null} relations
 * @param {boolean} withErrors
 */
export function relationsJson(relations, withErrors) {
  if (!relations) return null;
  const { translation_errors, rotation_errors, ...figures } = relations;
  const { rmse, mean, median, std, min, max } = relations.rotation;
  const inDegrees = Object.entries({ rmse, mean, median, std, min, max }).map(([name, angle]) => [
    name,
    degrees(angle),
  ]);
  return {
    ...figures,
    rotation_deg: Object.fromEntries(inDegrees),
    ...(withErrors ? { translation_errors, rotation_errors } : {}),
  };
}

/**
 * A paragraph for each trajectory, or a table with a row for each.
 * @param {{ name: string, relations: RelationErrors | null }[]} results
 * @param {string} file the relations' name
 */
export function relationsText(results, file) {
  return results.flatMap(({ name, relations }) => (relations ? [paragraph(name, relations, file)] : [])).join('\n');
}

/**
 * @param {string} name
 * @param {RelationErrors} relations
 * @param {string} file
 */
function paragraph(name, relations, file) {
  const { num_compared, num_left_out, max_diff, translation, rotation, num_wrong } = relations;
  const tolerance = max_diff === null ? '' : `, matched within ${max_diff.toPrecision(2)} s`;
  const row = (/** @type {string} */ what, /** @type {RelationErrors['rotation']} */ of, scale = 1) =>
    [what, of.mean, of.std, of.median, of.max].map((cell) =>
      typeof cell === 'number' ? (cell * scale).toFixed(4) : cell,
    );
  const figures = table(
    ['', 'mean', 'deviation', 'median', 'largest'],
    [row('translation (m)', translation), row('rotation (deg)', rotation, degrees(1))],
    new Set([0]),
  );
  return (
    `${name} against ${file}: ${num_compared} relations used, ${num_left_out} left out${tolerance}\n${figures}` +
    `Off by more than 0.5 m or 5 deg: ${num_wrong} of ${num_compared} (${percent(relations)} %)\n`
  );
}

/** Columns of a table with a row for each trajectory. */
export const RELATION_HEADS = Object.freeze([
  'relations',
  'left out',
  ...['trans (m)', 'rot (deg)'].flatMap((what) => ['', ' std', ' median', ' max'].map((figure) => what + figure)),
  'off (%)',
]);

/** @param {RelationErrors} relations */
export function relationCells(relations) {
  const { num_compared, num_left_out, translation, rotation } = relations;
  const four = (/** @type {RelationErrors['rotation']} */ of, scale = 1) =>
    [of.mean, of.std, of.median, of.max].map((value) => (value * scale).toFixed(4));
  const counts = [num_compared, num_left_out].map(String);
  return [...counts, ...four(translation), ...four(rotation, degrees(1)), percent(relations)];
}

/** @param {RelationErrors} relations */
function percent({ share_wrong }) {
  return (100 * share_wrong).toFixed(2);
}

/** @param {number} angle rad */
function degrees(angle) {
  return (angle * 180) / Math.PI;
}
