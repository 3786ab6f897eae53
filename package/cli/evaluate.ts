/** `scanstitch evaluate`: errors of estimated trajectories against a reference, as evo computes them. */
import { basename } from 'node:path';
import type { EvaluationOptions, EvaluationSummary, RelationErrors } from '../../pkg/scanstitch.js';
import { printable } from '../base/printable.js';
import { csv, markdown } from '../base/tables.js';
import { comparePair, type RelationOptions, type Remedies } from '../evaluation/compare.js';
import { columnsOf, formatValue } from '../evaluation/table.js';
import {
  attempt,
  type Command,
  CommandError,
  type Engine,
  numberIn,
  oneOf,
  optionsOf,
  readArguments,
  table,
  wholeNumber,
} from './command.js';
import {
  compareRelations,
  readRelations,
  RELATION_HEADS,
  relationCells,
  relationsJson,
  relationsText,
} from './relations.js';
import { Complaints, note, print } from './terminal.js';
import { readTrajectory, TRAJECTORY_FORMATS, TRAJECTORY_HELP } from './trajectories.js';

type Complain = (problem: string) => void;
type RelationFile = NonNullable<ReturnType<typeof readRelations>>;

const CHOICES = {
  align: ['none', 'origin', 'se3', 'sim3', 'scale'],
  by: ['auto', 'time', 'index'],
  metric: ['ape', 'rpe'],
  relation: [
    'translation_part',
    'rotation_part',
    'full_transformation',
    'rotation_angle_rad',
    'rotation_angle_deg',
    'point_distance',
    'point_distance_error_ratio',
  ],
  'delta-unit': ['frames', 'meters', 'seconds', 'degrees', 'radians'],
  sort: ['rmse', 'mean', 'median', 'std', 'min', 'max', 'sse'],
  conventions: ['detected', 'as_read'],
  table: ['text', 'markdown', 'csv'],
} as const;

const REMEDIES: Remedies = {
  interpolate: '--interpolate compares the poses at the same times.',
  conventions_as_read: '--conventions as_read compares the files as they are.',
  fit_scale: '--align sim3 fits the scale.',
};

const OPTIONS = {
  ...optionsOf({
    texts: 'align-first max-diff offset delta delta-tolerance relations times format',
    flags: 'interpolate all-pairs pairs-from-reference drift loops-only json errors',
  }),
  align: { type: 'string', default: 'none' },
  by: { type: 'string', default: 'auto' },
  conventions: { type: 'string', default: 'detected' },
  metric: { type: 'string', default: 'ape' },
  relation: { type: 'string', default: 'translation_part' },
  'delta-unit': { type: 'string', default: 'frames' },
  sort: { type: 'string', default: 'rmse' },
  table: { type: 'string', default: 'text' },
} as const;

export const evaluate: Command = {
  name: 'evaluate',
  about: 'errors of trajectories against a reference, with the figures of evo, ranked',
  help: () => `scanstitch evaluate REFERENCE ESTIMATE... [OPTION]...
scanstitch evaluate ESTIMATE --relations FILE [OPTION]...

Compares estimated trajectories with the reference and ranks them. Definitions, defaults and figures are those of evo
(evo_ape and evo_rpe 1.38). Poses are associated by their times where both files have times, by their numbers where one
has the numbers of the other's poses, and by their index otherwise.
A single trajectory is compared with known relations between its poses.

${TRAJECTORY_HELP}
Association of poses:
  --by WAY                ${CHOICES.by.join(' | ')} (default: auto)
  --max-diff SECONDS      largest difference of times that are associated (default: 0.01)
  --offset SECONDS        added to the estimates' times (default: 0)
  --interpolate           of the reference and the estimate the one with the shorter interval is interpolated at the
                          times of the other
  --times FILE            times of the poses, one a line (s), for files without: the reference and the estimates
  --format FORMAT         format of all files: ${TRAJECTORY_FORMATS.join(' | ')}
                          (default: detected)
  --conventions HOW       detected: order of the quaternions, sensor axes, direction and handedness are those with which
                          the motions of both agree, and a note tells what was changed; as_read: as the format has them
                          (default: detected)

Alignment of an estimate with the reference:
  --align WAY             none | origin (first poses aligned) | se3 (Umeyama) | sim3 (with scale) | scale (alone)
                          (default: none)
  --align-first N         the fit uses the first N poses only

Error:
  --metric METRIC         ape (absolute) | rpe (relative pose error) (default: ape)
  --relation RELATION     translation_part (m) | rotation_angle_deg | rotation_angle_rad | rotation_part |
                          full_transformation | point_distance (m) | point_distance_error_ratio (rpe, %)
                          (default: translation_part)
  --delta NUMBER          rpe: separation of the two poses of a pair (default: 1)
  --delta-unit UNIT       ${CHOICES['delta-unit'].join(' | ')} (default: frames)
  --all-pairs             rpe: a pair begins at every pose; otherwise each pair begins where the last one ended
  --delta-tolerance PART  rpe with all pairs: largest deviation from delta, as a share of it (default: 0.1)
  --pairs-from-reference  rpe: path and angle are measured along the reference, not the estimate
  --drift                 drift as in the KITTI benchmark (%, deg/m), over 100 to 800 m or scaled to a short path

Relations (Kuemmerle et al. 2009): mean, deviation, median and largest error, and the share beyond 0.5 m or 5 degrees:
  --relations FILE        lines of time_i time_j dx dy dz roll pitch yaw (s, m, rad); poses are interpolated at their
                          times where the nearest is within --max-diff, or half the interval of the estimate's
                          times but at most 0.1 s; or EDGE2, EDGE_SE3:QUAT, which refer to poses by index from 0
  --loops-only            leaves out relations between one pose and the next

Output:
  --sort FIGURE           ${CHOICES.sort.join(' | ')} (default: rmse)
  --table FORM            ${CHOICES.table.join(' | ')} (default: text)
  --json                  everything, in full precision
  --errors                with --json: every single error as well

Examples:
  scanstitch evaluate reference.tum mine.tum --align se3
  scanstitch evaluate GT_pose.npy hand-ins/*.npy --table markdown
  scanstitch evaluate gt.txt est.txt --metric rpe --delta 1 --delta-unit meters --all-pairs --json
  scanstitch evaluate result/trajectory.tum --relations aces.relations
`,
  run,
};

