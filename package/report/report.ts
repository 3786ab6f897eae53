/** The report of a run that a person reads and prints: one HTML file, its pictures inside it, without scripts. */
import type { ReconstructionResult as PlanarResult, SpatialResult } from '../../pkg/scanstitch.js';
import { printable } from '../base/printable.js';
import { assumedMark, statusWords } from './assumed.js';
import { drawing, type Scene } from './drawing.js';

type Frame = PlanarResult['frames'][number] | SpatialResult['frames'][number];
type Turns = 0 | 1 | 2 | 3;
interface Context {
  /** Of the recording. */
  title: string;
  /** Names of the files. */
  opened: readonly string[];
  /** What was left out or could not be used, in sentences. */
  losses: readonly string[];
  /** Of the map (m): x y ... of a planar run, x y z ... of one in space. */
  points: Float32Array;
  /** The map as it was on the screen, as a data: address. */
  picture?: string;
  /** Quarter turns, counter-clockwise, by which a planar map was turned there. */
  turns?: Turns;
  /** Frames of the recording, registered or not. */
  num_frames?: number;
}

/** More files are counted, not named. */
const MOST_NAMES = 30;

export function reportHtml(result: PlanarResult | SpatialResult, context: Context) {
  const { title, opened, losses, picture } = context;
  const notes = unlike([...losses, ...result.notes]);
  return `<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; img-src data:">
<title>${text(title)}: reconstruction</title>
<style>${STYLES}</style>
</head>
<body>
<header><h1>${text(title)}</h1><p>Reconstruction by Scanstitch ${text(result.version)}. Lengths in metres unless said otherwise.</p></header>
<section><h2>Result</h2><dl class="figures">${figures(result, context)
    .map(([label, value, meaning]) => `<div><dt>${label}</dt><dd><strong>${value}</strong> ${meaning}</dd></div>`)
    .join('')}</dl></section>
<section><h2>Map and path</h2>
${picture ? `<img src="${text(picture, Infinity)}" alt="The map as it was on the screen">` : ''}
${drawing(sceneOf(result, context))}</section>
<section><h2>Notes and losses</h2>${notes.length === 0 ? '<p>None.</p>' : list(notes)}</section>
<section><h2>Files</h2>${list([...opened.slice(0, MOST_NAMES), ...(opened.length > MOST_NAMES ? [`and ${opened.length - MOST_NAMES} more`] : [])])}</section>
<section><h2>Frames</h2>${frameTable(result)}</section>
<section><h2>Settings</h2>${settingsTable(result.settings)}</section>
</body>
</html>
`;
}

function figures(
  result: PlanarResult | SpatialResult,
  { num_frames = 0 }: Context,
): [label: string, value: string, meaning: string][] {
  const { frames, comparison } = result;
  const count = (wanted: string) => frames.filter(({ status }) => status === wanted).length;
  const placed = frames.filter(({ status }) => status !== 'lost').map(positionOf);
  const length = placed.reduce((sum, place, i) => sum + (i > 0 ? distance(place, placed[i - 1] ?? place) : 0), 0);
  const rows: [string, string, string][] = [
    [
      'Frames',
      frames.length < num_frames ? `${frames.length} of ${num_frames}` : String(frames.length),
      'assumptions' in result
        ? statusWords(result)
        : `${count('good')} good, ${count('doubtful')} doubtful, ${count('lost')} lost`,
    ],
    ['Length of the path', `${length.toFixed(2)} m`, ''],
  ];
  if ('unconnected' in result && result.unconnected !== null) {
    const pieces = new Set(frames.flatMap(({ status, piece }) => (status === 'lost' ? [] : [piece])));
    rows.push(['Map', `${pieces.size} pieces`, 'not connected: how they lie relative to each other is not known']);
  }
  if ('sharpness' in result && result.sharpness)
    rows.push(['Sharpness', millimetres(result.sharpness.mean_residual), 'mean distance between overlapping scans']);
  if ('camera' in result && result.camera) {
    const { width, height, fx } = result.camera;
    const mark = (setting: 'depth_scale' | 'fx') => assumedMark(result.assumptions, setting);
    const perMetre = Number((result.depth_scale ?? 0).toPrecision(6));
    const scale = result.depth_scale === null ? '' : `, ${perMetre} raw values per metre${mark('depth_scale')}`;
    rows.push(['Camera', `${width} x ${height}`, `focal length ${fx.toFixed(1)} pixels${mark('fx')}${scale}`]);
  }
  if (comparison) {
    const { name, num_matched, aligned } = comparison;
    const words = ({ rmse, max }: { rmse: number; max: number }) =>
      `mean; rmse ${millimetres(rmse)}, max ${millimetres(max)}`;
    const matched = `${num_matched} of ${frames.length} frames; ${text(comparison.convention)}`;
    rows.push([
      `Distance to ${text(name)}`,
      millimetres(comparison.mean),
      `${words(comparison)}, first poses aligned; ${matched}`,
    ]);
    if (aligned)
      rows.push([
        'With all poses aligned',
        millimetres(aligned.mean),
        `${words(aligned)}, by a rotation and translation`,
      ]);
  }
  return rows;
}

