// @ts-check
/** `scanstitch convert`: a trajectory from one form into another. */
import { writeFileSync } from 'node:fs';
import { basename, extname } from 'node:path';
import { CommandError, EXIT, isScanstitchError, readArguments } from './command.js';
import { fileProblem } from './inputs.js';
import { readTrajectory, TRAJECTORY_FORMATS, TRAJECTORY_HELP, trajectoryFormat } from './trajectories.js';

const OPTIONS = /** @type {const} */ ({
  from: { type: 'string' },
  to: { type: 'string' },
  times: { type: 'string' },
});

/** What the ending of a file's name stands for. @type {Record<string, import('../index.js').TrajectoryFormat>} */
const BY_ENDING = { '.tum': 'tum', '.kitti': 'kitti', '.npy': 'npy', '.csv': 'pose_table', '.log': 'matrices' };

/** @type {import('./command.js').Command} */
export const convert = {
  name: 'convert',
  about: 'a trajectory from one format into another',
  help: () => `scanstitch convert INPUT OUTPUT [OPTION]...

Reads a trajectory and writes it in another format. Numbers are written so that they read back as the same.

${TRAJECTORY_HELP}
Options:
  --to FORMAT      ${TRAJECTORY_FORMATS.join(' | ')}
                   (default: by the ending of OUTPUT: .tum, .kitti, .npy, .csv, .log)
  --from FORMAT    form of INPUT (default: found out)
  --times FILE     times of the poses, one a line (s), where INPUT has none

Example:
  scanstitch convert GT_pose.npy reference.tum
`,
  run,
};

/**
 * @param {import('./command.js').Engine} engine
 * @param {string[]} args
 */
function run(engine, args) {
  const { values, positionals } = readArguments('convert', { args, options: OPTIONS, allowPositionals: true });
  const [input, output] = positionals;
  if (input === undefined || output === undefined || positionals.length > 2) {
    throw new CommandError('Name one input and one output. See: scanstitch convert --help');
  }
  const to = values.to ?? BY_ENDING[extname(output).toLowerCase()];
  if (to === undefined) throw new CommandError(`Name the form of ${basename(output)} with --to.`);
  const format = trajectoryFormat(to);
  const fail = (/** @type {string} */ problem) => {
    throw new CommandError(problem);
  };
  const trajectory = readTrajectory(engine, input, { format: values.from, times: values.times }, fail);
  if (!trajectory) return EXIT.nothing;
  for (const note of trajectory.notes) process.stderr.write(`note: ${basename(input)}: ${note}\n`);
  try {
    writeFileSync(output, trajectory.write(format));
  } catch (error) {
    throw new CommandError(isScanstitchError(error) ? error.message : `${output}: ${fileProblem(error)}`);
  }
  process.stdout.write(`${trajectory.length} poses, ${trajectory.format} to ${format}: written to ${output}\n`);
  trajectory.free();
  return EXIT.done;
}
