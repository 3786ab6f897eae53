/** A camera scaled to the depth images that it is used for. */
import { fileError } from '../base/errors.js';
import type { Size } from '../files/heads.js';
import { isOfTurned, isSameAspect, sizeByCentre } from './image_sizes.js';

/** A camera as its file describes it. */
export interface Camera {
  /** Where in the file it stands. */
  label: string;
  /** Pixels. */
  fx: number;
  fy: number;
  cx: number;
  cy: number;
  /** Of the images that it is for, where the file says it. */
  size: Size | null;
  /** Coefficients, as many as there are. */
  distortion: number[];
  /** Raw values per metre. */
  depth_scale: number | null;
  /** Whether it has a negative focal length, as renderers with a left-handed world write it. */
  isFlipped?: true;
  /** Whether its parameters are shares of the image's sides, in place of pixels. */
  isInShares?: true;
}

/** notes: what is worth knowing, each completes "FILE: ..." */
export type Chosen = { camera: Camera; notes: string[] };

/** Stray Scanner's own programs scale its principal point as it is, from the image's corner; others from its first pixel's middle. */
const SCALED_FROM_CORNER = /(^|\/)camera_matrix\.csv$/i;

/** The camera for images of this size, if it can be theirs; one of images that were turned by a quarter is turned, too. */
export function scaled(name: string, given: Camera, size: Size): Chosen {
  if (given.isInShares) return ofShares(given, size);
  if (!isOfTurned(given, size)) return scaledUpright(name, given, size);
  const { fx, fy, cx, cy } = given;
  const { camera, notes } = scaledUpright(name, { ...given, fx: fy, fy: fx, cx: cy, cy: cx, size: null }, size);
  const of = `${size.height} x ${size.width} pixels, turned by a quarter to the depth images' ${size.width} x ${size.height}`;
  const doubt = 'in which direction is not known: a principal point off the middle may be on the wrong side';
  return { camera, notes: [`the camera is one of ${of}; ${doubt}`, ...notes] };
}

function ofShares({ isInShares, ...given }: Camera, size: Size): Chosen {
  const { width, height } = size;
  const { fx, fy, cx, cy } = given;
  const camera = { ...given, fx: fx * width, fy: fy * height, cx: cx * width - 0.5, cy: cy * height - 0.5, size };
  return { camera, notes: [`its numbers are shares of the sides of the images, ${width} x ${height} pixels`] };
}

function scaledUpright(name: string, camera: Camera, size: Size): Chosen {
  const [images, remedy] = [`${size.width} x ${size.height}`, 'Give the camera of the depth images'];
  const own = camera.size ?? sizeByCentre(camera, size);
  if (own && !isSameAspect(own, size)) {
    throw fileError(
      name,
      `This camera is for ${own.width} x ${own.height} pixels, the depth images have ${images}`,
      remedy,
    );
  }
  const factor = own ? size.width / own.width : 1;
  const corner = SCALED_FROM_CORNER.test(name) ? 0 : 0.5;
  const move = (centre: number) => (centre + corner) * factor - corner;
  const moved =
    factor === 1
      ? camera
      : {
          ...camera,
          ...{ fx: camera.fx * factor, fy: camera.fy * factor, cx: move(camera.cx), cy: move(camera.cy), size },
        };
  const { fx, cx, cy } = moved;
  const isInside = cx > 0 && cy > 0 && cx < size.width && cy < size.height;
  const figures = `fx ${round(fx)}, principal point (${round(cx)}, ${round(cy)})`;
  // 6 to 160 degrees from side to side.
  if (!isInside || fx < 0.09 * size.width || fx > 10 * size.width) {
    throw fileError(name, `This camera (${figures}) cannot have taken depth images of ${images} pixels`, remedy);
  }
  const notes: string[] = [];
  if (factor !== 1 && own) {
    const by = camera.size ? '' : 'by its principal point, ';
    notes.push(`${by}the camera of ${own.width} x ${own.height} pixels is scaled to the depth images' ${images}`);
  }
  const offset = Math.max(Math.abs(cx / size.width - 0.5), Math.abs(cy / size.height - 0.5));
  if (offset > 0.2)
    notes.push(`${figures} lies far from the middle of images of ${images} pixels; is it another camera's?`);
  return { camera: moved, notes };
}

/** To a tenth of a pixel, as it is told. */
export function round(value: number) {
  return Number(value.toFixed(1));
}
