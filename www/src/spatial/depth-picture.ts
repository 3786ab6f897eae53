/** A depth image as the eye can read it: near is bright and warm, far is dark and cold. */
import { frameColor, packColor } from '../views/palette.js';

export interface DepthPixels {
  width: number;
  height: number;
  bits: number;
  values: Uint16Array;
}

export interface DepthPicture {
  image: ImageData;
  /** Of what is neither invalid nor among the outermost hundredth, m. */
  near: number;
  far: number;
  /** Share of the pixels without a depth. */
  invalid: number;
}

const STEPS = 256;
/** Pixels that tell how near and how far the scene is, at the least. */
const RANGE_SAMPLES = 20_000;

/** `depth_scale`: raw values to a metre. Pixels without a depth stay clear. */
export function depthPicture({ width, height, values }: DepthPixels, depth_scale: number): DepthPicture {
  const colors = Uint32Array.from({ length: STEPS }, (_, i) => packColor(frameColor(1 - i / (STEPS - 1), true)));
  const { near, far } = range(values);
  const image = new ImageData(width, height);
  const pixels = new Uint32Array(image.data.buffer);
  const steps_per_value = (STEPS - 1) / Math.max(far - near, 1);
  let invalid = 0;
  for (let i = 0; i < values.length; i++) {
    const value = values[i] ?? 0;
    if (value === 0) {
      invalid++;
      continue;
    }
    const step = Math.min(Math.max(Math.round((value - near) * steps_per_value), 0), STEPS - 1);
    pixels[i] = colors[step] ?? 0;
  }
  return { image, near: near / depth_scale, far: far / depth_scale, invalid: invalid / Math.max(values.length, 1) };
}

/** Colours of the legend, from near to far, as CSS. */
export function depthLegend(): string {
  return Array.from({ length: 9 }, (_, i) => `rgb(${frameColor(1 - i / 8, true).join(' ')})`).join(', ');
}

/** From some of the pixels, scattered over the image. */
function range(values: Uint16Array): { near: number; far: number } {
  const counts = new Uint32Array(65_536);
  const stride = 2 * Math.floor(values.length / (2 * RANGE_SAMPLES)) + 1;
  let num_valid = 0;
  for (let i = 0; i < values.length; i += stride) {
    const value = values[i] ?? 0;
    if (value === 0) continue;
    counts[value]!++;
    num_valid++;
  }
  const cut = num_valid / 100;
  let near = 1;
  for (let sum = counts[1] ?? 0; sum <= cut && near < 65_535; sum += counts[near] ?? 0) near++;
  let far = 65_535;
  for (let sum = counts[far] ?? 0; sum <= cut && far > near; sum += counts[far] ?? 0) far--;
  return { near, far };
}
