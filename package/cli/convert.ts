/** `scanstitch convert`: a trajectory from one form into another. */
import { basename, extname } from 'node:path';
import type { TrajectoryFormat } from '../../pkg/scanstitch.js';
import { lookUp } from '../base/look_up.js';
import { printable } from '../base/printable.js';
import { type Command, CommandError, type Engine, EXIT, optionsOf, readArguments } from './command.js';
import { writeWhole } from './disk.js';
import { note, print } from './terminal.js';
import { readTrajectory, TRAJECTORY_FORMATS, TRAJECTORY_HELP, trajectoryFormat } from './trajectories.js';

const OPTIONS = optionsOf({ texts: 'from to times' });

/** What the ending of a file's name stands for. */
const BY_ENDING: Record<string, TrajectoryFormat> = {
  '.tum': 'tum',
  '.kitti': 'kitti',
  '.npy': 'npy',
  '.csv': 'pose_table',
  '.log': 'matrices',
};

export const convert: Command = {
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

async function run(engine: Engine, args: string[]) {
  const { values, positionals } = readArguments('convert', { args, options: OPTIONS, allowPositionals: true });
  const [input, output] = positionals;
  if (input === undefined || output === undefined || positionals.length > 2) {
    throw new CommandError('Name one input and one output. See: scanstitch convert --help');
  }
  const to = values.to ?? lookUp(BY_ENDING, extname(output).toLowerCase());
  if (to === undefined) throw new CommandError(`Name the form of ${basename(output)} with --to.`);
  const format = trajectoryFormat(to);
  const fail = (problem: string) => {
    throw new CommandError(problem);
  };
  const trajectory = readTrajectory(engine, input, { format: values.from, times: values.times }, fail);
  if (!trajectory) return EXIT.nothing;
  for (const text of trajectory.notes) note(`${basename(input)}: ${text}`);
  await writeWhole(output, trajectory.write(format));
  print(`${trajectory.length} poses, ${trajectory.format} to ${format}: written to ${printable(output)}\n`);
  trajectory.free();
  return EXIT.done;
}
