/** A scan as the laser sees it, drawn on a canvas: the laser in its place, x ahead and up. */

const MARGIN = 14;
/** Rings are this far apart, the first that leaves at most six (m). */
const RING_STEPS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 1000];
const MAX_RINGS = 6;
/** Points beyond this share of all are let out of the picture: a few stray far ones would shrink the rest. */
const SHOWN_SHARE = 0.98;

export interface PreviewColors {
  point: string;
  line: string;
  text: string;
  laser: string;
}

/** Draws points (x ahead, y left, m) into a canvas of this size in CSS pixels. */
export function drawScan(
  canvas: HTMLCanvasElement,
  points: readonly (readonly [number, number])[],
  { point, line, text, laser }: PreviewColors,
): void {
  const { clientWidth: width, clientHeight: height } = canvas;
  const density = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * density);
  canvas.height = Math.round(height * density);
  const pen = canvas.getContext('2d');
  if (!pen || width === 0) return;
  pen.scale(density, density);
  const ranges = points.map(([x, y]) => Math.hypot(x, y)).sort((a, b) => a - b);
  const farthest = Math.max(1e-3, ranges[Math.floor(SHOWN_SHARE * (ranges.length - 1))] ?? 1);
  const scale = (Math.min(width, height) / 2 - MARGIN) / farthest;
  const [u, v] = [width / 2, height / 2];
  pen.strokeStyle = line;
  pen.fillStyle = text;
  pen.font = '11px system-ui, sans-serif';
  const step = RING_STEPS.find((step) => farthest / step <= MAX_RINGS) ?? farthest;
  for (let ring = step; ring <= farthest; ring += step) {
    pen.beginPath();
    pen.arc(u, v, ring * scale, 0, 2 * Math.PI);
    pen.stroke();
    pen.fillText(`${Number(ring.toFixed(1))} m`, u + 3, v - ring * scale - 3);
  }
  pen.fillStyle = point;
  for (const [x, y] of points) pen.fillRect(u - y * scale - 1, v - x * scale - 1, 2.2, 2.2);
  pen.fillStyle = laser;
  pen.beginPath();
  pen.moveTo(u, v - 8);
  pen.lineTo(u + 5, v + 5);
  pen.lineTo(u - 5, v + 5);
  pen.fill();
}
