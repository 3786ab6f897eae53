/** `scanstitch strategies`: what a map costs and gains, strategies side by side. */
import { availableParallelism } from 'node:os';
import { basename } from 'node:path';
import type { StrategyComparison } from '../../pkg/scanstitch.js';
import { comparedPlanar, planarFramesCsvOf } from '../report/planar_strategies.js';
import { csvOf, framesCsvOf, type Row, shownTable } from '../report/strategy_table.js';
import type { Registrar } from '../run/spatial_run.js';
import { StrategyRace, timed } from '../run/strategy_race.js';
import { type Command, CommandError, type Engine, optionsOf, readArguments, table, untilInterrupt } from './command.js';
import { writeWhole } from './disk.js';
import { openInputs, readFirst } from './inputs.js';
import type { FrameJob } from './preparers.js';
import { readWorkers, wishesOf, withoutNamed } from './reconstruct.js';
import { addInputs, runToTheEnd } from './reconstruct_planar.js';
import { jobsOf, nothingComputed, readReference, setIntrinsics } from './reconstruct_spatial.js';
import { accepted, type Task } from './results.js';
import { runFrames } from './run_frames.js';
import {
  type Catalogue,
  describeAll,
  planarCatalogue,
  readSettings,
  spatialCatalogue,
  strategyCatalogue,
} from './settings.js';
import { Complaints, note, print, tellNotes } from './terminal.js';

const OPTIONS = optionsOf({
  texts: 'strategies reference intrinsics recording workers out frames',
  lists: 'strategy topic set',
  flags: 'json',
});

type Chosen = { name: string; label: string; settings: Record<string, unknown> };

/** What is written of a comparison. */
interface Table {
  rows: Row[];
  milliseconds: number[][];
  /** A line for each frame of each strategy. */
  frames: string;
}

export const strategies: Command = {
  name: 'strategies',
  about: 'accuracy, time and map size of strategies of odometry, side by side',
  help: (engine) => `scanstitch strategies FILES-OR-FOLDER-OR-ZIP-OR-BAG... [OPTION]...

Runs several strategies on one recording of depth images or clouds: each frame is registered by ICP to the map of the
frames before it, and the strategies differ in the map and in the registration. The reference, where one is found or
given, is used for the errors only. On planar scans the strategies are the presets of the reconstruction, with its
settings: see scanstitch settings.

Output, one line per strategy: points of the map and their bytes (24 a point); time per frame (median, last, and its
growth from frame to frame with the standard error); distance to the reference (APE, first poses aligned) and error from
frame to frame (RPE); sharpness of the map (mean map entropy, mean plane variance). Ctrl-C stops; what has been computed
is printed.

Options:
  --strategies A,B   which of those below, in this order (default: all of them)
  --strategy "NAME, SETTING=VALUE, ..."
                     one of those below with other settings; may be repeated. They come after those of --strategies
  --out FILE.csv     the table in full precision, in SI units, with the settings of each strategy
  --frames FILE.csv  a line for each frame of each strategy: ms, points of the map, error, pose
  --json             print everything as JSON
  --reference FILE   a trajectory to compare with, or a folder with a file for each frame
  --intrinsics FILE  the depth camera, see scanstitch reconstruct --help
  --recording DIR    which recording to use, where a folder or archive holds several (default: the longest)
  --topic ROLE=NAME  a topic of a bag to use, see scanstitch reconstruct --help
  --set NAME=VALUE   how frames are read, for all strategies alike: see the settings for depth images and clouds of
                     scanstitch settings. voxel_size thins every frame before all else (depth images: 0.05 m)
  --workers N        threads that prepare frames in advance (default: one less than there are cores)

Examples:
  scanstitch strategies second_floor/ --out table.csv
  scanstitch strategies bag.zip --strategies plain,voxels_0.1 --strategy "voxels_0.1, kept=mean, crop_distance=8"

${describeAll(strategyCatalogue(engine))}`,
  run,
};

async function run(engine: Engine, args: string[]) {
  const { values, positionals } = readArguments('strategies', { args, options: OPTIONS, allowPositionals: true });
  if (positionals.length === 0) {
    throw new CommandError(
      'No input was given: name files, a folder, a ZIP archive or a bag. See: scanstitch strategies --help',
    );
  }
  const complaints = new Complaints();
  const { complain } = complaints;
  const { recording, close } = await openInputs(positionals, complain, wishesOf(values));
  const { reference, intrinsics } = values;
  const workers = values.workers === undefined ? Math.max(1, availableParallelism() - 1) : readWorkers(values.workers);
  const options = { out: '', reference, odometry: undefined, intrinsics, preset: undefined, set: [], workers };
  try {
    tellNotes(withoutNamed(recording, complain), complain);
    const { kind } = recording;
    if (kind === 'nothing')
      throw new CommandError('No scans, depth images or clouds were found to compare strategies on.');
    const isPlanar = kind === 'planar_scans';
    const catalogue = isPlanar ? planarCatalogue(engine) : strategyCatalogue(engine);
    const common = isPlanar ? catalogue : spatialCatalogue(engine);
    const chosen = choose(catalogue, values.strategies, values.strategy ?? []);
    const settings = readSettings(common, undefined, values.set ?? []);
    const task = { engine, recording, options, complain };
    const compared = await (isPlanar ? comparePlanar : compareAll)(task, chosen, settings);
    if (values.out !== undefined) await writeWhole(values.out, csvOf(compared.rows));
    if (values.frames !== undefined) await writeWhole(values.frames, compared.frames);
    print(values.json ? jsonOf(compared) : printed(compared.rows));
    for (const file of [values.out, values.frames]) if (file !== undefined) note(`Written to ${file}`);
  } finally {
    await close();
  }
  return complaints.exitCode;
}