function run(engine: Engine, args: string[]) {
  const { values, positionals } = readArguments('evaluate', {
    args: joinNegative(args),
    options: OPTIONS,
    allowPositionals: true,
  });
  const [reference, ...estimates] = positionals;
  const isAlone = estimates.length === 0;
  if (reference === undefined || (isAlone && values.relations === undefined)) {
    throw new CommandError(
      'Name the reference and one estimate at least, or one trajectory and --relations FILE. ' +
        'See: scanstitch evaluate --help',
    );
  }
  for (const [option, choices] of Object.entries(CHOICES)) {
    const value = values[option as keyof typeof CHOICES];
    oneOf(option, value, choices);
  }
  const options = evaluationOptions(engine, values);
  const complaints = new Complaints();
  const { complain } = complaints;
  const relations = values.relations === undefined ? null : readRelations(values.relations, complain);
  if (isAlone) {
    if (!relations) throw new CommandError('The relations could not be used, so nothing was computed.');
    relationsAlone(engine, reference, relations, values, complain);
  } else {
    rank(engine, reference, estimates, relations, { options, values }, complain);
  }
  return complaints.exitCode;
}

type Values = ReturnType<typeof readArguments<{ options: typeof OPTIONS }>>['values'];

/** One trajectory against relations between its poses. */
function relationsAlone(engine: Engine, path: string, relations: RelationFile, values: Values, complain: Complain) {
  const trajectory = readTrajectory(engine, path, { format: values.format, times: values.times }, complain);
  if (!trajectory) throw new CommandError('The trajectory could not be used, so nothing was computed.');
  const name = basename(path);
  tell(name, trajectory.notes);
  const known = compareRelations(engine, trajectory, name, relations, relationOptions(values), complain);
  trajectory.free();
  if (!known) throw new CommandError('No relation could be compared, so nothing was computed.');
  if (values.json) {
    const estimates = [{ name, relations: relationsJson(known, values.errors ?? false) }];
    const report = { version: engine.version(), relations: relations.name, estimates };
    print(`${JSON.stringify(report, null, 2)}\n`);
  } else if (values.table === 'text') {
    print(relationsText([{ name, relations: known }], relations.name));
  } else {
    print(rowsText(['estimate', ...RELATION_HEADS], [[name, ...relationCells(known)]], values.table, 0));
  }
}

/** Estimates against the reference, ranked. */
function rank(
  engine: Engine,
  reference: string,
  estimates: string[],
  relations: RelationFile | null,
  { options, values }: { options: Partial<EvaluationOptions>; values: Values },
  complain: Complain,
) {
  const read = { format: values.format, times: values.times };
  const referenceTrajectory = readTrajectory(engine, reference, read, complain);
  if (!referenceTrajectory) throw new CommandError('The reference could not be used, so nothing was computed.');
  tell(basename(reference), referenceTrajectory.notes);

  const names = shortNames(estimates);
  const results = estimates.flatMap((path, index) => {
    const name = names[index] ?? path;
    const trajectory = readTrajectory(engine, path, read, complain);
    if (!trajectory) return [];
    tell(name, trajectory.notes);
    const comparison = attempt(name, complain, () => {
      const withErrors = values.errors ?? false;
      const { summary, ...errors } = comparePair(
        engine,
        referenceTrajectory,
        trajectory,
        options,
        REMEDIES,
        (compared) => (withErrors ? { errors: [...compared.errors()] } : {}),
      );
      tell(name, summary.notes);
      const known =
        relations && compareRelations(engine, trajectory, name, relations, relationOptions(values), complain);
      return { name, summary, errors, relations: known };
    });
    trajectory.free();
    return comparison;
  });
  referenceTrajectory.free();
  if (results.length === 0) throw new CommandError('No estimate could be compared, so nothing was computed.');

  const figure = values.sort as (typeof CHOICES.sort)[number];
  results.sort((a, b) => a.summary.statistics[figure] - b.summary.statistics[figure]);
  if (values.json) {
    const ranked = results.map(({ name, summary, errors, relations }, index) => ({
      rank: index + 1,
      name,
      ...summary,
      ...errors,
      relations: relationsJson(relations, values.errors ?? false),
    }));
    const report = { version: engine.version(), reference: basename(reference), options, estimates: ranked };
    print(`${JSON.stringify(report, null, 2)}\n`);
  } else {
    print(printed(results, basename(reference), values.table ?? 'text', values.drift ?? false, options));
    if (relations && values.table === 'text') print(`\n${relationsText(results, relations.name)}`);
  }
}

