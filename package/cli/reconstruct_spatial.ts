/** Depth images or clouds to a trajectory, a map and a report. */
import { basename, relative } from 'node:path';
import type { SpatialReconstruction } from '../../pkg/scanstitch.js';
import { printable } from '../base/printable.js';
import { nameOfReference } from '../files/names.js';
import type { Recording } from '../files/recording.js';
import { cameraFor, engineCamera } from '../recording/camera_file.js';
import { joinPoses, trajectoryBytes } from '../recording/pose_file.js';
import { posesOfFrames } from '../recording/reference.js';
import type { Registrar } from '../run/spatial_run.js';
import { CommandError, untilInterrupt } from './command.js';
import { isFolder, writeResults } from './disk.js';
import { writeFloorGrid } from './floor_grid.js';
import { type Input, readFirst, readInput, readRequired, readSource } from './inputs.js';
import type { FrameJob } from './preparers.js';
import { accepted, mapFile, type Options, reportFile, type Task } from './results.js';
import { runFrames } from './run_frames.js';
import { readSettings, spatialCatalogue } from './settings.js';
import { assumptionNotes, frameTable, headline, type Timing } from './spatial_summary.js';
import { note, print, tellDoubtful } from './terminal.js';
import { frameFiles } from './trajectories.js';

type NamedBytes = { name: string; bytes: Uint8Array };

/** The map is counted in voxels of these sizes (m). */
const MAP_SIZES = Float64Array.of(0.01, 0.02, 0.05, 0.1);

export async function reconstructSpatial(task: Task) {
  const { engine, options, complain } = task;
  const settings = readSettings(spatialCatalogue(engine), options.preset, options.set);
  const reconstruction = new engine.SpatialReconstruction(settings);
  await setIntrinsics(reconstruction, task);

  const jobs = jobsOf(task);
  const timing = await untilInterrupt((signal) => runAll(reconstruction, jobs, task, signal));
  if (timing.frames.size === 0) throw nothingComputed(timing);
  const reference = await readReference(task);
  if (reference) {
    accepted(() => reconstruction.set_reference(reference.name, reference.bytes, jobs.length), complain);
  }

  const result = reconstruction.result(true);
  for (const { name, status, reason } of result.frames) {
    if (status === 'lost') complain(`${name}: This frame could not be placed: ${reason}.`);
  }
  tellDoubtful(result.frames, complain);
  if (result.frames.every(({ status }) => status === 'lost')) {
    throw new CommandError('No frame could be placed, so nothing was written.');
  }
  // What is small first: a map may be too large for the memory.
  await writeResults(options.out, {
    'trajectory.tum': reconstruction.trajectory_tum(),
    'report.json': reconstruction.report_json(),
  });
  const isCompared = result.comparison !== null;
  for (const text of result.notes) {
    if (reference && !isCompared && text.startsWith(reference.name)) complain(text);
    else note(text);
  }
  for (const text of assumptionNotes(result)) note(text);
  const { sizes, milliseconds, positions } = await writeMap(reconstruction, options, complain);
  await writeResults(options.out, reportFile(reconstruction.result(), positions, task));
  const summary = headline(result, { ...timing, map: milliseconds }, sizes, jobs.length);
  print(`${frameTable(result, timing)}\n${summary}`);
  print(`Written to ${printable(options.out)}\n`);
  if (options.grid) await writeFloorGrid(reconstruction, positions, options.grid, complain);
  if (options.mesh) {
    const { writeSurface } = await import('./surface.js');
    await writeSurface(engine, reconstruction, jobs, options.mesh, complain);
  }
  if (options.splats) {
    const { writeSplats } = await import('./surface.js');
    await writeSplats(reconstruction, jobs, options.splats, complain);
  }
}

/**
 * The map, with the positions of its points, what it takes in voxels of several sizes, and how long it took to stitch (ms).
 */
async function writeMap(reconstruction: SpatialReconstruction, options: Options, complain: (problem: string) => void) {
  const start = performance.now();
  let milliseconds = 0;
  let positions: Float32Array = new Float32Array(0);
  try {
    const { name, bytes } = mapFile(reconstruction, options);
    milliseconds = performance.now() - start;
    await writeResults(options.out, { [name]: bytes });
    positions = reconstruction.map_positions();
    return { milliseconds, positions, sizes: reconstruction.map_sizes(MAP_SIZES) };
  } catch (error) {
    // An engine without memory left ends in a trap.
    if (!(error instanceof WebAssembly.RuntimeError || error instanceof RangeError)) throw error;
    if (milliseconds > 0) note('The map is not counted in voxels of 1 cm: it would not fit into the memory.');
    else complain('The map does not fit into the memory. Larger voxels take less: --set map_voxel_size=0.05');
    return { milliseconds, positions, sizes: [] };
  }
}

