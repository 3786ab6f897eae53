// @ts-check
/** `scanstitch reconstruct`: planar scans to a trajectory, a map and a report. */
import { mkdirSync, writeFileSync } from 'node:fs';
import { basename, join } from 'node:path';
import { CommandError, EXIT, isScanstitchError, readArguments, table } from './command.js';
import { fileProblem, listScans, readInput } from './inputs.js';
import { readSettings, settingsHelp } from './settings.js';

/** @typedef {import('../index.js').ReconstructionResult} ReconstructionResult */

const OPTIONS = /** @type {const} */ ({
  reference: { type: 'string' },
  preset: { type: 'string' },
  set: { type: 'string', multiple: true },
  out: { type: 'string', default: 'scanstitch-out' },
});

/** @type {import('./command.js').Command} */
export const reconstruct = {
  name: 'reconstruct',
  about: 'planar laser scans to a trajectory and a stitched map',
  help: (engine) => `scanstitch reconstruct FILES-OR-FOLDER... [OPTION]...

Places planar laser scans (PLY files, z = 0, in metres) in one frame, that of the first scan. Of a folder, the PLY files
right inside it are taken. Scans are taken in natural order of their names: 2.ply comes before 10.ply.

Options:
  --out DIR          where the results go; made when missing (default: ${OPTIONS.out.default})
  --reference FILE   a trajectory to compare with, TUM or lines of x y z; used for nothing else
  --preset NAME      settings for one purpose, see below (default: ${engine.presets()[0]?.name})
  --set NAME=VALUE   one setting, see below; may be repeated. Angles are radians, or degrees as 35deg

Written into DIR:
  trajectory.tum     a line a scan: index x y z qx qy qz qw, the pose of the sensor in the world
  map.ply            all points in the world frame
  report.json        settings, version, results of every scan, sharpness and comparison, in metres and radians

Printed: a line a scan, and the figures of the map. Sharpness is the mean distance of returns within 29 m to the surface
that the other scans saw there. A file that cannot be used is named on stderr and left out.

Example:
  scanstitch reconstruct scans/ --reference truth.tum --set max_range=30 --out result

${settingsHelp(engine)}`,
  run,
};

/**
 * @param {import('./command.js').Engine} engine
 * @param {string[]} args
 */
function run(engine, args) {
  const { values, positionals } = readArguments('reconstruct', { args, options: OPTIONS, allowPositionals: true });
  if (positionals.length === 0) {
    throw new CommandError('No scans were given: name PLY files or a folder. See: scanstitch reconstruct --help');
  }
  let complaints = 0;
  const complain = (/** @type {string} */ problem) => {
    process.stderr.write(`${problem}\n`);
    complaints += 1;
  };

  const reconstruction = create(engine, readSettings(engine, values.preset, values.set ?? []));
  const usable = listScans(positionals, complain).filter((input) => {
    const bytes = readInput(input, complain);
    return bytes !== null && accepted(() => reconstruction.add_scan(input.name, bytes), complain);
  });
  if (usable.length === 0) throw new CommandError('No scan could be used, so nothing was computed.');
  if (values.reference !== undefined) {
    const reference = { name: basename(values.reference), path: values.reference };
    const bytes = readInput(reference, complain);
    if (bytes) accepted(() => reconstruction.set_reference(reference.name, bytes), complain);
  }

  const { milliseconds, total } = runToTheEnd(reconstruction);
  const result = reconstruction.result();
  write(values.out, {
    'trajectory.tum': reconstruction.trajectory_tum(),
    'map.ply': reconstruction.map_ply(),
    'report.json': reconstruction.report_json(),
  });
  for (const { name, status, reason, cleaning } of result.frames) {
    if (cleaning.non_finite > 0) {
      const some = `${cleaning.non_finite} of its ${cleaning.num_read} points`;
      process.stderr.write(`note: ${name}: ${some} have coordinates that are not finite and were dropped.\n`);
    }
    if (status === 'lost') complain(`${name}: This scan could not be placed: ${reason}.`);
    if (status === 'doubtful') process.stderr.write(`note: ${name} is doubtful: ${reason}.\n`);
  }
  for (const note of result.notes) process.stderr.write(`note: ${note}\n`);
  process.stdout.write(`${frameTable(result, milliseconds)}\n${headline(result, total)}Written to ${values.out}\n`);
  return complaints > 0 ? EXIT.partial : EXIT.done;
}