/** `--offset -0.25` as `--offset=-0.25`, which is what Node's parser wants. */
function joinNegative(args: string[]) {
  return args.flatMap((arg, index) => {
    const next = args[index + 1];
    if (arg === '--offset' && next?.startsWith('-')) return [`${arg}=${next}`];
    return args[index - 1] === '--offset' && arg.startsWith('-') ? [] : [arg];
  });
}

function evaluationOptions(
  engine: Engine,
  values: Record<string, string | boolean | undefined>,
): Partial<EvaluationOptions> {
  const number = (option: string) => numberOf(values, option);
  const alignFirst = wholeNumber('align-first', values['align-first'] as string | undefined);
  const given = {
    association: values.by,
    max_diff: number('max-diff'),
    offset: number('offset'),
    interpolate: values.interpolate,
    conventions: values.conventions,
    alignment: values.align,
    align_first: alignFirst,
    metric: values.metric,
    relation: values.relation,
    delta: number('delta'),
    delta_unit: values['delta-unit'],
    all_pairs: values['all-pairs'],
    delta_tolerance: number('delta-tolerance'),
    pairs_from_reference: values['pairs-from-reference'],
  };
  const defaults = engine.evaluation_defaults();
  return { ...defaults, ...Object.fromEntries(Object.entries(given).filter(([, value]) => value !== undefined)) };
}

/** The number that an option has; undefined where it is not given. */
function numberOf(values: Record<string, string | boolean | undefined>, option: string) {
  return numberIn(option, values[option] as string | undefined, 'a number', () => true);
}

function relationOptions(values: Values): RelationOptions {
  const [max_diff, offset] = [numberOf(values, 'max-diff'), numberOf(values, 'offset')];
  return { max_diff, offset, loops_only: values['loops-only'] ?? false };
}

function tell(name: string, notes: string[]) {
  for (const text of notes) note(`${name}: ${text}`);
}

/** The names of files where they differ, their paths otherwise. */
function shortNames(paths: string[]) {
  const names = paths.map((path) => basename(path));
  return new Set(names).size === names.length ? names : paths;
}

/** @param reference its name */
function printed(
  results: { name: string; summary: EvaluationSummary; relations: RelationErrors | null }[],
  reference: string,
  form: string,
  withDrift: boolean,
  options: Partial<EvaluationOptions>,
) {
  const columns = columnsOf(results[0]?.summary.unit ?? '', options, withDrift);
  const hasRelations = results.some(({ relations }) => relations);
  const heads = ['rank', 'estimate', 'poses', ...columns.map(({ label }) => label)];
  if (hasRelations) heads.push('relations', 'trans (m)', 'rot (deg)');
  const rows = results.map(({ name, summary, relations }, index) => {
    const { num_matched, num_estimate } = summary;
    const figures = columns.map(({ value }) => formatValue(value(summary), '-'));
    const row = [String(index + 1), name, `${num_matched}/${num_estimate}`, ...figures];
    if (hasRelations) {
      row.push(String(relations?.num_compared ?? '-'), formatValue(relations?.translation.mean ?? null, '-'));
      row.push(formatValue(relations && (relations.rotation.mean * 180) / Math.PI, '-'));
    }
    return row;
  });
  if (form !== 'text')
    return rowsText(
      [...heads, 'reference'],
      rows.map((row) => [...row, reference]),
      form,
      1,
    );
  const described = `${options.metric === 'rpe' ? 'RPE' : 'APE'} of ${options.relation}, alignment ${options.alignment}`;
  const poses = `${results[0]?.summary.num_reference} poses`;
  return `${described}\nReference: ${printable(reference)}, ${poses}\n${table(heads, rows, new Set([1]))}`;
}

/**
 * As Markdown or CSV.
 * @param nameColumn holds no numbers, and nor does the last one, where it is the reference
 */
function rowsText(heads: string[], rows: string[][], form: string, nameColumn: number) {
  const shown = rows.map((row) => row.map((cell) => printable(cell)));
  const texts = new Set([nameColumn, heads.indexOf('reference')]);
  return form === 'markdown' ? markdown(heads, shown, texts) : csv([heads, ...shown]);
}
