/**
 * A recording as trainers of Gaussian splats and radiance fields open it: the colour images with their poses as nerfstudio
 * (transforms.json) and as COLMAP (sparse/0, as text) describe them, and the points of the map to begin with.
 *
 * In both, the middle of the first pixel is at 0.5, where ours is at 0. COLMAP's cameras are as ours, x right, y down, z ahead, and
 * its poses lead from the world to the camera; nerfstudio's are OpenGL's, x right, y up, z backward, and lead to the world.
 */
import type { SpatialResult } from '../../pkg/scanstitch.js';
import { imageSize, type Size } from '../files/heads.js';
import type { PlacedFrame } from './frames.js';

type Camera = NonNullable<SpatialResult['camera']>;

/** Of a map, so many points at most: trainers begin with them and make their own. */
const MAX_POINTS = 200_000;

export interface MapOfPoints {
  /** x y z x y z ..., m. */
  positions: ArrayLike<number>;
  /** red green blue ...; empty without. */
  colors: ArrayLike<number>;
}

/** An image of the folder, and where its camera stood. */
interface Posed {
  path: string;
  pose: Float64Array;
}

const IMAGES = 'images';

/** Reads the colours of each frame, and hands out every file of the folder. Returns how many frames have colours. */
export async function splatFiles(
  camera: Camera,
  frames: readonly PlacedFrame[],
  points: MapOfPoints,
  colorsOf: (frame: PlacedFrame) => Promise<Uint8Array | null>,
  write: (path: string, bytes: Uint8Array) => unknown,
): Promise<number> {
  const posed: Posed[] = [];
  let size: Size | null = null;
  for (const frame of frames) {
    const colors = await colorsOf(frame);
    const found = colors && pictureOf(colors);
    if (!colors || !found) continue;
    size ??= found.size;
    const path = `${IMAGES}/frame_${String(frame.index + 1).padStart(5, '0')}.${found.ending}`;
    await write(path, colors);
    posed.push({ path, pose: frame.pose });
  }
  if (posed.length === 0) return 0;
  const lens = lensOf(camera, size ?? camera);
  const text = (path: string, content: string) => write(path, new TextEncoder().encode(content));
  await text('transforms.json', transforms(lens, posed));
  await text(
    'sparse/0/cameras.txt',
    `1 PINHOLE ${[lens.w, lens.h, lens.fl_x, lens.fl_y, lens.cx, lens.cy].join(' ')}\n`,
  );
  await text('sparse/0/images.txt', colmapImages(posed));
  const stride = Math.ceil(points.positions.length / 3 / MAX_POINTS);
  await text('sparse/0/points3D.txt', colmapPoints(points, stride));
  await text('sparse_pc.ply', plyPoints(points, stride));
  return posed.length;
}

/** Trainers read PNG and JPEG; null for others. */
function pictureOf(bytes: Uint8Array): { size: Size; ending: string } | null {
  if (bytes[0] !== 0xff || bytes[1] !== 0xd8) {
    const size = bytes[0] === 0x89 ? imageSize(bytes) : null;
    return size && { size, ending: 'png' };
  }
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  // The segments of a JPEG: a marker and a length each; those that begin a frame tell its size.
  for (let at = 2; at + 9 <= bytes.length && bytes[at] === 0xff; at += 2 + view.getUint16(at + 2)) {
    const marker = bytes[at + 1] ?? 0;
    if (marker >= 0xc0 && marker <= 0xcf && ![0xc4, 0xc8, 0xcc].includes(marker)) {
      return { size: { width: view.getUint16(at + 7), height: view.getUint16(at + 5) }, ending: 'jpg' };
    }
  }
  return null;
}

/** The camera of the colour images, which are registered to the depth and may be of another size. */
function lensOf({ width, height, fx, fy, cx, cy }: Camera, size: Size) {
  const [across, down] = [size.width / width, size.height / height];
  const center = { cx: (cx + 0.5) * across, cy: (cy + 0.5) * down };
  return { w: size.width, h: size.height, fl_x: fx * across, fl_y: fy * down, ...center };
}

function transforms(lens: ReturnType<typeof lensOf>, posed: readonly Posed[]) {
  const distortion = { k1: 0, k2: 0, p1: 0, p2: 0 };
  const frames = posed.map(({ path, pose }) => ({ file_path: path, transform_matrix: openGlMatrix(pose) }));
  const all = { camera_model: 'OPENCV', ...lens, ...distortion, ply_file_path: 'sparse_pc.ply', frames };
  return `${JSON.stringify(all, null, 1)}\n`;
}

/** Camera to world, of a camera with y up that looks along -z. */
function openGlMatrix(pose: Float64Array): number[][] {
  const [x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 1] = pose;
  return [
    [1 - 2 * (qy * qy + qz * qz), -2 * (qx * qy - qz * qw), -2 * (qx * qz + qy * qw), x],
    [2 * (qx * qy + qz * qw), -(1 - 2 * (qx * qx + qz * qz)), -2 * (qy * qz - qx * qw), y],
    [2 * (qx * qz - qy * qw), -2 * (qy * qz + qx * qw), -(1 - 2 * (qx * qx + qy * qy)), z],
    [0, 0, 0, 1],
  ];
}

/** A line for each image, and an empty one where its points would be. */
function colmapImages(posed: readonly Posed[]) {
  const lines = posed.map(({ path, pose }, i) => {
    const [x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 1] = pose;
    // The inverse: t' = -R^T t, with the columns of R as rows.
    const gl = openGlMatrix(pose);
    const column = (k: number, sign: number) =>
      -sign * ((gl[0]?.[k] ?? 0) * x + (gl[1]?.[k] ?? 0) * y + (gl[2]?.[k] ?? 0) * z);
    const translation = [column(0, 1), column(1, -1), column(2, -1)];
    return `${[i + 1, qw, -qx, -qy, -qz, ...translation, 1].join(' ')} ${path.slice(IMAGES.length + 1)}\n\n`;
  });
  return lines.join('');
}

/** Each point that is kept, with its colour. */
function* kept({ positions, colors }: MapOfPoints, stride: number) {
  for (let i = 0; 3 * i < positions.length; i += stride) {
    const at = (values: ArrayLike<number>, missing: number) => [0, 1, 2].map((k) => values[3 * i + k] ?? missing);
    yield { place: at(positions, 0), color: at(colors, 128) };
  }
}

function colmapPoints(points: MapOfPoints, stride: number) {
  const lines = [...kept(points, stride)].map(({ place, color }, i) => `${[i + 1, ...place, ...color, 0].join(' ')}\n`);
  return lines.join('');
}

function plyPoints(points: MapOfPoints, stride: number) {
  const rows = [...kept(points, stride)].map(({ place, color }) => `${[...place, ...color].join(' ')}\n`);
  const named = (type: string, names: string) => [...names].map((name) => `property ${type} ${name}\n`).join('');
  const colors = ['red', 'green', 'blue'].map((name) => `property uchar ${name}\n`).join('');
  const header = `ply\nformat ascii 1.0\nelement vertex ${rows.length}\n${named('float', 'xyz')}${colors}end_header\n`;
  return header + rows.join('');
}
