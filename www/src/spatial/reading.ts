/** What was assumed of depth images and clouds, in words. */
import type { Assumption } from '../engine/spatial-protocol.js';
import { DEGREES, formatFixed } from '../views/format.js';
import type { Camera } from './poses.js';

/** Raw values per metre, or a focal length in pixels, as they are written. */
export function valueText(value: number): string {
  return `${Number(value.toPrecision(7))}`;
}

function angleText({ width }: Camera, fx: number): string {
  return `${formatFixed(2 * Math.atan(width / 2 / fx) * DEGREES, 0)}°`;
}

export function valueWords({ setting }: Assumption, value: number, camera: Camera | null): string {
  if (setting === 'cloud_unit') return `${valueText(value)} m`;
  if (setting === 'depth_scale') return `${valueText(value)} values per metre`;
  const pixels = `${valueText(Math.round(value))} pixels`;
  return camera ? `${pixels}, ${angleText(camera, value)}` : pixels;
}

/** The assumption that the data leave open: the page asks. */
export function openAssumption(assumptions: readonly Assumption[]): Assumption | null {
  return assumptions.find(({ likely }) => likely.length > 1) ?? null;
}
