/** Which of some files are a map that exists: map.yaml of ROS's map_server with its picture, CMU's `wean.dat`, a picture alone. */
import { HEAD_BYTES, imageSize, IMAGE_HEAD_BYTES, latin1 } from '../../../package/files/heads.js';
import { isImageName } from '../../../package/files/kinds.js';
import { baseOf, contains, folderOf } from '../../../package/files/names.js';
import type { NamedFile } from '../datasets/gather.js';
import type { Note } from '../datasets/note.js';
import type { Problem } from '../engine/protocol.js';
import { EngineProblem } from '../engine/remote.js';
import type { GivenFile, MapSource } from './protocol.js';

/** The files of a map, not read yet. */
export type MapFiles =
  | { kind: 'yaml'; yaml: NamedFile; picture: NamedFile }
  | { kind: 'picture'; picture: NamedFile }
  | { kind: 'probabilities'; table: NamedFile };

export interface FoundMap {
  map: MapFiles | null;
  /** Why the files of a map make none. */
  problem: Problem | null;
  /** Files that other ones may complete to a map. */
  incomplete: NamedFile[];
  /** What is none of a map. */
  others: NamedFile[];
  notes: Note[];
}

/** Most cells that the engine reads. */
const MAX_CELLS = 2 ** 26;
/** Largest size of a packed map when unpacked (bytes). */
const MAX_UNPACKED = 2 ** 30;

export const isYaml = ({ name }: NamedFile): boolean => /\.ya?ml$/i.test(name);
const TABLE = /\.dat(\.gz)?$/i;
/** What `scanstitch reconstruct` writes beside its map. */
const RESULTS = ['trajectory.tum', 'report.json'];

/** `isAsked`: whether a picture alone is a map, of which the side of a pixel is to be asked for. */
export async function findMap(files: readonly NamedFile[], isAsked: boolean): Promise<FoundMap> {
  const images = new Map<NamedFile, string>();
  const tables: NamedFile[] = [];
  for (const file of files) {
    if (isYaml(file)) {
      const image = imageOf(await file.file.slice(0, HEAD_BYTES).text());
      if (image !== null && !isOldResult(file, files)) images.set(file, image);
    } else if (TABLE.test(file.name) && (await isTableOfProbabilities(file))) tables.push(file);
  }
  const pictureOf = (yaml: NamedFile): NamedFile | null => pictureAmong(files, yaml, images.get(yaml) ?? '');
  const yamls = [...images.keys()].sort((a, b) => Number(isMain(b)) - Number(isMain(a)));
  const [yaml] = yamls;
  const pictures = files.filter(({ name }) => isImageName(name));
  const [alone] = !yaml && tables.length === 0 && isAsked && pictures.length === 1 ? pictures : [];
  const chosen = yaml ?? tables[0] ?? alone ?? null;
  const ofMaps = new Set([...yamls, ...yamls.map(pictureOf), ...tables, ...(alone ? [alone] : [])]);
  const found: FoundMap = {
    map: null,
    problem: null,
    incomplete: [],
    others: files.filter((file) => !ofMaps.has(file)),
    notes: [...yamls, ...tables].filter((file) => file !== chosen).map((file) => unused(file, chosen?.name ?? '')),
  };
  if (yaml) return withPicture(found, yaml, pictureOf(yaml), images.get(yaml) ?? '');
  if (tables[0]) return { ...found, map: { kind: 'probabilities', table: tables[0] } };
  return alone ? { ...found, map: { kind: 'picture', picture: alone }, incomplete: [alone] } : found;
}

function withPicture(found: FoundMap, yaml: NamedFile, picture: NamedFile | null, image: string): FoundMap {
  if (picture) return { ...found, map: { kind: 'yaml', yaml, picture } };
  const problem = `Its picture ${baseOf(image)} is not among the files`;
  return {
    ...found,
    problem: { file: yaml.name, place: null, problem, remedy: `Drop ${baseOf(image)} as well` },
    incomplete: [yaml],
  };
}

function unused({ name }: NamedFile, chosen: string): Note {
  return { file: name, reason: `not used: one map is used at a time, here ${chosen}` };
}

