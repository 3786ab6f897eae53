/** A depth image as the eye can read it: near is bright and warm, far is dark and cold. */
import type { DepthColors } from '../engine/spatial-protocol.js';
import { frameColor, packColor } from '../views/palette.js';

export interface DepthPicture {
  image: ImageData;
  /** Of what is neither invalid nor among the outermost hundredth, m. */
  near: number;
  far: number;
  /** Share of the pixels without a depth. */
  invalid: number;
}

const STEPS = 256;

let ramp: Uint32Array | null = null;

/** Colours from near to far, as the engine takes them. */
export function depthRamp(): Uint32Array {
  ramp ??= Uint32Array.from({ length: STEPS }, (_, i) => packColor(depthColor(i / (STEPS - 1))));
  return ramp;
}

/** `depth_scale`: raw values to a metre. Pixels without a depth stay clear. */
export function depthPicture(colors: DepthColors, depth_scale: number): DepthPicture {
  const { width, height, pixels, near, far, num_invalid } = colors;
  const image = new ImageData(new Uint8ClampedArray(pixels.buffer as ArrayBuffer), width, height);
  const invalid = num_invalid / Math.max(pixels.length, 1);
  return { image, near: near / depth_scale, far: far / depth_scale, invalid };
}

/** Colours of the legend, from near to far, as CSS. */
export function depthLegend(): string {
  return Array.from({ length: 9 }, (_, i) => `rgb(${depthColor(i / 8).join(' ')})`).join(', ');
}

/** From near (0) to far (1). */
const depthColor = (t: number): ReturnType<typeof frameColor> => frameColor(1 - t, true);