function frameTable({ frames, comparison }: PlanarResult | SpatialResult) {
  const isSpatial = frames[0] !== undefined && 'qw' in frames[0].T_world_sensor;
  const heads = [
    '',
    'frame',
    'status',
    'x',
    'y',
    isSpatial ? 'z' : 'heading (deg)',
    ...(isSpatial ? ['turn (deg)'] : []),
  ];
  heads.push('inliers', 'rmse (mm)', 'iterations', ...(comparison ? ['error (mm)'] : []), 'reason');
  const rows = frames.map((frame, i) => {
    const error = comparison?.errors[i];
    const cells = [
      String(i + 1),
      text(frame.name),
      `<span class="${frame.status}">${frame.status}</span>`,
      ...(frame.status === 'lost' ? Array(isSpatial ? 4 : 3).fill('–') : poseCells(frame)),
      String(frame.num_inliers),
      (1000 * frame.inlier_rmse).toFixed(1),
      String(frame.iterations),
      ...(comparison ? [typeof error === 'number' ? (1000 * error).toFixed(1) : '–'] : []),
      text(frame.reason, 400),
    ];
    return `<tr>${cells.map((cell) => `<td>${cell}</td>`).join('')}</tr>`;
  });
  return `<table><thead><tr>${heads.map((head) => `<th scope="col">${head}</th>`).join('')}</tr></thead><tbody>${rows.join('\n')}</tbody></table>`;
}

function poseCells({ T_world_sensor: pose }: Frame) {
  const degrees = (radians: number) => fixed((radians * 180) / Math.PI, 2);
  if ('theta' in pose) return [fixed(pose.x, 3), fixed(pose.y, 3), degrees(pose.theta)];
  const { x, y, z, qx, qy, qz, qw } = pose;
  const turn = 2 * Math.atan2(Math.hypot(qx, qy, qz), Math.abs(qw));
  return [fixed(x, 3), fixed(y, 3), fixed(z, 3), degrees(turn)];
}

/** Settings that are angles: radians in the engine, degrees for a reader. */
const ANGLES = ['search_rotation', 'max_normal_angle', 'rotation_eps', 'field_of_view'];

function settingsTable(settings: object) {
  const rows = Object.entries(settings).map(
    ([name, value]) => `<tr><th scope="row">${text(name)}</th><td>${text(settingWords(name, value))}</td></tr>`,
  );
  return `<table class="settings"><tbody>${rows.join('')}</tbody></table>`;
}

/** With the digits that count, and angles in degrees. */
function settingWords(name: string, value: unknown): string {
  if (typeof value !== 'number') return value === null ? '–' : String(value);
  const isAngle = ANGLES.includes(name);
  return `${Number((isAngle ? (value * 180) / Math.PI : value).toPrecision(6))}${isAngle ? '°' : ''}`;
}

/**
 * The run from above: a planar one the same way up as on the screen. In space, along the axis in which the path extends
 * least: a path mostly lies on a floor.
 */
function sceneOf({ frames, comparison }: PlanarResult | SpatialResult, { points, turns = 0 }: Context): Scene {
  const places = frames.map((frame) => (frame.status === 'lost' ? null : positionOf(frame)));
  const references = (comparison?.reference ?? []).map(
    (pose: { x: number; y: number } | null) => pose && placeOf(pose),
  );
  const is_planar = !frames.some(({ T_world_sensor }) => 'qw' in T_world_sensor);
  if (is_planar) {
    const turned = turnedBy(turns);
    const place = (at: readonly number[] | null) => at && turned(at[0] ?? 0, at[1] ?? 0);
    return {
      points: turnedPoints(points, turned),
      path: places.map(place),
      reference: references.map(place),
      axes: AXES[turns] ?? ['x', 'y'],
    };
  }
  const [right, up] = widestAxes(places);
  const axes = [`${'xyz'[right]}`, `${'xyz'[up]}`] as [string, string];
  const flat = (place: readonly number[] | null) => place && ([place[right] ?? 0, place[up] ?? 0] as const);
  return {
    points: flattened(points, right, up),
    path: places.map(flat),
    reference: references.map(flat),
    axes,
  };
}

/** What is to the right and what is up after so many quarter turns. */
const AXES: readonly (readonly [right: string, up: string])[] = [
  ['x', 'y'],
  ['−y', 'x'],
  ['−x', '−y'],
  ['y', '−x'],
];

type Turned = (x: number, y: number) => readonly [number, number];

function turnedBy(turns: Turns): Turned {
  const [cos, sin] = [[1, 0, -1, 0] as const, [0, 1, 0, -1] as const].map((values) => values[turns]) as [
    number,
    number,
  ];
  return (x, y) => [x * cos - y * sin, x * sin + y * cos];
}

