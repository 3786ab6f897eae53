/** Scans of the built-in sample, which its script holds as ranges: they take half of what points take. */

const HEADER = 'ply\nformat ascii 1.0\n';
const COORDINATES = ['x', 'y', 'z'].map((axis) => `property double ${axis}\n`).join('');

/** The PLY file of these ranges: metres, separated by blanks, over half a turn to the left from the x axis. */
export function scanText(ranges: string): string {
  const values = ranges.split(' ').map(Number);
  const points = values.map((range, beam) => {
    const angle = (Math.PI * beam) / (values.length - 1);
    return `${(range * Math.cos(angle)).toFixed(4)} ${(range * Math.sin(angle)).toFixed(4)} 0.0000\n`;
  });
  return `${HEADER}element vertex ${values.length}\n${COORDINATES}end_header\n${points.join('')}`;
}
