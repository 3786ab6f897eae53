/** What a recording is made of, as the page, the command line and users of the package see it. */
import type { Edit } from '../../pkg/scanstitch.js';
import type { Note } from '../base/errors.js';
import type { Size } from './heads.js';

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

/** How a map of planar scans was made and mended. */
export interface StepsFile {
  /** Number of scans of the recording, without those that could not be read. */
  num_scans: number;
  /** Settings of the reconstruction. */
  settings: Record<string, unknown>;
  steps: Edit[];
  /** Of building plans that steps lay. */
  pictures?: Pictures;
}

/** Bytes of pictures, by the names that steps call them. */
export type Pictures = Readonly<Record<string, Uint8Array<ArrayBuffer>>>;

/** Of a workbench. */
export interface Mended extends StepsFile {
  /** What the columns of tables of ranges are. */
  table?: string;
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
  /** What a workbench keeps of its map. */
  mended?: Mended;
  /** What was not used or is worth knowing. */
  notes: Note[];
}

/** A recording as it is understood from its files, with what only messages and defaults need. */
export interface Understood extends Recording {
  /** Of the first depth image, where its head tells it. */
  image_size: Size | null;
  /** Of files without a scan, a cloud or a depth image: what they are to planar scans that are open. */
  beside?: Beside;
}

export interface Beside {
  reference: string | null;
  odometry: string | null;
  notes: Note[];
}

/** What is found of a recording. */
export type Found = Partial<Understood> & { notes: Note[] };

/** A file of a recording that is looked for: its name and size are known. */
export interface ListedFile {
  /** Folders separated by slashes. */
  path: string;
  /** In bytes. */
  size: number;
  /** The recording that it is a part of, where that is known, as it is of what lies in a bag. */
  given?: Recording;
  /** Whether it is a cloud, whatever its name says. */
  isCloud?: boolean;
}

/** The first bytes of a file, or all it has. */
export type ReadHead = (path: string, length: number) => Promise<Uint8Array>;

/** A recording of nothing. */
export function empty(): Recording {
  return {
    kind: 'nothing',
    root: '',
    depth_frames: [],
    clouds: [],
    scans: [],
    logs: [],
    tables: [],
    reference: [],
    odometry: null,
    intrinsics: null,
    notes: [],
  };
}