function turnedPoints(points: Float32Array, turned: Turned): Float32Array {
  const all = new Float32Array(points.length);
  for (let i = 0; i + 1 < points.length; i += 2) all.set(turned(points[i] ?? 0, points[i + 1] ?? 0), i);
  return all;
}

function widestAxes(places: readonly (readonly number[] | null)[]): [right: number, up: number] {
  const extents = [0, 1, 2].map((axis) => {
    const values = places.flatMap((place) => (place ? [place[axis] ?? 0] : []));
    const [least, most] = values.reduce(
      ([a, b], value) => [Math.min(a, value), Math.max(b, value)],
      [Infinity, -Infinity],
    );
    return most - least;
  });
  // A camera that stands still looks along z, and y is down: from above, x and z are seen.
  const narrowest = Math.max(...extents) > 0 ? extents.indexOf(Math.min(...extents)) : 1;
  const [right = 0, up = 2] = [0, 1, 2].filter((axis) => axis !== narrowest);
  return [right, up];
}

function flattened(points: Float32Array, right: number, up: number) {
  const flat = new Float32Array((2 * points.length) / 3);
  for (let i = 0; 3 * i < points.length; i++) {
    flat[2 * i] = points[3 * i + right] ?? 0;
    flat[2 * i + 1] = points[3 * i + up] ?? 0;
  }
  return flat;
}

function positionOf({ T_world_sensor }: Frame) {
  return placeOf(T_world_sensor);
}

function placeOf({ x, y, z = 0 }: { x: number; y: number; z?: number }) {
  return [x, y, z];
}

function distance(a: readonly number[], b: readonly number[]) {
  return Math.hypot(...a.map((value, axis) => value - (b[axis] ?? 0)));
}

function millimetres(metres: number) {
  return `${(1000 * metres).toFixed(1)} mm`;
}

/** Removes repeated sentences, since messages of the page may equal notes of the result. */
function unlike(sentences: readonly string[]) {
  const letters = (sentence: string) => sentence.replaceAll(/[^\p{L}\p{N}]+/gu, ' ').trim();
  return [...new Map(sentences.map((sentence) => [letters(sentence), sentence])).values()];
}

/** Without the sign of a rounded zero. */
const fixed = (value: number, digits: number) => value.toFixed(digits).replace(/^-(0\.?0*)$/, '$1');

function list(lines: readonly string[]) {
  return `<ul>${lines.map((line) => `<li>${text(line, 2000)}</li>`).join('')}</ul>`;
}

/** Foreign text in HTML. */
function text(raw: string, longest?: number) {
  const entities = {
    '&': '&amp;',
    '<': '&lt;',
    '>': '&gt;',
    '"': '&quot;',
    "'": '&#39;',
  } as Record<string, string>;
  return printable(raw, longest).replace(/[&<>"']/g, (character) => entities[character] ?? '');
}

const STYLES = `
body { max-width: 980px; margin: 24px auto; padding: 0 20px; color: #17202c; background: #fff; font: 14px/1.45 system-ui, sans-serif; }
h1 { margin: 0; font-size: 24px; } h2 { margin: 28px 0 8px; font-size: 16px; } header p { margin: 2px 0; color: #536070; }
.figures { display: grid; grid-template-columns: repeat(auto-fill, minmax(260px, 1fr)); gap: 12px 24px; margin: 0; }
dt { color: #536070; font-size: 12.5px; } dd { margin: 0; } dd strong { font-size: 18px; margin-right: 4px; }
img, svg { display: block; width: 100%; max-height: 80vh; border: 1px solid #dde3ea; border-radius: 6px; margin-bottom: 8px; object-fit: contain; }
.legend { margin: 0; color: #536070; } .legend i { display: inline-block; width: 28px; margin: 0 6px 4px 12px; border-top: 3px solid; }
ul { margin: 0; padding-left: 20px; overflow-wrap: anywhere; }
table { width: 100%; border-collapse: collapse; font-size: 12.5px; font-variant-numeric: tabular-nums; }
th, td { padding: 3px 6px; border-bottom: 1px solid #dde3ea; text-align: right; vertical-align: top; white-space: nowrap; }
td:nth-child(2), td:last-child, .settings td { white-space: normal; overflow-wrap: anywhere; }
th:nth-child(2), td:nth-child(2), td:nth-child(3), th:nth-child(3), td:last-child, th:last-child, .settings th { text-align: left; }
.settings { width: auto; } .settings th { font-weight: 400; color: #536070; }
.good { color: #19703e; } .doubtful { color: #8a4f08; font-weight: 600; } .lost { color: #ad2219; font-weight: 600; }
@media print { body { margin: 0; max-width: none; } table { font-size: 11px; } th, td { padding: 2px 4px; } thead { display: table-header-group; } tr, svg, img { break-inside: avoid; } h2 { break-after: avoid; } }
`;
