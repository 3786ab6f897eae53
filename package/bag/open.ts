/**
 * Bags of ROS: which files of a drop make up one, which topics it has, and its messages one by one. Nothing is kept in
 * memory but where each message lies.
 */
import { bytesInMemory } from '../archive/open.js';
import { unpackedName, unpackWhole } from '../archive/packed.js';
import type { ByteSource } from '../archive/window.js';
import { append } from '../base/append.js';
import { fileError, lost, type Note } from '../base/errors.js';
import { isPointer } from '../files/heads.js';
import { folderOf, groupBy } from '../files/names.js';
import { encapsulateRos1 } from './cdr.js';
import type { Container, OnWalk } from './container.js';
import { isMcap } from './mcap_records.js';
import type { MessageIndex } from './message_index.js';
import { isBagMetadata, isBagName, journalOf } from './names.js';
import { isRos1 } from './ros1_records.js';
import { isSqlite } from './sqlite.js';

export type BagFile = { path: string; source: () => Promise<ByteSource> };
export interface Topic {
  name: string;
  /** As ROS 2 spells it: package/msg/Name. */
  type: string;
  /** How its messages are serialised. */
  format: string;
  /** Messages. */
  count: number;
  /** When they were recorded, ns; null without messages. */
  span: { first: bigint; last: bigint } | null;
  /** Messages a second; null where there are fewer than two. */
  rate: number | null;
}
/** Of a topic, in one file. */
type Part = { container: Container; messages: MessageIndex };

export class Bag {
  topics: Topic[] = [];
  notes: Note[] = [];
  #path;
  #parts: Map<Topic, Part[]> = new Map();

  /**
   * @param path the bag's file, or the folder of its files
   * @param containers in order
   * @param formats how topics are serialised where the bag's metadata says so
   */
  constructor(path: string, containers: Container[], formats: ReadonlyMap<string, string> = new Map()) {
    this.#path = path;
    const stored = containers.flatMap((container) => {
      return container.topics.map((topic) => {
        return { container, topic: { ...topic, format: formats.get(topic.name) ?? topic.format } };
      });
    });
    const groups = groupBy(stored, ({ topic: { name, type, format } }) => JSON.stringify([name, typeOf(type), format]));
    for (const group of groups.values()) {
      const [{ topic }] = group as [(typeof stored)[0]];
      const parts = group.map(({ container, topic: { messages } }) => ({ container, messages }));
      const described = describe({ ...topic, type: typeOf(topic.type) }, parts);
      this.topics.push(described);
      this.#parts.set(described, parts);
    }
    this.topics.sort((a, b) => (a.name < b.name ? -1 : a.name > b.name ? 1 : 0));
    append(
      this.notes,
      containers.flatMap(({ notes }) => notes),
    );
  }

  get path() {
    return this.#path;
  }

  topic(name: string) {
    return this.topics.find((topic) => topic.name === name);
  }

  /** When a message was recorded, ns. */
  time(topic: Topic, index: number) {
    const { part, inside } = this.#find(topic, index);
    return part.messages.time(inside);
  }

  async read(topic: Topic, index: number): Promise<Uint8Array> {
    const { part, inside } = this.#find(topic, index);
    return withHeader(topic, await part.container.read(part.messages.place(inside)));
  }

  /** At least so many bytes of a message, where it has them. */
  async readHead(topic: Topic, index: number, length: number) {
    const { part, inside } = this.#find(topic, index);
    return withHeader(topic, await part.container.readHead(part.messages.place(inside), length));
  }

  #find(topic: Topic, index: number) {
    let inside = index;
    for (const part of this.#parts.get(topic) ?? []) {
      if (inside < part.messages.length) return { part, inside };
      inside -= part.messages.length;
    }
    throw new RangeError(`${topic.name} has no message ${index}`);
  }
}

function withHeader({ format }: Topic, bytes: Uint8Array) {
  return format === 'ros1' ? encapsulateRos1(bytes) : bytes;
}

/**
 * Opens the bags among these files. What cannot be opened is told, and the rest is opened.
 * @param files bags and their metadata.yaml
 */
export async function openBags(
  files: readonly BagFile[],
  onWalk: OnWalk = () => {},
): Promise<{ bags: Bag[]; notes: Note[] }> {
  const bags: Bag[] = [];
  const notes: Note[] = [];
  for (const { path, parts, formats } of await groupFiles(files, notes)) {
    const containers: Container[] = [];
    for (const file of parts) {
      try {
        containers.push(await openContainer(file.path, await sourceOf(file, files), onWalk));
      } catch (error) {
        const { problem, remedy = '', message } = error as Error & { problem?: string; remedy?: string };
        const reason = problem === undefined ? `not used: ${message}` : `not used: ${problem}. ${remedy}`;
        notes.push(lost(file.path, reason.replace(/\.?\s*$/, '')));
      }
    }
    if (containers.length > 0) bags.push(new Bag(path, containers, formats));
  }
  for (const { path } of files) {
    const journal = journalOf(path);
    if (journal?.isLog && !files.some((file) => file.path === journal.bag)) {
      notes.push(lost(path, `not used: it holds the last messages of ${journal.bag}, which is not here`));
    }
  }
  return { bags, notes };
}

/** The bytes of a bag, with what its recorder had not yet written into it. */
async function sourceOf({ path, source }: BagFile, files: readonly BagFile[]) {
  const log = files.find((other) => {
    const journal = journalOf(other.path);
    return journal?.isLog && journal.bag === path;
  });
  if (!log) return source();
  const { withLog } = await import('./sqlite_wal.js');
  return withLog(log.path, await source(), await log.source());
}

