/** One estimate against one reference, and against known relations between its poses: for the page and the command line. */
import type { Advice, Evaluation, EvaluationOptions, RelationErrors, Trajectory } from '../../pkg/scanstitch.js';

type Engine = Pick<typeof import('../../pkg/scanstitch.js'), 'evaluate' | 'relation_errors'>;

/** How an option is changed, in a whole sentence for each. */
export type Remedies = Record<Advice, string>;

export interface RelationOptions {
  /** s; undefined: as the trajectory's times suggest */
  max_diff: number | undefined;
  /** S, added to the trajectory's times. */
  offset: number | undefined;
  /** Leaves out relations between one pose and the next. */
  loops_only: boolean;
}

/**
 * The summary of a comparison, its notes with what can be done about them, and what `take` takes of it. Throws where the two
 * cannot be compared.
 */
export function comparePair<T>(
  engine: Engine,
  reference: Trajectory,
  estimate: Trajectory,
  options: Partial<EvaluationOptions>,
  remedies: Remedies,
  take: (evaluation: Evaluation) => T,
) {
  const evaluation = engine.evaluate(reference, estimate, options);
  try {
    const summary = evaluation.summary();
    const notes = [...summary.notes, ...summary.advice.map((advice) => remedies[advice])];
    return { ...take(evaluation), summary: { ...summary, notes } };
  } finally {
    evaluation.free();
  }
}

/** Errors of a trajectory against relations, null where none can be compared, and what is wrong with them. */
export function relate(
  engine: Engine,
  trajectory: Trajectory,
  { name, bytes }: { name: string; bytes: Uint8Array },
  { max_diff, offset, loops_only }: RelationOptions,
): { relations: RelationErrors | null; problems: string[] } {
  try {
    const relations = engine.relation_errors(trajectory, bytes, name, max_diff, loops_only, offset);
    return { relations, problems: relations.notes };
  } catch (error) {
    if (!(error instanceof Error && error.name === 'ScanstitchError')) throw error;
    return { relations: null, problems: [error.message] };
  }
}
