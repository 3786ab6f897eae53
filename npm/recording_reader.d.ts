/**
 * What a folder, an archive or a ROS bag holds, as the page and the command line understand it: planar scans, depth images or
 * clouds in space, in which order, with which ground truth and camera.
 *
 * ```js
 * import { openAsBlob } from 'node:fs';
 * import { load, Reconstruction } from 'scanstitch';
 * import { readRecording } from 'scanstitch/recording';
 *
 * await load();
 * const names = ['0.ply', '1.ply', '2.ply', 'reference.tum'];
 * const files = await Promise.all(names.map(async (path) => ({ path, blob: await openAsBlob(path) })));
 * const recording = await readRecording(files);
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
  /** The ground truth: one file, or a file with one pose for each frame; empty without. */
  reference: string[];
  /** What the wheels of a robot with planar scans told: one file. */
  odometry: string | null;
  /** A file that describes the depth camera. */
  intrinsics: string | null;
  /** What was not used or is worth knowing. */
  notes: Note[];
}

type Role = 'depth' | 'color' | 'camera' | 'clouds' | 'scans' | 'odometry' | 'reference';

export interface OpenedRecording extends Recording {
  /** The bytes of a file that the recording names. */
  read(path: string): Promise<Uint8Array>;
}

/**
 * Understands files of a page (`File`s) or any blobs with their paths. Archives and bags among them are opened. Before `read`
 * is called, packed files, files of MATLAB, scans and clouds as text, trajectories and cameras are read whole; of all others only
 * their names and beginnings.
 */
export function readRecording(
  files: Iterable<File | { path: string; blob: Blob }>,
  options?: {
    /** Topics of a bag to use instead of those that are found; null: to do without. */
    topics?: Partial<Record<Role, string | null>>;
  },
): Promise<OpenedRecording>;
