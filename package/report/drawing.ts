/** The map and the path from above, as one picture of lines and points (SVG), for a page that runs no script. */

/** Largest number of points that are drawn; larger maps are sampled evenly. */
const MOST_POINTS = 20_000;
/** Points within this quantile of the distances to the path, or this many times their median, are to be in the picture, as on the page. */
const NEAR_QUANTILE = 0.9;
const NEAR_MEDIANS = 2;
/** Places of the path from which those distances are measured, at most. */
const MOST_PLACES = 200;
/** Share of the near points, on each side of each axis, that may lie outside the picture. */
const STRAYS = 0.01;
/** Width of the picture, and its height at most (units of the picture). */
const WIDTH = 960;
const MOST_HEIGHT = 800;
const MARGIN = 24;

/** M, x to the right, y up. */
type Point = readonly [x: number, y: number];
export interface Scene {
  /** Of the map, x y x y ... (m). */
  points: Float32Array;
  /** Null where a frame is lost. */
  path: readonly (Point | null)[];
  /** In the same world; null where it has no pose. */
  reference: readonly (Point | null)[];
  /** What is to the right, and what is up. */
  axes: readonly [string, string];
}

export function drawing(scene: Scene) {
  const points = thinned(scene.points);
  const path = scene.path.filter((point) => point !== null);
  const view = viewOf(nearPath(points, path), [...path, ...scene.reference.filter((point) => point !== null)]);
  if (!view) return '';
  const dots = [];
  for (let i = 0; i < points.length; i += 2) {
    const place = view.place([points[i] ?? 0, points[i + 1] ?? 0]);
    if (place.x >= 0 && place.x <= WIDTH && place.y >= 0 && place.y <= view.height) dots.push(`M${place.text}h0`);
  }
  const line = (path: readonly (Point | null)[]) => lineOf(path.map((point) => point && view.place(point).text));
  const start = scene.path.find((point) => point !== null);
  const hasReference = scene.reference.some((point) => point !== null);
  return `<svg viewBox="0 0 ${WIDTH} ${view.height}" role="img" aria-label="Map and path from above" fill="none" stroke-linecap="round" stroke-linejoin="round">
<path d="${dots.join('')}" stroke="#3d4a5c" stroke-width="2.2"/>
${hasReference ? `<path d="${line(scene.reference)}" stroke="#b4530a" stroke-width="2" stroke-dasharray="7 5"/>` : ''}
<path d="${line(scene.path)}" stroke="#2356c7" stroke-width="2.4"/>
${start ? `<circle cx="${view.place(start).x.toFixed(1)}" cy="${view.place(start).y.toFixed(1)}" r="5" fill="#2356c7"/>` : ''}
${scaleBar(view)}
</svg>
<p class="legend"><i style="border-color:#2356c7"></i>path, from the dot on${hasReference ? '<i style="border-color:#b4530a;border-style:dashed"></i>ground truth' : ''}; ${scene.axes[0]} to the right, ${scene.axes[1]} up</p>`;
}

function thinned(points: Float32Array) {
  const stride = Math.ceil(points.length / 2 / MOST_POINTS);
  if (stride <= 1) return points;
  const kept = new Float32Array(2 * Math.ceil(points.length / 2 / stride));
  for (let i = 0; i < kept.length; i++) kept[i] = points[(i >> 1) * 2 * stride + (i & 1)] ?? 0;
  return kept;
}

/** Those that are not much farther from the path than most: a far glimpse does not shrink the rest. */
function nearPath(points: Float32Array, path: Point[]) {
  const stride = Math.max(1, Math.ceil(path.length / MOST_PLACES));
  const places = path.filter((_, i) => i % stride === 0);
  if (places.length === 0) return points;
  const distances = Float32Array.from({ length: points.length / 2 }, (_, i) => {
    const [x = 0, y = 0] = [points[2 * i], points[2 * i + 1]];
    let least = Infinity; // of the squares, several times faster than Math.hypot
    for (const place of places) least = Math.min(least, (place[0] - x) ** 2 + (place[1] - y) ** 2);
    return Math.sqrt(least);
  });
  const sorted = distances.slice().sort();
  const at = (share: number) => sorted[Math.round(share * (sorted.length - 1))] ?? 0;
  const limit = Math.max(at(NEAR_QUANTILE), NEAR_MEDIANS * at(0.5));
  return points.filter((_, k) => (distances[k >> 1] ?? 0) <= limit);
}

/** From the least to the most of an axis. */
function rangeOf(points: Float32Array, others: Point[], axis: 0 | 1) {
  const sorted = Float32Array.from({ length: points.length / 2 }, (_, i) => points[2 * i + axis] ?? 0).sort();
  const at = (share: number) => sorted[Math.round(share * (sorted.length - 1))] ?? 0;
  let [least, most] = sorted.length > 0 ? [at(STRAYS), at(1 - STRAYS)] : [Infinity, -Infinity];
  for (const point of others) [least, most] = [Math.min(least, point[axis]), Math.max(most, point[axis])];
  return [least, most];
}

/** Where everything lies in the picture; null where there is nothing. */
function viewOf(points: Float32Array, others: Point[]) {
  const [left = 0, right = 0] = rangeOf(points, others, 0);
  const [bottom = 0, top = 0] = rangeOf(points, others, 1);
  if (!(right >= left && top >= bottom)) return null;
  const inner = { width: WIDTH - 2 * MARGIN, height: MOST_HEIGHT - 2 * MARGIN };
  const scale = Math.min(inner.width / Math.max(right - left, 0.1), inner.height / Math.max(top - bottom, 0.1));
  const height = Math.ceil((top - bottom) * scale + 2 * MARGIN + 24);
  const shift = (WIDTH - (right - left) * scale) / 2;
  const place = ([x, y]: Point) => {
    const [px, py] = [shift + (x - left) * scale, MARGIN + (top - y) * scale];
    return { x: px, y: py, text: `${px.toFixed(1)} ${py.toFixed(1)}` };
  };
  return { place, scale, height };
}

/** A line that is broken where a place is missing. */
function lineOf(places: (string | null)[]) {
  return places
    .map((place, i) => (place === null ? '' : `${i > 0 && places[i - 1] !== null ? 'L' : 'M'}${place}`))
    .join('');
}

/** A round length, about a sixth of the width. */
function scaleBar({ scale, height }: { scale: number; height: number }) {
  const wanted = WIDTH / 6 / scale;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const length = power * ([5, 2, 1].find((factor) => factor * power <= wanted) ?? 1);
  const [x, y] = [WIDTH - MARGIN - length * scale, height - 10];
  const words = length < 1 ? `${Math.round(100 * length)} cm` : `${length} m`;
  return `<path d="M${x.toFixed(1)} ${y - 5}v5H${WIDTH - MARGIN}v-5" stroke="#17202c" stroke-width="1.5"/>
<text x="${WIDTH - MARGIN}" y="${y - 9}" text-anchor="end" font-size="14" fill="#17202c">${words}</text>`;
}
