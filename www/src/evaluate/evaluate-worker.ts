/** The thread of comparisons: reads trajectories, keeps them, compares them. */
import { evaluate, init, relation_errors, Trajectory } from '../engine/package.js';
import { comparePair, relate, type Remedies } from '../../../package/evaluation/compare.js';
import type { Command, Comparison, Query, QueryApi, Result, TimesFile, TrajectoryFile } from './protocol.js';
import { attempt, serve, transferred } from '../engine/serve.js';
import { readTrajectory } from './read-trajectory.js';

const REMEDIES: Remedies = {
  interpolate: 'Tick “interpolate” under “Matching of poses” to compare the poses at the same times.',
  conventions_as_read: 'Choose “as read” under “Matching of poses” to compare the files as they are.',
  fit_scale: 'Choose “Sim(3), with scale” under “Alignment” to fit the scale.',
};

const files = new Map<number, TrajectoryFile>();
/** Trajectories by their file, each read once, with the id of their file of times. */
const known = new Map<number, { trajectory: Trajectory; times: number | null }>();

serve<QueryApi<Command, Query, Result>>({
  async start(module) {
    await init({ module_or_path: module });
  },
  tell({ add, remove }) {
    for (const file of add) files.set(file.id, file);
    for (const id of remove) {
      files.delete(id);
      forget(id);
    }
  },
  ask(query) {
    const result = compareAll(query);
    const arrays = result.comparisons.flatMap((comparison) => Object.values(comparison));
    const buffers = arrays.flatMap((array) => (ArrayBuffer.isView(array) ? [array.buffer as ArrayBuffer] : []));
    return transferred(result, buffers);
  },
});

function compareAll(query: Query): Result {
  const start = performance.now();
  const result: Result = {
    comparisons: [],
    refusals: [],
    realigned: null,
    referenceProblem: null,
    referenceNotes: [],
    relationProblems: [],
    elapsed_ms: 0,
  };
  const reference = attempt(() => read(query.reference, query.times));
  if ('problem' in reference) {
    result.referenceProblem = reference.problem;
    return result;
  }
  result.referenceNotes = reference.value.notes;
  Object.assign(result, compareEach(reference.value, query));
  const [refusal] = result.refusals;
  // Positions alone have no first pose to make equal: an empty page would help nobody.
  if (query.options.alignment === 'origin' && result.comparisons.length === 0 && refusal) {
    const fitted = compareEach(reference.value, { ...query, options: { ...query.options, alignment: 'se3' } });
    if (fitted.comparisons.length > 0) Object.assign(result, fitted, { realigned: refusal.problem });
  }
  result.elapsed_ms = performance.now() - start;
  return result;
}

function compareEach(
  reference: Trajectory,
  query: Query,
): Pick<Result, 'comparisons' | 'refusals' | 'relationProblems'> {
  const compared = query.estimates.map((id) => ({
    id,
    name: nameOf(id),
    ...attempt(() => compare(reference, id, query)),
  }));
  const found = compared.flatMap((one) => ('value' in one ? [one.value] : []));
  return {
    comparisons: found.map(({ comparison }) => comparison),
    refusals: compared.flatMap(({ id, name, ...one }) =>
      'problem' in one ? [{ id, name, problem: one.problem }] : [],
    ),
    relationProblems: found.flatMap(({ relationProblems }) => relationProblems),
  };
}

function compare(
  reference: Trajectory,
  id: number,
  query: Query,
): { comparison: Comparison; relationProblems: string[] } {
  const { options, relations, loops_only } = query;
  const estimate = read(id, query.times);
  const name = nameOf(id);
  const { summary, ...compared } = comparePair(
    { evaluate, relation_errors },
    reference,
    estimate,
    options,
    REMEDIES,
    (evaluation) => ({
      errors: evaluation.errors(),
      error_poses: evaluation.error_poses(),
      stamps: evaluation.stamps() ?? null,
      distances: evaluation.distances(),
      reference_positions: evaluation.reference_positions(),
      estimate_positions: evaluation.estimate_positions(),
      referenceAngles: evaluation.reference_roll_pitch_yaw() ?? null,
      estimateAngles: evaluation.estimate_roll_pitch_yaw() ?? null,
    }),
  );
  const { max_diff, offset } = options;
  const related =
    relations && relate({ evaluate, relation_errors }, estimate, relations, { max_diff, offset, loops_only });
  return {
    comparison: {
      id,
      name,
      summary: { ...summary, notes: [...estimate.notes, ...summary.notes] },
      relations: related?.relations ?? null,
      ...compared,
    },
    relationProblems: related?.problems.map((problem) => `${name}: ${problem}`) ?? [],
  };
}

function read(id: number, times: TimesFile | null): Trajectory {
  const found = known.get(id);
  const wanted = times?.id ?? null;
  if (found && (found.times === wanted || (found.times === null && found.trajectory.stamps() !== undefined))) {
    return found.trajectory;
  }
  forget(id);
  const trajectory = readTrajectory(Trajectory, files.get(id) ?? { name: '', parts: [] });
  const isTimed = trajectory.stamps() !== undefined;
  try {
    if (times && !isTimed) trajectory.set_stamps(times.bytes, times.name);
  } catch (error) {
    trajectory.free();
    throw error;
  }
  known.set(id, { trajectory, times: isTimed ? null : wanted });
  return trajectory;
}

function forget(id: number): void {
  known.get(id)?.trajectory.free();
  known.delete(id);
}

function nameOf(id: number): string {
  return files.get(id)?.name ?? '';
}