/** The picture that a YAML file of map_server names; null for any other YAML file. */
export function imageOf(text: string): string | null {
  const [, image] = /^image[ \t]*:[ \t]*["']?([^"'#\r\n]*)/m.exec(text) ?? [];
  const isOfMap = /^(resolution|origin|occupied_thresh|free_thresh|negate)[ \t]*:/m.test(text);
  return image === undefined || !isOfMap ? null : image.trim();
}

function pictureAmong(files: readonly NamedFile[], yaml: NamedFile, image: string): NamedFile | null {
  const name = baseOf(image.replaceAll('\\', '/'));
  const named = files.filter((file) => baseOf(file.name) === name);
  return named.find((file) => folderOf(file.name) === folderOf(yaml.name)) ?? named[0] ?? null;
}

const isMain = ({ name }: NamedFile): boolean => /^map\.ya?ml$/i.test(baseOf(name));

/** The map of an earlier result, dropped along with the folder of the recording: the recording is meant. */
function isOldResult({ name }: NamedFile, files: readonly NamedFile[]): boolean {
  const folder = folderOf(name);
  const names = new Set(files.map((file) => file.name));
  const [top = ''] = name.split('/');
  const lieBeside = ({ name }: NamedFile): boolean => contains(top, name) && !contains(folder, folderOf(name));
  return folder !== '' && RESULTS.every((result) => names.has(`${folder}/${result}`)) && files.some(lieBeside);
}

/** The map of CMU 16-831, packed or not. */
async function isTableOfProbabilities({ name, file }: NamedFile): Promise<boolean> {
  const head = isPacked(name) ? await unpacked(file, HEAD_BYTES) : await bytesOf(file.slice(0, HEAD_BYTES));
  return head !== null && /^(robot_specifications->|global_map\[)/m.test(latin1(head.subarray(0, HEAD_BYTES)));
}

const isPacked = (name: string): boolean => /\.gz$/i.test(name);

const bytesOf = async (blob: Blob): Promise<Uint8Array<ArrayBuffer>> => new Uint8Array(await blob.arrayBuffer());

/** What gzip has packed, or so many bytes from its beginning; null where it is damaged. */
async function unpacked(file: Blob, most: number): Promise<Uint8Array<ArrayBuffer> | null> {
  const parts: Uint8Array<ArrayBuffer>[] = [];
  let size = 0;
  try {
    const reader = file.stream().pipeThrough(new DecompressionStream('gzip')).getReader();
    while (size < most) {
      const { value, done } = await reader.read();
      if (done) break;
      parts.push(value);
      size += value.length;
    }
    await reader.cancel();
  } catch {
    return null;
  }
  return bytesOf(new Blob(parts));
}

/** Reads the files of a map. `resolution`: side of a pixel of a picture alone (m). */
export async function readMapFiles(files: MapFiles, resolution: number): Promise<MapSource> {
  switch (files.kind) {
    case 'yaml':
      return { kind: 'yaml', yaml: await read(files.yaml), picture: await readPicture(files.picture) };
    case 'picture':
      return { kind: 'picture', picture: await readPicture(files.picture), resolution };
    case 'probabilities':
      return { kind: 'probabilities', table: await read(files.table) };
  }
}

async function read({ name, file }: NamedFile): Promise<GivenFile> {
  const bytes = isPacked(name) ? await unpacked(file, MAX_UNPACKED) : await bytesOf(file);
  return bytes ? { name, bytes } : refuse(name, 'The packed file is damaged', 'Pack it again');
}

/** A picture that is too large is not brought into memory. */
async function readPicture({ name, file }: NamedFile): Promise<GivenFile> {
  const { width, height } = imageSize(await bytesOf(file.slice(0, IMAGE_HEAD_BYTES))) ?? { width: 0, height: 0 };
  if (width * height <= MAX_CELLS) return { name, bytes: await bytesOf(file) };
  const announced = `The header announces ${width} x ${height} pixels`;
  return refuse(name, `${announced}, more than the limit of ${MAX_CELLS}`, 'Export a smaller image');
}

function refuse(file: string, problem: string, remedy: string): never {
  throw new EngineProblem({ file, place: null, problem, remedy, message: `${file}: ${problem}. ${remedy}.` });
}
