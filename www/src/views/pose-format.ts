/** Numbers of poses as people read them. */
import { DEGREES, formatFixed, formatLength } from './format.js';

/** A coordinate in metres, to the millimetre. */
export function formatCoordinate(metres: number): string {
  return formatFixed(metres, 3);
}

/** An angle given in radians, in degrees with the sign. */
export function formatAngle(radians: number, decimals = 2): string {
  return `${formatFixed(radians * DEGREES, decimals)}°`;
}

/** A length that may be far below a millimetre, as the steps of a registration are. */
export function formatStep(metres: number): string {
  const size = Math.abs(metres);
  const sign = metres < 0 ? '\u2212' : '';
  return sign + (size > 0 && size < 5e-5 ? `${(size * 1e6).toFixed(size < 1e-6 ? 2 : 0)}\u202fµm` : formatLength(size));
}