export function jobsOf({ recording: { files, kind, root, depth_frames, clouds, cloud_times } }: Task): FrameJob[] {
  const source = (path: string) => {
    const found = files.get(path);
    if (!found) throw new Error(`${path} is not listed`);
    return found;
  };
  if (kind === 'clouds') {
    return clouds.map((path, index) => {
      const time = cloud_times?.[index] ?? null;
      return { index, name: relative(root, path), time, kind, file: source(path), color: null };
    });
  }
  return depth_frames.map(({ name, depth, color, time }, index) => {
    return {
      index,
      name,
      time,
      kind: 'depth_images',
      file: source(depth),
      color: color === null ? null : source(color),
    };
  });
}

export async function setIntrinsics(
  reconstruction: Pick<SpatialReconstruction, 'set_intrinsics'>,
  { recording, options, complain }: Task,
) {
  const give = (name: string, bytes: Uint8Array) => {
    const { camera, notes } = cameraFor(name, bytes, recording.image_size);
    reconstruction.set_intrinsics(name, engineCamera(camera));
    return notes;
  };
  if (options.intrinsics !== undefined) {
    const name = basename(options.intrinsics);
    const fail = (problem: string) => {
      throw new CommandError(problem);
    };
    const bytes = readRequired({ name, path: options.intrinsics });
    const tell = (text: string) => note(`${printable(name)}: ${text}.`);
    accepted(() => give(name, bytes).forEach(tell), fail);
    return;
  }
  const found = recording.intrinsics === null ? undefined : recording.files.get(recording.intrinsics);
  if (!found) return;
  const bytes = await readSource(found, found.path, complain);
  // What is worth knowing of it has been said when the recording was looked into.
  if (bytes) accepted(() => give(found.path, bytes), complain);
}

/** The files of poses in the order of the frames, where their names tell which belongs to which. */
function ofFrames(files: Input[], { clouds, depth_frames }: Recording) {
  const frames = [...clouds, ...depth_frames.map(({ depth }) => depth)];
  const names = posesOfFrames(
    files.map(({ name }) => name),
    frames,
  );
  if (names === null) return files;
  const unused = files.filter(({ name }) => !names.includes(name)).map(({ name }) => name);
  if (unused.length > 0) note(`${unused.join(', ')}: not used: there is no frame of its number.`);
  return names.flatMap((name) => files.find((file) => file.name === name) ?? []);
}

/** The trajectory to compare with: the one that was named, or the one that was found. */
export async function readReference({ recording, options, complain }: Task): Promise<NamedBytes | null> {
  if (options.reference !== undefined) {
    const { reference: path } = options;
    const isMany = isFolder(path);
    const files = isMany ? ofFrames(frameFiles(path, complain), recording) : [{ name: basename(path), path }];
    const contents = files.map((file) => readInput(file, complain));
    const whole = contents.filter((bytes) => bytes !== null);
    if (whole.length === 0 || whole.length < contents.length) return null;
    const [first] = whole as [Uint8Array];
    return { name: basename(path), bytes: isMany ? joinPoses(whole) : trajectoryBytes(path, first) };
  }
  const sources = recording.reference.flatMap((path) => recording.files.get(path) ?? []);
  const [first] = sources;
  if (!first) return null;
  const contents = [];
  for (const source of sources) {
    const bytes = await readSource(source, source.path, complain);
    if (!bytes) return null;
    contents.push(bytes);
  }
  const [only] = contents as [Uint8Array];
  const name = basename(nameOfReference(recording.reference));
  return { name, bytes: sources.length > 1 ? joinPoses(contents) : trajectoryBytes(first.path, only) };
}

async function runAll(
  reconstruction: SpatialReconstruction,
  jobs: FrameJob[],
  task: Task,
  signal: AbortSignal,
): Promise<Timing> {
  const frames: Timing['frames'] = new Map();
  const { total, workers, isStopped } = await runFrames(task, jobs, registrarOf(reconstruction), signal, {
    onRegistered: ({ index, milliseconds }) => frames.set(index, milliseconds),
    whenStopped: '; these are written',
  });
  return { total, frames, workers, isStopped };
}

/** The reconstruction as what places the frames of a run. */
export function registrarOf(reconstruction: SpatialReconstruction): Registrar<FrameJob> {
  return {
    begin: async ({ name, file }) => reconstruction.begin(name, await readFirst(name, file)),
    place: (bytes) => {
      reconstruction.add_prepared(bytes);
      return { ...reconstruction.step(), decodeConfig: reconstruction.decode_config() };
    },
    finish: () => {
      reconstruction.finish();
      return reconstruction.step();
    },
  };
}

/** Why nothing came of a run. */
export function nothingComputed({ isStopped }: { isStopped: boolean }) {
  const reason = isStopped ? 'Stopped before the first frame was placed' : 'No frame could be used';
  return new CommandError(`${reason}, so nothing was computed.`);
}