function choose(catalogue: Catalogue, names: string | undefined, others: string[]): Chosen[] {
  const known = catalogue.presets.map(({ name }) => name);
  const listed = names === undefined ? (others.length > 0 ? [] : known) : names.split(',').map((name) => name.trim());
  return [...listed, ...others]
    .filter((text) => text !== '')
    .map((text) => {
      const [name = '', ...assignments] = text.split(',').map((part) => part.trim());
      const label = assignments.length > 0 ? `${name}, ${assignments.join(', ')}` : name;
      return { name: label, label, settings: readSettings(catalogue, name, assignments) };
    });
}

async function compareAll(task: Task, chosen: Chosen[], settings: Record<string, unknown>): Promise<Table> {
  const { engine, complain } = task;
  const settingsOf = chosen.map(({ settings }) => settings);
  const comparison = new engine.StrategyComparison(settingsOf, settings);
  await setIntrinsics(comparison, task);
  const jobs = jobsOf(task);
  const reference = await readReference(task);
  if (reference) accepted(() => comparison.set_reference(reference.name, reference.bytes, jobs.length), complain);
  const { race, numPlaced, isStopped } = await untilInterrupt((signal) =>
    runRace(task, jobs, comparison, chosen.length, signal),
  );
  if (numPlaced === 0) throw nothingComputed({ isStopped });
  const rows = chosen.map(({ name, label }, strategy) => {
    const result = comparison.result(strategy, Float64Array.from(race.milliseconds[strategy] ?? []));
    return { name, label, result };
  });
  for (const text of new Set(rows.flatMap(({ result }) => result.notes))) {
    if (reference && text.startsWith(basename(reference.name))) complain(text);
    else note(text);
  }
  comparison.free();
  return { rows, milliseconds: race.milliseconds, frames: framesCsvOf(rows, race.milliseconds) };
}

/** One run after the other; `settings` are common to all. */
async function comparePlanar(task: Task, chosen: Chosen[], settings: Record<string, unknown>): Promise<Table> {
  const results = await untilInterrupt(async (signal) => {
    const done = [];
    const reconstruction = new task.engine.Reconstruction({ ...chosen[0]?.settings, ...settings });
    await addInputs(task, reconstruction);
    for (const { name, label, settings: own } of chosen) {
      if (signal.aborted) break;
      reconstruction.set_settings({ ...own, ...settings });
      const { milliseconds, total } = await runToTheEnd(reconstruction, signal);
      const result = reconstruction.result();
      if (result.frames.length > 0)
        done.push({
          name,
          label,
          result,
          milliseconds: result.frames.map((_, at) => milliseconds.get(at) ?? 0),
          total,
          sizes: reconstruction.map_sizes(0),
        });
    }
    reconstruction.free();
    return done;
  });
  if (results.length === 0) throw nothingComputed({ isStopped: true });
  for (const text of new Set(results.flatMap(({ result }) => result.notes))) note(text);
  return {
    rows: results.map(({ name, label, result, sizes, milliseconds, total }) => ({
      name,
      label,
      result: comparedPlanar(result, sizes, milliseconds, total),
    })),
    milliseconds: results.map(({ milliseconds }) => milliseconds),
    frames: planarFramesCsvOf(results),
  };
}

async function runRace(
  task: Task,
  jobs: FrameJob[],
  comparison: StrategyComparison,
  numStrategies: number,
  signal: AbortSignal,
) {
  // After an interrupt the current strategy still finishes its frame: a call of the engine cannot be interrupted.
  const race = new StrategyRace(timed(comparison), numStrategies, { isOver: () => signal.aborted });
  const registrar: Registrar<FrameJob> = {
    begin: async ({ name, file }) => comparison.begin(name, await readFirst(name, file)),
    place: (bytes) => race.place(bytes),
    finish: () => race.finish(),
  };
  // The comparison does not use the colours of the map, and reading them takes time.
  const withoutColors = jobs.map((job) => ({ ...job, color: null }));
  const { numPlaced, isStopped } = await runFrames(task, withoutColors, registrar, signal);
  return { race, numPlaced, isStopped };
}

function printed(rows: Row[]) {
  const { heads, lines } = shownTable(rows);
  return table(['strategy', ...heads], lines, new Set([0]));
}

function jsonOf({ rows, milliseconds }: Table) {
  const all = rows.map(({ name, result }, strategy) => ({ name, ...result, milliseconds: milliseconds[strategy] }));
  return `${JSON.stringify(all, null, 2)}\n`;
}
