/**
 * What a folder, an archive or a ROS bag holds, as the page and the command line understand it: planar scans, depth images or
 * clouds in space, in which order, with which ground truth and camera.
 *
 * ```js
 * import { openAsBlob } from 'node:fs';
 * import { load, Reconstruction } from 'scanstitch';
 * import { openRecording } from 'scanstitch/recording';
 *
 * await load();
 * const names = ['0.ply', '1.ply', '2.ply', 'reference.tum'];
 * const files = await Promise.all(names.map(async (path) => ({ path, blob: await openAsBlob(path) })));
 * const recording = await openRecording(files);
 * const reconstruction = new Reconstruction();
 * for (const path of recording.scans) reconstruction.add_scan(path, await recording.read(path));
 * while (reconstruction.step().stage !== 'done');
 * console.log(recording.kind, recording.reference, reconstruction.result().frames.length);
 * reconstruction.free();
 * ```
 */

/** What is worth knowing of a file; `reason` completes "FILE: ...". `is_loss`: it could have been used. */
export interface Note {
  file: string;
  reason: string;
  is_loss?: true;
}

export interface DepthFrame {
  /** Short, for messages and results. */
  name: string;
  /** Path of the depth image. */
  depth: string;
  /** Path of the colour image. */
  color: string | null;
  /** Seconds, where the recording has times. */
  time: number | null;
}

export interface Recording {
  kind: 'planar_scans' | 'depth_images' | 'clouds' | 'nothing';
  /** The folder that holds it; empty where that is the top. */
  root: string;
  /** In order. */
  depth_frames: DepthFrame[];
  /** Paths, in order. */
  clouds: string[];
  /** Of the clouds, where the recording has times (s). */
  cloud_times?: number[];
  /** Paths, in order. */
  scans: string[];
  /** Those of the scans that hold many each. */
  logs: string[];
  /** Those of the logs whose columns somebody may want to name. */
  tables: string[];
  /** The ground truth: one file, or a file with one pose for each frame; empty without. */
  reference: string[];
  /** What the wheels of a robot with planar scans told: one file. */
  odometry: string | null;
  /** A file that describes the depth camera. */
  intrinsics: string | null;
  /** Of the first depth image, where its beginning tells it. */
  image_size: { width: number; height: number } | null;
  /** Of files without a scan, a cloud or a depth image: what they are to planar scans that are open. */
  beside?: { reference: string | null; odometry: string | null; notes: Note[] };
  /** What was not used or is worth knowing. */
  notes: Note[];
}

type Role = 'depth' | 'color' | 'camera' | 'clouds' | 'scans' | 'odometry' | 'reference';
/** Topics of a bag to use instead of those that are found; null: to do without. */
type Topics = Partial<Record<Role, string | null>>;

/** A file: as a page has it, any blob, or something that is read when it is needed. Folders of a path are separated by slashes. */
export type Source = File | { path: string; blob: Blob } | Content;

/** A file of a recording, wherever it lies: on the disk, in an archive, in a bag, on a server, or made of another file. */
export interface Content {
  path: string;
  /** Bytes. */
  size: number;
  /** All of it; each caller has a copy of its own. */
  read(): Promise<Uint8Array>;
  /** Its first bytes, or all it has. */
  readHead(length: number): Promise<Uint8Array>;
  /** Its bytes piece by piece, where an archive or a bag need not be read as a whole. */
  open?(): Promise<{ size: number; read(start: number, end: number): Promise<Uint8Array> }>;
  /** As the browser has it. */
  blob?: Blob;
  /** Where it lies on the disk. */
  disk?: string;
  /** Whether it was named itself; false: the folder that it lies in was, in which no archive is opened. */
  isNamed?: boolean;
  /** Whether it is a cloud, whatever its name says. */
  isCloud?: boolean;
  /** The recording that it is a part of, in a bag. */
  given?: Recording;
  /** What could not be read of it, once it has been read. */
  losses?: readonly Note[];
}

/** What is being done with a bag, or its topics as soon as they are known; `done` and `total` count bytes or messages. */
export type OpenProgress =
  { stage: 'index' | 'messages'; done: number; total: number } | { stage: 'topics'; bags: readonly ListedBag[] };

/** A topic of a bag, and what its messages are. */
export interface TopicFacts {
  /** `rate`: messages a second; null where there are fewer than two. */
  topic: { name: string; type: string; count: number; rate: number | null };
  /** In a few words. */
  about: string;
  /** What it can be used as. */
  uses: Role[];
  /** Why it cannot be used; empty where it can. */
  problem: string;
}

export interface ListedBag {
  bag: { readonly path: string; readonly notes: readonly Note[] };
  topics: readonly TopicFacts[];
}

/** A ROS bag: what is in it, and which of its topics are used as what. */
export interface OpenedBag {
  listed: ListedBag;
  choice: Partial<Record<Role, string>>;
}

export interface OpenOptions {
  /** Rejects with its reason once it is aborted. */
  signal?: AbortSignal;
  topics?: Topics;
  onProgress?: (progress: OpenProgress) => void;
  /** Of files that are missing among the sources: they come before the others. */
  notes?: readonly Note[];
  /** Whether tables of numbers are said to be laser scans. */
  isTable?: boolean;
  /** Which recording to use, where there are several: the folder it lies in, or the end of its path. The longest without. */
  folder?: string;
}

/** Files as a comparison of trajectories takes them. */
export interface Trajectories {
  /** One file each, or the files of a folder with one pose each. */
  trajectories: { name: string; paths: string[] }[];
  /** Times of the poses, for trajectories without. */
  times: string | null;
  /** Known relations between poses. */
  relations: string | null;
  /** Clouds. */
  maps: string[];
  /** What is none of these. */
  skipped: string[];
  /** Why files cannot be read. */
  problems: string[];
}

export interface OpenedRecording extends Recording {
  /** All files by their paths, unpacked and converted. */
  files: ReadonlyMap<string, Content>;
  bags: readonly OpenedBag[];
  /** The bytes of a file that the recording names. */
  read(path: string): Promise<Uint8Array>;
  /** The same files with other topics of the bags. Rejects where a bag has no such topic. */
  choose(topics: Topics, options?: Pick<OpenOptions, 'signal' | 'onProgress'>): Promise<OpenedRecording>;
  /** The files of both, as one recording. */
  with(others: Pick<OpenedRecording, 'opened'>): Promise<OpenedRecording>;
  /** What the files are to a comparison. */
  trajectories(): Promise<Trajectories>;
  /** For `with`. */
  readonly opened: Opened;
}

interface Opened {
  /** What lies in no bag. */
  loose: readonly Content[];
  inBags: readonly Content[];
  bags: readonly OpenedBag[];
  notes: readonly Note[];
  how: Pick<OpenOptions, 'isTable' | 'folder'>;
  /** Files that were given, or lie in what was given: used or not. */
  numGiven: number;
}

/**
 * Understands files. Archives and bags among them are opened. Before `read` is called, packed files, files of MATLAB, scans and clouds
 * as text, trajectories and cameras are read whole; of all others only their names and beginnings.
 */
export function openRecording(sources: Iterable<Source>, options?: OpenOptions): Promise<OpenedRecording>;

/** The bags among these files, with what their topics hold. */
export function bagsAmong(sources: Iterable<Source>): Promise<{ bags: ListedBag[]; notes: Note[] }>;

/** Former name of `openRecording`. */
export const readRecording: typeof openRecording;