async function openContainer(name: string, source: ByteSource, onWalk: OnWalk): Promise<Container> {
  const head = await source.read(0, Math.min(source.size, 64));
  if (head.length === 0) throw fileError(name, 'The file is empty', 'Copy the bag again');
  if (isPointer(head)) throw fileError(name, 'This is a Git LFS pointer, not the bag itself', 'Fetch it: git lfs pull');
  if (isMcap(head)) return (await import('./mcap.js')).openMcap(name, source, onWalk);
  if (isSqlite(head)) return (await import('./db3.js')).openDb3(name, source);
  if (isRos1(head)) return (await import('./ros1.js')).openRos1(name, source, onWalk);
  if (unpackedName(name) !== null) {
    const { bytes, fault } = await unpackWhole(name, source);
    const container = await openContainer(name.slice(0, name.lastIndexOf('.')), bytesInMemory(bytes), onWalk);
    if (fault !== null) container.notes.push(lost(name, `${fault}; what was packed before that is used`));
    return container;
  }
  if (String.fromCharCode(...head.subarray(0, 10)) === '#ROSRECORD') {
    throw fileError(name, 'This is a bag of a ROS before 1.0', 'Migrate it: rosbag fix FILE new.bag');
  }
  throw fileError(
    name,
    'This is not a bag: neither a bag of ROS 1 nor an SQLite or MCAP file, as ROS 2 writes them',
    'Copy the bag again',
  );
}

/** Files that a metadata.yaml names are one bag, and so are files whose names differ by their last number alone. */
async function groupFiles(files: readonly BagFile[], notes: Note[]) {
  const groups: { path: string; parts: BagFile[]; formats: Map<string, string> }[] = [];
  const rest = new Map(files.filter(({ path }) => isBagName(path)).map((file) => [file.path, file]));
  for (const { path, source } of files.filter(({ path }) => isBagMetadata(path))) {
    const folder = folderOf(path);
    const opened = await source();
    const text = new TextDecoder().decode(await opened.read(0, Math.min(opened.size, 2 ** 20)));
    const named = filesIn(text).map((name) => (folder === '' ? name : `${folder}/${name}`));
    if (named.length === 0) continue;
    const present = named.flatMap((name) => rest.get(name) ?? []);
    for (const missing of named.filter((name) => !rest.has(name))) {
      notes.push(lost(missing, `is not here, though ${path} names it; what it holds is missing`));
    }
    if (present.length === 0) continue;
    const [first] = present;
    const bag = present.length === 1 ? (first?.path ?? '') : folder || 'bag';
    groups.push({ path: bag, parts: present, formats: formatsIn(text) });
    for (const file of present) rest.delete(file.path);
  }
  const byStem = groupBy([...rest.values()], ({ path }) => path.replace(/_\d+(\.\w+)$/, '$1'));
  for (const [stem, parts] of byStem) {
    const number = (path: string) => Number(path.match(/_(\d+)\.\w+$/)?.[1] ?? -1);
    parts.sort((a, b) => number(a.path) - number(b.path));
    groups.push({ path: parts.length === 1 ? (parts[0]?.path ?? stem) : stem, parts, formats: new Map() });
  }
  return groups;
}

/** Names of the files under `relative_file_paths`. */
function filesIn(yaml: string) {
  const [, list = ''] = yaml.match(/^\s*relative_file_paths:\s*\n((?:\s*-\s.*\n?)+)/m) ?? [];
  return list
    .split('\n')
    .map((line) =>
      line
        .replace(/^\s*-\s+/, '')
        .trim()
        .replace(/^(['"])(.*)\1$/, '$2'),
    )
    .filter((name) => name !== '');
}

/** How each topic is serialised. */
function formatsIn(yaml: string) {
  const valueOf = (block: string, key: string) => {
    return block.match(new RegExp(`^\\s*${key}:\\s*(\\S+)\\s*$`, 'm'))?.[1] ?? '';
  };
  const blocks = yaml.split(/topic_metadata:/).slice(1);
  const pairs = blocks.map((block) => [valueOf(block, 'name'), valueOf(block, 'serialization_format')] as const);
  return new Map(pairs.filter(([name, format]) => name !== '' && format !== ''));
}

/** `sensor_msgs/Image`, as ROS 1 and some recorders write it, is `sensor_msgs/msg/Image`. */
export function typeOf(type: string) {
  if (type === 'tf/tfMessage') return 'tf2_msgs/msg/TFMessage';
  return type.replace(/^(\w+)\/(\w+)$/, '$1/msg/$2').replace(/^(\w+)::msg::(?:dds_::)?(\w+?)_?$/, '$1/msg/$2');
}

function describe({ name, type, format }: { name: string; type: string; format: string }, parts: Part[]): Topic {
  const count = parts.reduce((sum, { messages }) => sum + messages.length, 0);
  const spans = parts.flatMap(({ messages }) => messages.span() ?? []);
  const [any] = spans;
  const span = any
    ? spans.reduce((all, { first, last }) => ({
        first: first < all.first ? first : all.first,
        last: last > all.last ? last : all.last,
      }))
    : null;
  const seconds = span ? Number(span.last - span.first) / 1e9 : 0;
  return { name, type, format, count, span, rate: seconds > 0 ? (count - 1) / seconds : null };
}
