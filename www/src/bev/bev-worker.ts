/** The thread of the bird's-eye view. */
import {
  init,
  BevImage,
  BirdsEyeView,
  bev_in_axes,
  bev_presets,
  bev_refine,
  bev_with_poses,
  check_bev_image,
  read_bev_points,
  read_bev_scene,
  version,
} from '../engine/package.js';
import { emit, isInputError, reportCrash, serve } from '../engine/serve.js';
import type { BevApi, BevScene, Projection, Query, Strip } from './protocol.js';

/** A strip of the warp takes a few milliseconds, so that questions asked meanwhile need not wait. */
const PIXELS_OF_A_STRIP = 200_000;
/** What the cameras see of the ground is drawn up to this depth, for each metre that the higher one stands above it. */
const DEPTH_FOR_HEIGHT = 1.8;

let image: BevImage | null = null;
let generation = 0;
let view: { scene: string; view: BirdsEyeView } | null = null;

serve<BevApi>({
  async start(module) {
    await init({ module_or_path: module });
    return { version: version(), presets: bev_presets() };
  },
  project,
  follow({ scene, from, pixel }) {
    const [point] = viewOf(scene).points(Float64Array.from(pixel), from);
    if (!point) throw new Error('The engine followed no pixel.');
    return point;
  },
  inAxes: ({ scene, axes }) => bev_in_axes(scene, axes),
  withPoses: ({ scene, kind, order }) => bev_with_poses(scene, kind, order),
  refine: ({ scene, pairs, camera, parameters }) =>
    bev_refine(scene, [...pairs], { camera, parameters: [...parameters] }),
  points_csv: ({ scene, marked, whole }) => viewOf(scene).points_csv(marked, 'top', whole),
  readScene: ({ name, bytes }) => read_bev_scene(bytes, name),
  readPoints: ({ name, bytes }) => read_bev_points(bytes, name, 'top'),
  checkImage: ({ scene, role, width, height }) => check_bev_image(scene, role, width, height),
  keepImage(rgba) {
    image?.free();
    image = rgba ? new BevImage(rgba) : null;
  },
  warp(of, scene) {
    generation = of;
    warpFrom(0, scene, of);
  },
});

function project({ scene, marked, region, lines, pairTops, whole }: Query): Projection {
  const view = viewOf(scene);
  const { width, height } = scene.top;
  const [right, bottom] = [width - 0.5, height - 0.5];
  const { top, front } = view.layout(1);
  const max_depth = DEPTH_FOR_HEIGHT * Math.max(Math.abs(top.height), Math.abs(front.height));
  return {
    points: view.points(marked, 'top'),
    reported: view.points(marked, 'top', whole),
    region: region.length > 0 ? view.polygon(region, 'top') : null,
    lines: view.segments(lines, 'top'),
    pairPoints: view.points(pairTops, 'top'),
    common: view.polygon(Float64Array.of(-0.5, -0.5, right, -0.5, right, bottom, -0.5, bottom), 'top'),
    layout: view.layout(max_depth),
    homography: [...view.homography('top')],
  };
}

/** Made once for a scene: a drag asks for the same one over and over. */
function viewOf(scene: BevScene): BirdsEyeView {
  const key = JSON.stringify(scene);
  if (view?.scene === key) return view.view;
  const fresh = new BirdsEyeView(scene);
  view?.view.free();
  view = { scene: key, view: fresh };
  return fresh;
}

function warpFrom(first_row: number, scene: BevScene, of: number): void {
  if (of !== generation || !image) return;
  const { width, height } = scene.front;
  const num_rows = Math.min(Math.max(1, Math.floor(PIXELS_OF_A_STRIP / width)), height - first_row);
  let rgba: Uint8Array;
  try {
    rgba = image.warp_rows(viewOf(scene), first_row, num_rows);
  } catch (error) {
    if (isInputError(error)) return; // reported by `project` and `checkImage`
    throw error;
  }
  const isLast = first_row + num_rows >= height;
  const clamped = new Uint8ClampedArray(rgba.buffer as ArrayBuffer, rgba.byteOffset, rgba.length);
  const strip: Strip = { generation: of, first_row, num_rows, width, rgba: clamped, isLast };
  emit(strip, [clamped.buffer]);
  // A separate task, so that messages are handled in between.
  if (!isLast) setTimeout(() => warpNext(first_row + num_rows, scene, of));
}

function warpNext(first_row: number, scene: BevScene, of: number): void {
  try {
    warpFrom(first_row, scene, of);
  } catch (error) {
    reportCrash(error);
  }
}
