/** Files of NumPy, arrays alone (`.npy`) and archives of them (`.npz`), as files that the engine reads. */
import { append } from '../base/append.js';
import { fileError } from '../base/errors.js';
import type { Content } from '../files/content.js';
import { readNpyShape } from '../files/heads.js';
import { baseOf, folderOf, groupBy } from '../files/names.js';
import { contentsOf, tableOf } from './array_table.js';
import type { Variables } from './mat.js';
import { type Header, npyHeader, readNpy } from './npy.js';
import { partsOf } from './npy_files.js';

/** Arrays of the same shape in the folder of a file. */
export type CountAlike = (file: Content) => number;

const HEAD_BYTES = 1024;
/** Readings of a scan, at least: the engine's own readers take arrays of fewer columns, which are poses. */
const MIN_BEAMS = 24;

/** How many arrays have the shape of each: of many, each is an image or a cloud. */
export async function countAlike(files: readonly Content[]): Promise<CountAlike> {
  const arrays = await Promise.all(
    files
      .filter(({ path }) => /\.npy$/i.test(path))
      .map(async (file) => {
        const shape = readNpyShape(await file.readHead(HEAD_BYTES).catch(() => new Uint8Array())) ?? [];
        // Clouds differ in their number of points.
        return { file, key: `${folderOf(file.path)} ${(shape[1] ?? 0) < MIN_BEAMS ? shape.slice(1) : shape}` };
      }),
  );
  const groups = groupBy(arrays, ({ key }) => key);
  const counts = new Map([...groups.values()].flatMap((group) => group.map(({ file }) => [file, group.length])));
  return (file) => counts.get(file) ?? 1;
}

/** @returns the file itself, where the engine reads it */
export async function npyContents(file: Content, alike: CountAlike): Promise<Content | Content[]> {
  const head = await file.readHead(HEAD_BYTES);
  const header = npyHeader(head);
  if (!header) {
    readNpy(file.path, head); // says why
    return file;
  }
  const isWhole = header.dims.length === 2 && header.dims[1] === 2;
  const parts = partsOf(file.path, header, file.size, alike(file), isWhole ? await file.read() : head);
  if (parts.length > 0) return partsOfFile(file, parts);
  const [rows = 0, beams = 0, ...others] = header.dims;
  if (rows === 0 || beams < MIN_BEAMS || others.length > 0) return file;
  const table = tableOf(new Map([['ranges', readNpy(file.path, await file.read())]])) ?? new Uint8Array();
  return made(file.path, table.length, async () => table);
}

function partsOfFile(file: Content, parts: ReturnType<typeof partsOf>) {
  // A stack of images is read once, as long as nothing else needs the memory.
  let known = new WeakRef(new Uint8Array() as Uint8Array);
  const whole = async () => {
    const kept = known.deref();
    if (kept && kept.length > 0) return kept;
    const bytes = await file.read();
    if (parts.length > 1) known = new WeakRef(bytes);
    return bytes;
  };
  const stem = file.path.replace(/\.npy$/i, '');
  return parts.map(({ suffix, make, isCloud }) => ({
    ...made(`${stem}${suffix}`, Math.ceil(file.size / parts.length), async () => make(await whole(), file.path)),
    ...(isCloud ? { isCloud } : {}),
  }));
}

function made(path: string, size: number, read: () => Promise<Uint8Array>): Content {
  return { path, size, read, readHead: async (length) => (await read()).slice(0, length) };
}

/** Names of a camera's matrix, and of poses, beside images. */
const CAMERAS = /^(k|k_?mat|intrinsics?|camera(_?matrix)?|cam(era)?_?k|mtx)$/i;
const POSES = /pose|traj|truth|^gt|extrin|c2w/i;

/** The camera and the poses beside images under the names that these have in files; none where the array is neither. */
function besideImages(stem: string, name: string, { dims: [rows, ...columns] }: Header, member: Content): Content[] {
  const at = (file: string) => [folderOf(stem), file].filter(Boolean).join('/');
  if (CAMERAS.test(name) && rows === 3 && columns.join() === '3') {
    const text = async () => {
      const { values } = readNpy(name, await member.read());
      return new TextEncoder().encode(
        [0, 1, 2].map((row) => `${[0, 3, 6].map((at) => values[row + at]).join(' ')}\n`).join(''),
      );
    };
    return [made(at('camera-intrinsics.txt'), member.size, text)];
  }
  const arePoses = POSES.test(name) && ['4,4', '3,4', '7'].includes(columns.join());
  return arePoses ? [made(at('GT_pose.npy'), member.size, member.read)] : [];
}

/** What lies in an archive of arrays: scans with their angles and poses as one table; else clouds, where all of several are some; else each array by itself. */
export async function npzContents(file: Content): Promise<Content[]> {
  const [{ openArchive }, { bytesInMemory }] = await Promise.all([
    import('../archive/archive.js'),
    import('../archive/open.js'),
  ]);
  const archive = await openArchive(file.path, bytesInMemory(await file.read()));
  const variables: Variables = new Map();
  const contents: Content[] = [];
  const beside: Content[] = [];
  const clouds: Content[] = [];
  const stem = file.path.replace(/\.npz$/i, '');
  for (const { path, size } of archive.files) {
    const header = npyHeader(await archive.readHead(path, HEAD_BYTES));
    const name = baseOf(path).replace(/\.npy$/i, '');
    const member = made(`${stem}_${name}.npy`, size, () => archive.read(path));
    const parts =
      header && partsOf(member.path, header, size, 1, header.dims[1] === 2 ? await member.read() : new Uint8Array());
    if (parts?.some(({ suffix }) => /\.p[gfp]m$/.test(suffix))) append(contents, partsOfFile(member, parts));
    else if (header) {
      append(beside, besideImages(stem, name, header, member));
      variables.set(name, readNpy(path, await member.read()));
      // Of several, each may be a cloud.
      const asCloud = partsOf(member.path, header, size, 2, new Uint8Array()).filter(({ isCloud }) => isCloud);
      append(clouds, partsOfFile(member, asCloud));
    } else variables.set(name, { kind: 'other', dims: [], what: 'no plain numbers' });
  }
  if (contents.length === 0 && clouds.length > 1 && clouds.length === variables.size) return clouds;
  const table = contents.length === 0 ? tableOf(variables) : null;
  if (table) return [made(`${stem}.txt`, table.length, async () => table)];
  if (contents.length > 0) return [...contents, ...beside];
  const remedy = "Save arrays with a scan a row: numpy.savez('scans.npz', ranges=ranges, angles=angles)";
  throw fileError(
    file.path,
    `There are neither scans nor images in this archive; it holds ${contentsOf(variables)}`,
    remedy,
  );
}
