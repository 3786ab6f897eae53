/** The thread of the bird's-eye view. The only module here that imports the engine. */
import init, {
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
} from '../../../pkg/scanstitch.js';
import type { Answer, BevScene, Call, Calls, FromWorker, Question, ToWorker } from './protocol.js';

/** A strip of the warp takes a few milliseconds, so that questions asked meanwhile need not wait. */
const PIXELS_OF_A_STRIP = 200_000;
/** What the cameras see of the ground is drawn up to this depth, for each metre that the higher one stands above it. */
const DEPTH_FOR_HEIGHT = 1.8;

let image: BevImage | null = null;
let generation = 0;
let view: { scene: string; view: BirdsEyeView } | null = null;

const ready = new Promise<WebAssembly.Module>((resolve) => {
  self.onmessage = ({ data }: MessageEvent<ToWorker>): void => {
    if (data.type === 'start') resolve(data.module);
    else started.then(() => handle(data)).catch(crash);
  };
});
const started = ready.then((module) => init({ module_or_path: module }));
started.catch(crash);

const HANDLERS: { [K in Call]: (given: Calls[K][0]) => Calls[K][1] } = {
  about: () => ({ version: version(), presets: bev_presets() }),
  project,
  follow: ({ scene, from, pixel }) => {
    const [point] = viewOf(scene).points(Float64Array.from(pixel), from);
    if (!point) throw new Error('The engine followed no pixel.');
    return point;
  },
  in_axes: ({ scene, axes }) => bev_in_axes(scene, axes),
  with_poses: ({ scene, kind, order }) => bev_with_poses(scene, kind, order),
  refine: ({ scene, pairs, camera, parameters }) =>
    bev_refine(scene, [...pairs], { camera, parameters: [...parameters] }),
  points_csv: ({ scene, marked, whole }) => viewOf(scene).points_csv(marked, 'top', whole),
  read_scene: ({ name, bytes }) => read_bev_scene(bytes, name),
  read_points: ({ name, bytes }) => read_bev_points(bytes, name, 'top'),
  check_image: ({ scene, role, width, height }) => {
    check_bev_image(scene, role, width, height);
    return null;
  },
  keep_image: (rgba) => {
    image?.free();
    image = rgba ? new BevImage(rgba) : null;
    return null;
  },
};

function handle(message: Exclude<ToWorker, { type: 'start' }>): void {
  if (message.type === 'warp') {
    generation = message.generation;
    warpFrom(0, message.scene, message.generation);
    return;
  }
  const { id, call, given } = message;
  try {
    const handler = HANDLERS[call] as (given: unknown) => unknown;
    post({ type: 'answer', id, answer: handler(given) });
  } catch (error) {
    if (!(error instanceof Error && error.name === 'ScanstitchError')) throw error;
    post({ type: 'refused', id, message: error.message });
  }
}

function project({ scene, marked, region, lines, pair_tops, whole }: Question): Answer {
  const view = viewOf(scene);
  const { width, height } = scene.top;
  const [right, bottom] = [width - 0.5, height - 0.5];
  const { top, front } = view.layout(1);
  const max_depth = DEPTH_FOR_HEIGHT * Math.max(Math.abs(top.height), Math.abs(front.height));
  return {
    points: view.points(marked, 'top'),
    told: view.points(marked, 'top', whole),
    region: region.length > 0 ? view.polygon(region, 'top') : null,
    lines: view.segments(lines, 'top'),
    pair_points: view.points(pair_tops, 'top'),
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
    if (error instanceof Error && error.name === 'ScanstitchError') return; // told by `project` and `check_image`
    throw error;
  }
  const is_last = first_row + num_rows >= height;
  const clamped = new Uint8ClampedArray(rgba.buffer as ArrayBuffer, rgba.byteOffset, rgba.length);
  const strip = { generation: of, first_row, num_rows, width, rgba: clamped, is_last };
  post({ type: 'strip', strip }, [clamped.buffer]);
  // A task of its own, so that messages come in between.
  if (!is_last) setTimeout(() => attempt(() => warpFrom(first_row + num_rows, scene, of)));
}

function attempt(action: () => void): void {
  try {
    action();
  } catch (error) {
    crash(error);
  }
}

function crash(error: unknown): void {
  post({ type: 'crashed', message: error instanceof Error ? error.message : String(error) });
}

function post(message: FromWorker, transfer: Transferable[] = []): void {
  self.postMessage(message, { transfer });
}
