// @ts-check
/** One estimate against one reference, and against known relations between its poses: for the page and the command line. */

/** @typedef {import('../../pkg/scanstitch.js').Trajectory} Trajectory */
/** @typedef {import('../../pkg/scanstitch.js').Evaluation} Evaluation */
/** @typedef {import('../../pkg/scanstitch.js').EvaluationOptions} EvaluationOptions */
/** @typedef {import('../../pkg/scanstitch.js').RelationErrors} RelationErrors */
/** @typedef {Pick<typeof import('../../pkg/scanstitch.js'), 'evaluate' | 'relation_errors'>} Engine */
/** @typedef {import('../../pkg/scanstitch.js').Advice} Advice */

/** How an option is changed, in a whole sentence for each. @typedef {Record<Advice, string>} Remedies */

/**
 * @typedef {object} RelationOptions
 * @property {number | undefined} max_diff s; undefined: as the trajectory's times suggest
 * @property {number | undefined} offset s, added to the trajectory's times
 * @property {boolean} loops_only leaves out relations between one pose and the next
 */

/**
 * The summary of a comparison, its notes with what can be done about them, and what `take` takes of it. Throws where the two
 * cannot be compared.
 * @template T
 * @param {Engine} engine
 * @param {Trajectory} reference
 * @param {Trajectory} estimate
 * @param {Partial<EvaluationOptions>} options
 * @param {Remedies} remedies
 * @param {(evaluation: Evaluation) => T} take
 */
export function comparePair(engine, reference, estimate, options, remedies, take) {
  const evaluation = engine.evaluate(reference, estimate, options);
  try {
    const summary = evaluation.summary();
    const notes = [...summary.notes, ...summary.advice.map((advice) => remedies[advice])];
    return { ...take(evaluation), summary: { ...summary, notes } };
  } finally {
    evaluation.free();
  }
}

/**
 * Errors of a trajectory against relations, null where none can be compared, and what is wrong with them.
 * @param {Engine} engine
 * @param {Trajectory} trajectory
 * @param {{ name: string, bytes: Uint8Array }} relations
 * @param {RelationOptions} options
 * @returns {{ relations: RelationErrors | null, problems: string[] }}
 */
export function relate(engine, trajectory, { name, bytes }, { max_diff, offset, loops_only }) {
  try {
    const relations = engine.relation_errors(trajectory, bytes, name, max_diff, loops_only, offset);
    return { relations, problems: relations.notes };
  } catch (error) {
    if (!(error instanceof Error && error.name === 'ScanstitchError')) throw error;
    return { relations: null, problems: [error.message] };
  }
}
