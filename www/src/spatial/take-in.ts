/** From a recording that was opened to the frames that are loaded: they join what is open or replace it. */
import { nameOfReference } from '../../../package/files/names.js';
import type { Content, OpenedRecording } from '../../../package/recording_reader.js';
import type { Opened } from '../datasets/dataset.js';
import type { SpatialJob } from '../engine/preparer.js';
import { baseName } from '../views/format.js';

/** What is loaded. */
export interface SpatialDataset extends Opened {
  jobs: readonly SpatialJob[];
  /** Name of the reference; empty without. */
  referenceName: string;
}

/** Whether these frames can join those that are open: of one kind, in one folder, none of them twice. */
export function canJoin(present: SpatialDataset, { origin, recording }: Opened): boolean {
  if (present.origin !== 'user' || origin !== 'user') return false;
  const isAlike = present.recording.kind === recording.kind && present.recording.root === recording.root;
  return isAlike && ![...recording.files.keys()].some((path) => isFrame(present, path));
}

/** What is loaded after `opened` came to `present`: a recording replaces it, or joins it where it is to and can; other files lie beside it. */
export async function combine(present: SpatialDataset | null, opened: Opened, joins: boolean): Promise<SpatialDataset> {
  const fresh = opened.recording;
  const hasFrames = framesOf(fresh) > 0;
  if (present === null || (hasFrames && !(joins && canJoin(present, opened)))) return makeDataset(opened);
  const all = await present.recording.with(fresh);
  const told = present.recording.opened.notes;
  const together = { ...all, notes: all.notes.filter((note) => !told.includes(note)) };
  if (hasFrames) return makeDataset({ ...present, recording: together });
  // Beside the recording a camera is known by what is in it; a trajectory alone may be of any kind.
  const spokenOf = [together.intrinsics, ...together.reference, ...lossesOf(together)];
  const given = [...fresh.files.keys()];
  if (given.some((path) => spokenOf.includes(path))) return makeDataset({ ...present, recording: together });
  const trajectory = given.find((path) => /\.(npy|txt|tum|csv|log|traj|json|ya?ml|xml)$/i.test(path));
  if (trajectory === undefined) return makeDataset(opened);
  const { files, opened: parts } = together;
  const beside = { files, opened: parts, reference: [trajectory], notes: [...fresh.opened.notes] };
  return makeDataset({ ...present, recording: { ...present.recording, ...beside } });
}

function makeDataset({ title, origin, recording }: Opened): SpatialDataset {
  return {
    title: title || baseName(recording.root) || 'Your recording',
    origin,
    recording,
    jobs: jobsOf(recording),
    referenceName: nameOfReference(recording.reference),
  };
}

/** The frames as the engine is given them. */
export function jobsOf(recording: OpenedRecording): SpatialJob[] {
  const file = (path: string): Content => recording.files.get(path) as Content;
  if (recording.kind === 'clouds') {
    return recording.clouds.map((path, index) => ({
      index,
      name: path,
      time: recording.cloud_times?.[index] ?? null,
      file: file(path),
      color: null,
      isCloud: true,
    }));
  }
  return recording.depth_frames.map(({ name, depth, color, time }, index) => ({
    index,
    name,
    time,
    file: file(depth),
    color: color === null ? null : file(color),
    isCloud: false,
  }));
}

/** Files that were meant for this recording and cannot be used. */
const lossesOf = ({ notes }: OpenedRecording): string[] => notes.flatMap(({ file, is_loss }) => (is_loss ? file : []));

const framesOf = ({ depth_frames, clouds }: OpenedRecording): number => depth_frames.length + clouds.length;

function isFrame({ jobs }: SpatialDataset, path: string): boolean {
  return jobs.some(({ file, color }) => file.path === path || color?.path === path);
}
