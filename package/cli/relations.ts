/** Relations between poses that are known to be right: how far a trajectory is from them, in words and figures. */
import { basename } from 'node:path';
import type { RelationErrors, Trajectory } from '../../pkg/scanstitch.js';
import { relate, type RelationOptions } from '../evaluation/compare.js';
import { type Engine, table } from './command.js';
import { readInput } from './inputs.js';

/** The file of relations; null where it cannot be read, which is reported. */
export function readRelations(path: string, complain: (problem: string) => void) {
  const name = basename(path);
  const bytes = readInput({ name, path }, complain);
  return bytes && { name, bytes };
}

/**
 * The errors of a trajectory; null where nothing can be compared, which is reported. So is what fits too little.
 * @param name of the trajectory
 */
export function compareRelations(
  engine: Engine,
  trajectory: Trajectory,
  name: string,
  file: { name: string; bytes: Uint8Array },
  options: RelationOptions,
  complain: (problem: string) => void,
) {
  const { relations, problems } = relate(engine, trajectory, file, options);
  for (const problem of problems) complain(`${name}: ${problem}`);
  return relations;
}

/** As JSON has them: with the rotations in degrees as well, and single errors where they are asked for. */
export function relationsJson(relations: RelationErrors | null, withErrors: boolean) {
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
 * @param file the relations' name
 */
export function relationsText(results: { name: string; relations: RelationErrors | null }[], file: string) {
  return results.flatMap(({ name, relations }) => (relations ? [paragraph(name, relations, file)] : [])).join('\n');
}

function paragraph(name: string, relations: RelationErrors, file: string) {
  const { num_compared, num_left_out, max_diff, translation, rotation, num_wrong } = relations;
  const tolerance = max_diff === null ? '' : `, matched within ${max_diff.toPrecision(2)} s`;
  const row = (what: string, of: RelationErrors['rotation'], scale = 1) =>
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

export function relationCells(relations: RelationErrors) {
  const { num_compared, num_left_out, translation, rotation } = relations;
  const four = (of: RelationErrors['rotation'], scale = 1) =>
    [of.mean, of.std, of.median, of.max].map((value) => (value * scale).toFixed(4));
  const counts = [num_compared, num_left_out].map(String);
  return [...counts, ...four(translation), ...four(rotation, degrees(1)), percent(relations)];
}

function percent({ share_wrong }: RelationErrors) {
  return (100 * share_wrong).toFixed(2);
}

/** @param angle rad */
function degrees(angle: number) {
  return (angle * 180) / Math.PI;
}
