/** `scanstitch consistency`: how well depth images agree with each other at the poses of a trajectory. */
import { basename } from 'node:path';
import type { ConsistencyReport, DepthConsistency, StepConsistency, Trajectory } from '../../pkg/scanstitch.js';
import { type Command, CommandError, type Engine, EXIT, isScanstitchError, readArguments, table } from './command.js';
import { openInputs, readSource } from './inputs.js';
import type { FrameJob } from './preparers.js';
import { wishesOf } from './reconstruct.js';
import { jobsOf, setIntrinsics } from './reconstruct_spatial.js';
import type { Task } from './results.js';
import { readSettings, spatialCatalogue } from './settings.js';
import { Complaints, note, print, progressLine, tellNotes } from './terminal.js';
import { readTrajectory } from './trajectories.js';

const OPTIONS = {
  intrinsics: { type: 'string' },
  recording: { type: 'string' },
  topic: { type: 'string', multiple: true },
  set: { type: 'string', multiple: true },
  format: { type: 'string' },
  times: { type: 'string' },
  json: { type: 'boolean', default: false },
} as const;

export const consistency: Command = {
  name: 'consistency',
  about: 'how well depth images agree from frame to frame at the poses of a trajectory',
  help: () => `scanstitch consistency FILES-OR-FOLDER-OR-ZIP-OR-BAG... TRAJECTORY [OPTION]...

Judges a trajectory by the depth images themselves; needs no reference. For each step from one frame to the next, every
pixel with depth is carried into the next camera by the relative pose. Where that image has depth as well, the two are
compared: they agree within 2 cm + 2 % of the depth. A step agrees when 85 % of these pixels do.
Poses belong to frames by time, by order where there are as many, or by number where the times count the frames.

Printed: a line a step, and how many agree. Steps with a frame that has no pose or no usable image do not agree.

Options:
  --set NAME=VALUE   depth_scale, fx, fy, cx, cy, field_of_view, max_range (default: 10 m), reference_axes, ...:
                     see the settings for depth images and clouds of scanstitch settings
  --intrinsics FILE  the depth camera, see scanstitch reconstruct --help
  --recording DIR    which recording to use, where a folder or archive holds several (default: the longest)
  --topic ROLE=NAME  a topic of a bag to use, see scanstitch reconstruct --help
  --format FORMAT    form of TRAJECTORY (default: found out); see scanstitch convert --help
  --times FILE       times of its poses, one a line (s), where it has none
  --json             in full precision, in metres and radians

Examples:
  scanstitch consistency office/ scanstitch-out/trajectory.tum
  scanstitch consistency walk.mcap theirs.tum --set max_range=5 --json
`,
  run,
};

async function run(engine: Engine, args: string[]) {
  const { values, positionals } = readArguments('consistency', { args, options: OPTIONS, allowPositionals: true });
  const path = positionals.at(-1);
  if (path === undefined || positionals.length < 2) {
    throw new CommandError('Name a recording and a trajectory. See: scanstitch consistency --help');
  }
  const settings = readSettings(spatialCatalogue(engine), undefined, values.set ?? []);
  new engine.SpatialReconstruction(settings).free();
  const complaints = new Complaints();
  const { complain } = complaints;
  const { recording, close } = await openInputs(positionals.slice(0, -1), complain, wishesOf(values));
  try {
    tellNotes(recording.notes, complain);
    if (recording.kind !== 'depth_images') {
      throw new CommandError('There are no depth images in the input: only those can be compared pixel by pixel.');
    }
    const { intrinsics, format, times } = values;
    const options = {
      out: '',
      reference: undefined,
      odometry: undefined,
      intrinsics,
      preset: undefined,
      set: [],
      workers: 0,
    };
    const task = { engine, recording, options, complain };
    const trajectory = readTrajectory(engine, path, { format, times }, fail);
    if (!trajectory) return EXIT.nothing;
    const jobs = jobsOf(task);
    const { report, notes } = await compared(task, trajectory, jobs, settings);
    notes.forEach(note);
    const named = { recording: recording.root, trajectory: path, ...report };
    print(values.json ? `${JSON.stringify(named, null, 2)}\n` : printed(report, jobs));
  } catch (error) {
    if (!isScanstitchError(error)) throw error;
    throw new CommandError(
      error.message.startsWith(basename(path)) ? error.message : `${basename(path)}: ${error.message}`,
    );
  } finally {
    await close();
  }
  return complaints.exitCode;
}

function fail(problem: string): never {
  throw new CommandError(problem);
}

async function compared(task: Task, trajectory: Trajectory, jobs: FrameJob[], settings: Record<string, unknown>) {
  const { engine, complain } = task;
  const times = jobs.flatMap(({ time }) => time ?? []);
  const known = times.length === jobs.length ? Float64Array.from(times) : undefined;
  const comparison = new engine.DepthConsistency(trajectory, jobs.length, known, settings);
  const progress = progressLine(jobs.length);
  try {
    await setIntrinsics(comparison, task);
    let numUsed = 0;
    for (const { index, name, file } of jobs) {
      const bytes = await readSource(file, name, complain);
      if (!bytes) comparison.skip();
      else if (isAdded(comparison, name, bytes, complain)) numUsed += 1;
      progress.show(index + 1);
    }
    if (numUsed < 2) fail('Fewer than two depth images can be used, so nothing was compared.');
    return { report: comparison.report(), notes: comparison.notes };
  } finally {
    progress.clear();
    comparison.free();
    trajectory.free();
  }
}

function isAdded(comparison: DepthConsistency, name: string, bytes: Uint8Array, complain: (problem: string) => void) {
  try {
    comparison.add(name, bytes);
    return true;
  } catch (error) {
    if (!isScanstitchError(error)) throw error;
    complain(error.message);
    return false;
  }
}

function printed({ steps, num_agreeing, mean_share, convention, limits }: ConsistencyReport, jobs: FrameJob[]) {
  const heads = ['from', 'to', 'pixels', 'agree (%)', 'moved (m)', 'turned (deg)', 'step'];
  const rows = steps.map((step) => [
    jobs[step.frame]?.name ?? '',
    jobs[step.frame + 1]?.name ?? '',
    String(step.num_visible),
    figure(step.share, 100, 1),
    figure(step.translation, 1, 3),
    figure(step.rotation, 180 / Math.PI, 2),
    assessmentOf(step),
  ]);
  const share = steps.length > 0 ? (100 * num_agreeing) / steps.length : 0;
  const tolerance = `${100 * limits.absolute_tolerance} cm + ${100 * limits.relative_tolerance} %`;
  return `${table(heads, rows, new Set([0, 1, 6]))}
${num_agreeing} of ${steps.length} steps agree (${share.toFixed(1)} %): ${100 * limits.min_share} % of the common pixels within ${tolerance}
mean share of agreeing pixels: ${(100 * mean_share).toFixed(1)} %
poses read as ${convention}
`;
}

function assessmentOf({ agrees, translation, share }: StepConsistency) {
  if (agrees) return 'agrees';
  if (translation === null) return 'no pose';
  return share === null ? 'nothing in common' : 'disagrees';
}

function figure(value: number | null, factor: number, digits: number) {
  return value === null ? '-' : (factor * value).toFixed(digits);
}
