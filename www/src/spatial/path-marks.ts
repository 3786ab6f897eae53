/** What the map in space draws over its points. */
import type { Camera, Pose } from './poses.js';

/** Layers over the points. */
export interface SpatialMarks {
  poses: readonly Pose[];
  reference: readonly (Pose | null)[];
  camera: Camera | null;
  /** Frames shown, from the first on. */
  until: number;
  selected: number | null;
}

/** The path of a result that another one has replaced. */
export interface BeforePath {
  poses: readonly Pose[];
}

export const NO_MARKS: SpatialMarks = { poses: [], reference: [], camera: null, until: 0, selected: null };
