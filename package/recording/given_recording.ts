/** Recordings that are known as such, as those of bags, and what lies beside them. Loaded where there are some. */
import { append } from '../base/append.js';
import type { Note } from '../base/errors.js';
import { isCloudName, isImageName } from '../files/kinds.js';
import { empty, type ListedFile, type Recording } from '../files/recording.js';
import type { Frames } from './cameras.js';
import { unused } from './other_formats.js';

/** Finds a reference and a camera of these frames among files. */
type FindBeside = (
  files: ListedFile[],
  frames: Frames,
) => Promise<Pick<Recording, 'reference' | 'intrinsics' | 'notes'>>;

/** The longest of the recordings that are known, with a reference or a camera that lies beside it. */
export async function givenRecording(
  given: ReadonlySet<Recording>,
  files: ListedFile[],
  referenceAndCamera: FindBeside,
): Promise<Recording> {
  const [chosen = empty(), ...others] = [...given].sort((a, b) => numFramesOf(b) - numFramesOf(a));
  const { kind, root } = chosen;
  const loose = files.filter((file) => !file.given);
  const isOther = ({ path, isCloud }: ListedFile) => !isImageName(path) && isCloud !== true && !isCloudName(path);
  const beside = await referenceAndCamera(loose.filter(isOther), {
    root,
    keys: [...chosen.depth_frames.map(({ depth }) => depth), ...chosen.clouds],
    times: chosen.depth_frames.flatMap(({ time }) => time ?? []),
    size: null,
    isElsewhere: () => false,
  });
  const reference = beside.reference.length === 0 ? chosen.reference : beside.reference;
  const intrinsics = kind === 'depth_images' ? (beside.intrinsics ?? chosen.intrinsics) : null;
  const images = loose.filter((file) => !isOther(file));
  const notes = [
    ...chosen.notes,
    ...notesOfGiven(chosen, others, { reference, intrinsics }),
    ...beside.notes,
    ...unused(images, 'it lies beside a bag, which is used'),
  ];
  return { ...chosen, reference, intrinsics, notes };
}

/**
 * What is not used of recordings that are known, and what the chosen one lacks.
 * @param used in its place or of its own
 */
function notesOfGiven(
  { kind, root, reference: [own] }: Recording,
  others: Recording[],
  { reference: [used], intrinsics }: Pick<Recording, 'reference' | 'intrinsics'>,
): Note[] {
  const notes: Note[] = [];
  if (own !== undefined && used !== own) {
    notes.push({ file: own, reason: `not used: one reference trajectory is used at a time, here ${used}` });
  }
  for (const recording of others.filter((recording) => numFramesOf(recording) > 0)) {
    const reason = `not used: another recording; one is used at a time, the longest: ${root}`;
    notes.push({ file: recording.root, reason });
  }
  if (kind === 'depth_images' && intrinsics === null) {
    const remedy = 'give fx fy cx cy in a file beside the bag, or set field_of_view';
    const reason = `no CameraInfo gives the focal length of its depth images; a typical one is assumed, and the map may be distorted; ${remedy}`;
    notes.push({ file: root, reason });
  }
  if (kind === 'nothing') {
    for (const recording of others) append(notes, recording.notes);
    notes.push({ file: root, reason: 'no topic of this bag can be used as depth images, clouds or laser scans' });
  }
  return notes;
}

function numFramesOf({ depth_frames, clouds, scans }: Recording) {
  return depth_frames.length + clouds.length + scans.length;
}
