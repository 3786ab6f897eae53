/** Clouds that one view hands to another: where their bytes are, read when they are needed. */

import type { Turns } from '../views/viewport.js';

/** A cloud that is passed to the engine. */
export type CloudData =
  /** A file of points, PLY or PCD. */
  | { kind: 'file'; name: string; bytes: Uint8Array<ArrayBuffer> }
  /** x y z x y z ..., m, with unit normals where they are known; `isOfCamera`: x right, y down, z forward. */
  | {
      kind: 'positions';
      name: string;
      xyz: Float32Array<ArrayBuffer>;
      normals?: Float32Array<ArrayBuffer> | null;
      isOfCamera?: boolean;
    }
  /** A depth image and the camera that took it (pixels; raw depth values per metre). */
  | {
      kind: 'depth';
      name: string;
      bytes: Uint8Array<ArrayBuffer>;
      camera: { fx: number; fy: number; cx: number; cy: number };
      depth_scale: number;
    };

export interface GivenCloud {
  /** Path or name; no two of a list are alike. */
  name: string;
  read(): Promise<CloudData>;
}

/** Clouds to register, and which two to begin with. */
export interface GivenClouds {
  title: string;
  /** What a link can name: a sample of the page; empty for the user's own files. */
  sample: string;
  /** The recording that they are of: the same object for the same one. */
  of: unknown;
  clouds: readonly GivenCloud[];
  source: string;
  target: string;
  /** How a run registered them, by the engine's names; null where none did. */
  options: Readonly<Record<string, string | number>> | null;
  /** The first guess, 4 x 4, row by row; null is the identity. */
  init_T_target_source: readonly number[] | null;
  /** By how many quarter turns the target is drawn turned, as on the map that it comes from; absent: as it is best laid. */
  turns?: Turns;
}
