/** What the map in space draws over its points. */
import type { Vec3 } from '../views/vectors.js';
import type { Camera, Pose } from './poses.js';
import type { MapScene } from './scene.js';
import type { Survey } from './survey.js';

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

/** How far a camera's image is drawn before it, m; the selected one's is larger, to be seen. */
const CAMERA_DEPTH = 0.16;
const SELECTED_DEPTH = 2.4 * CAMERA_DEPTH;

/** What marks lie on. */
interface Ground {
  R_view_map: Survey['R_view_map'];
  heights: Survey['heights'];
  straight: number;
  /** What the squares on the floor lie under. */
  onFloor(): readonly Vec3[];
}

/** Hands marks to the scene; paths only where they are not those `before`. `image`: of the selected frame. */
export function showMarks(
  scene: MapScene,
  marks: SpatialMarks,
  before: SpatialMarks | null,
  image: HTMLImageElement | null,
  { R_view_map, heights, straight, onFloor }: Ground,
): void {
  const { poses, reference, camera, selected } = marks;
  if (before === null || before.poses !== poses || before.reference !== reference) {
    scene.setPaths(poses, reference, camera, CAMERA_DEPTH);
    const shown = onFloor();
    if (shown.length > 0) scene.setGround(R_view_map, shown, heights.floor, straight);
  }
  const pose = selected === null ? null : (poses[selected] ?? null);
  scene.setSelected(pose, camera, SELECTED_DEPTH, image);
}