/**
 * @param {import('./command.js').Engine} engine
 * @param {Partial<import('../index.js').Settings>} settings
 */
function create(engine, settings) {
  try {
    return new engine.Reconstruction(settings);
  } catch (error) {
    if (isScanstitchError(error)) throw new CommandError(error.message);
    throw error;
  }
}

/**
 * Whether the engine took it; what it says otherwise is told.
 * @param {() => void} offer
 * @param {(problem: string) => void} complain
 */
function accepted(offer, complain) {
  try {
    offer();
    return true;
  } catch (error) {
    if (!isScanstitchError(error)) throw error;
    complain(error.message);
    return false;
  }
}

/**
 * Runs it, with the time that each frame's registration took, and all together (ms).
 * @param {import('../index.js').Reconstruction} reconstruction
 */
function runToTheEnd(reconstruction) {
  /** @type {Map<number, number>} */
  const milliseconds = new Map();
  const started = performance.now();
  for (;;) {
    const start = performance.now();
    const { stage, frame } = reconstruction.step();
    if (frame !== null) milliseconds.set(frame, (milliseconds.get(frame) ?? 0) + performance.now() - start);
    if (stage === 'done') return { milliseconds, total: performance.now() - started };
  }
}

/**
 * @param {string} folder
 * @param {Record<string, string | Uint8Array>} files
 */
function write(folder, files) {
  try {
    mkdirSync(folder, { recursive: true });
    for (const [name, contents] of Object.entries(files)) writeFileSync(join(folder, name), contents);
  } catch (error) {
    throw new CommandError(`${folder}: The results could not be written. ${fileProblem(error)}`);
  }
}

/**
 * @param {ReconstructionResult} result
 * @param {Map<number, number>} milliseconds
 */
function frameTable({ frames }, milliseconds) {
  const heads = ['scan', 'x (m)', 'y (m)', 'heading (deg)', 'inliers', 'rmse (mm)', 'iterations', 'ms', 'status'];
  const rows = frames.map((frame, index) => [
    frame.name,
    frame.T_world_sensor.x.toFixed(3),
    frame.T_world_sensor.y.toFixed(3),
    ((frame.T_world_sensor.theta * 180) / Math.PI).toFixed(2),
    String(frame.num_inliers),
    millimetres(frame.inlier_rmse),
    String(frame.iterations),
    (milliseconds.get(index) ?? 0).toFixed(1),
    frame.status,
  ]);
  return table(heads, rows, new Set([0, 8]));
}

/**
 * @param {ReconstructionResult} result
 * @param {number} total (ms)
 */
function headline({ frames, sharpness, comparison }, total) {
  const lines = [`${frames.length} ${frames.length === 1 ? 'scan' : 'scans'} in ${total.toFixed(0)} ms`];
  lines.push(cleaningLine(frames));
  if (sharpness) {
    lines.push(`Sharpness ${millimetres(sharpness.mean_residual)} mm, mean over ${sharpness.num_pairs} pairs`);
  }
  if (comparison) {
    const { name, num_matched, mean, rmse, max } = comparison;
    const figures = `mean ${millimetres(mean)} mm, rmse ${millimetres(rmse)} mm, max ${millimetres(max)} mm`;
    lines.push(`Distance to ${name}: ${figures} over ${num_matched} of ${frames.length} scans`);
  }
  return lines.map((line) => `${line}\n`).join('');
}

/** What cleaning dropped from all scans. @param {ReconstructionResult['frames']} frames */
function cleaningLine(frames) {
  const sum = (/** @type {keyof import('../index.js').CleaningReport} */ field) =>
    frames.reduce((total, { cleaning }) => total + cleaning[field], 0);
  const reasons = /** @type {const} */ ([
    ['not finite', 'non_finite'],
    ['too near', 'too_near'],
    ['at the range limit', 'at_range_limit'],
    ['duplicate', 'duplicates'],
  ]).flatMap(([words, field]) => (sum(field) > 0 ? [`${sum(field)} ${words}`] : []));
  const dropped = reasons.length > 0 ? `; dropped: ${reasons.join(', ')}` : '';
  return `${sum('num_kept')} of ${sum('num_read')} points used${dropped}`;
}

/** @param {number} metres */
function millimetres(metres) {
  return (1000 * metres).toFixed(1);
}
