/** The sizes that images of cameras have, and which of them a principal point belongs to. */
import type { Size } from '../files/heads.js';

/** Sides in this ratio, up to this, are the same image in another size. */
const SAME_ASPECT = 0.01;

export function isSameAspect(a: Size, b: Size) {
  return Math.abs((a.width * b.height) / (a.height * b.width) - 1) < SAME_ASPECT;
}

/** Sizes of images. */
function pairs(words: string) {
  return words.split(' ').map((word) => {
    const [width = 0, height = 0] = word.split('x').map(Number);
    return { width, height };
  });
}

/** Those that cameras have. */
const SIZES = [
  ...pairs(
    '160x120 320x240 640x480 800x600 960x720 1024x768 1280x960 1296x968 1440x1080 1600x1200 1920x1440 2048x1536',
  ),
  ...pairs('256x192 2592x1944 3840x2880 4032x3024 512x512 1024x1024'),
  ...pairs('424x240 480x270 640x360 848x480 960x540 1280x720 1920x1080 3840x2160'),
];
/** A principal point lies so near to the middle of its images (shares of the sides) ... */
const NEAR_CENTRE = 0.06;
/** ... and nearer to that of images of another size, where these are meant. */
const AT_CENTRE = 0.04;

/**
 * The size of the images that a camera is for, by its principal point, which lies about their middle: where that is
 * another size of the same aspect that cameras have. Phones describe the camera of their colours, whose images are larger than the depth.
 * @param size of the depth images
 */
export function sizeByCentre(camera: Centre, size: Size): Size | null {
  if (offCentre(camera, size) <= NEAR_CENTRE) return null;
  const others = SIZES.filter((other) => isSameAspect(other, size));
  const [nearest] = others.sort((a, b) => offCentre(camera, a) - offCentre(camera, b));
  return nearest && offCentre(camera, nearest) <= AT_CENTRE ? nearest : null;
}

/** Whether a camera is that of images of this size before they were turned by a quarter: by its own size, or by its principal point. */
export function isOfTurned(camera: Centre & { size: Size | null }, size: Size) {
  const turned = { width: size.height, height: size.width };
  if (isSameAspect(turned, size)) return false;
  const { size: own } = camera;
  if (own) return own.width === turned.width && own.height === turned.height;
  return offCentre(camera, size) > NEAR_CENTRE && offCentre(camera, turned) <= AT_CENTRE;
}

type Centre = { cx: number; cy: number };

/** How far a principal point lies from the middle (shares of the sides). */
function offCentre({ cx, cy }: Centre, { width, height }: Size) {
  return Math.max(Math.abs((cx + 0.5) / width - 0.5), Math.abs((cy + 0.5) / height - 0.5));
}
