/**
 * Arrays of laser scans, as MATLAB and NumPy keep them, as a text that the engine reads: a table with a scan a row, whose
 * first line says what its columns are, or CSM's JSON where the angles are not evenly spaced. Arrays are recognised by
 * their names and by the lengths that they have in common.
 */
import { inRadians } from './angles.js';
import type { Numbers, Struct, Value, Variables } from './mat.js';

/** Arrays that belong together, by their names. */
type Group = Map<string, Numbers>;
/** A scan a row. */
type Ranges = { rows: number; beams: number; at: (row: number, beam: number) => number };
/** X y heading. */
type Poses = { at: (row: number, column: number) => number };
type PoseRole = 'odometry' | 'poses' | 'reference';

/** A scan has so many readings at least: a pose has 16 numbers at the most. */
const MIN_BEAMS = 24;
/** Of a matrix whose name says nothing, fewer rows are points or poses. */
const MIN_ROWS = 4;
/** What points are called. */
const POINTS = /cloud|points?|pts|^(xyz|xy|model|data|source|target|src|dst|moving|fixed|scan|pc)_?\d*$/;
/** Readings of lasers that are common. */
const KNOWN_BEAMS = [180, 181, 360, 361, 400, 541, 682, 683, 720, 721, 1080, 1081, 1440];
const RANGES = /^(ranges?|scans?|lasers?|lidars?|hokuyo|readings?|rho|dist(ances?)?|las(er|dar)\w*)$/;
const LIKE_RANGES = /range|scan|laser|lidar|dist/;
const NO_RANGES = /min|max|angle|inc|res|time|stamp|intens|map|grid|image|num|pose/;
const ANGLES = /ang|theta|bearing|phi|azim|^th$|direction/;
const NO_ANGLES = /min|max|inc|res|start|step|pose|odom/;
const STARTS = /^(angle_?min|min_?angle|start_?angle|angle_?start|min_?theta|theta_?min)$/;
const STEPS =
  /^(angle_?(increment|inc|step|res(olution)?)|(increment|step)|(angular_?)?res(olution)?|delta_?(angle|theta))$/;
const TIMES = /^(t|ts|tt|tlsr|ts?_?laser)$|time|stamp/;
const SECONDS = /^(sec|secs|seconds)$/;
const NANOSECONDS = /^(nsec|nsecs|nanosec|nanoseconds)$/;
/** What a pose is, by its name. */
const POSES: readonly [PoseRole, RegExp][] = [
  ['reference', /^(gt|ref)|truth|true|reference/],
  ['odometry', /odo|wheel|encoder/],
  ['poses', /pose|state|traj|path|robot|location/],
];
/** A list of another name is a trajectory from so many poses on. */
const MIN_POSES = 20;
/** Rows of unequal lengths are filled up to the longest while the whole has at most so many times their numbers, and so many more. */
const [MOST_PADDED, FREE_PADDED] = [10, 2 ** 16];
/** Angles are even where none is further than so much of a step from its place. */
const EVEN = 0.1;

/** @returns the text; null where there are no scans and no poses */
export function tableOf(variables: Variables): Uint8Array | null {
  const groups = groupsOf(variables);
  const found = groups.flatMap((group) => {
    const ranges = findRanges(group);
    return ranges ? [{ group, ...ranges }] : [];
  });
  const [best] = found.sort((a, b) => b.rank - a.rank || b.count - a.count);
  const text = best ? scansOf(withShared(best.group, groups), best.name) : posesAlone(groups);
  return text === null ? null : new TextEncoder().encode(text);
}

/** The variables, and the fields of every struct, list of structs and cell among them. */
function groupsOf(variables: Variables): Group[] {
  const top: Group = new Map();
  const groups: Group[] = [top];
  for (const [name, value] of variables) {
    if (value.kind === 'numbers') top.set(name, value);
    const elements = value.kind === 'cell' ? value.items : value.kind === 'struct' ? elementsOf(value) : [];
    const group = value.kind === 'numbers' || value.kind === 'other' ? null : stacked(name, elements);
    if (group) groups.push(group);
  }
  return groups;
}

/** The elements of a list of structs, each a struct of its own. */
function elementsOf({ dims, fields }: Struct): Value[] {
  const count = dims.reduce((product, length) => product * length, 1);
  return Array.from({ length: count }, (_, element) => ({
    kind: 'struct',
    dims: [1, 1],
    fields: new Map([...fields].map(([name, values]) => [name, values.slice(element, element + 1)])),
  }));
}

/**
 * Arrays of one element as they are; of several, the rows of each name one below the other where they are equally long.
 * @param name of the list
 */
function stacked(name: string, elements: readonly Value[]): Group {
  const flat = elements.map((element) => flatten(name, element));
  const [first] = flat;
  if (!first || flat.length === 1) return first ?? new Map();
  const group: Group = new Map();
  for (const [field, { values }] of first) {
    const rows = flat.map((element) => element.get(field)?.values);
    const lengths = rows.map((row) => row?.length ?? 0);
    const length = lengths.reduce((most, next) => Math.max(most, next), values.length);
    const numNumbers = lengths.reduce((sum, next) => sum + next, 0);
    if (rows.length * length > MOST_PADDED * numNumbers + FREE_PADDED) continue;
    // Shorter scans are filled up to the longest: NaN is no reading.
    const all = new Float64Array(rows.length * length).fill(Number.NaN);
    for (const [at, row] of rows.entries()) row?.forEach((value, column) => (all[column * rows.length + at] = value));
    group.set(field, { kind: 'numbers', dims: [rows.length, length], values: all });
  }
  return group;
}

function flatten(name: string, value: Value): Group {
  if (value.kind === 'numbers') return new Map([[name, value]]);
  const group: Group = new Map();
  if (value.kind !== 'struct') return group;
  for (const [field, [inner]] of value.fields) {
    if (inner) for (const [path, numbers] of flatten(field, inner)) if (!group.has(path)) group.set(path, numbers);
  }
  return group;
}

/** What stands beside a struct belongs to it as well: times, poses. */
function withShared(group: Group, groups: Group[]): Group {
  return new Map([...groups.flatMap((other) => (other === group ? [] : [...other])), ...group]);
}

function findRanges(group: Group) {
  const candidates = [...group].flatMap(([name, { dims, values }]) => {
    const word = name.toLowerCase();
    const [rows = 0, columns = 0] = dims;
    if (dims.length !== 2 || Math.max(rows, columns) < MIN_BEAMS || NO_RANGES.test(word)) return [];
    const isMatrix = Math.min(rows, columns) >= MIN_ROWS;
    const rank = RANGES.test(word) ? 3 : LIKE_RANGES.test(word) ? 2 : isMatrix ? 1 : 0;
    const isAngles = ANGLES.test(word) || TIMES.test(word) || POSES.some(([, pattern]) => pattern.test(word));
    return rank === 0 || (rank === 1 && isAngles) ? [] : [{ name, rank, count: values.length }];
  });
  return candidates.sort((a, b) => b.rank - a.rank || b.count - a.count)[0] ?? null;
}

/** @param name of the ranges */
function scansOf(group: Group, name: string): string {
  const { dims: [rows = 0, columns = 0] = [], values } = group.get(name) as Numbers;
  const others = [...group].filter(([other]) => other !== name);
  const isByRow = scansAreRows(rows, columns, others);
  const ranges: Ranges = {
    rows: isByRow ? rows : columns,
    beams: isByRow ? columns : rows,
    at: (row, beam) => (isByRow ? values[beam * rows + row] : values[row * rows + beam]) ?? Number.NaN,
  };
  const times = timesOf(others, ranges.rows);
  const poses = posesOf(others, ranges.rows);
  const angles = anglesOf(others, ranges.beams);
  return angles && !angles.isEven ? asJson(ranges, angles.values, times, poses) : asTable(ranges, angles, times, poses);
}

/**
 * Whether a row of the matrix is a scan: by the angles, by the times and poses, by the number of readings, else as it is
 * mostly done.
 */
function scansAreRows(rows: number, columns: number, others: [string, Numbers][]) {
  if (rows === columns) return true;
  const has = (pattern: RegExp, length: number) =>
    others.some(([name, { dims }]) => pattern.test(name.toLowerCase()) && Math.max(...dims) === length);
  const poses = /pose|odom|state|gt|truth/;
  for (const [pattern, of] of [
    [ANGLES, 'beams'],
    [TIMES, 'scans'],
    [poses, 'scans'],
  ] as const) {
    const [byRow, byColumn] = of === 'beams' ? [columns, rows] : [rows, columns];
    if (has(pattern, byRow) !== has(pattern, byColumn)) return has(pattern, byRow);
  }
  const [isKnownRow, isKnownColumn] = [KNOWN_BEAMS.includes(columns), KNOWN_BEAMS.includes(rows)];
  return isKnownRow === isKnownColumn ? columns >= MIN_BEAMS : isKnownRow;
}

/** @param count of scans */
function timesOf(others: [string, Numbers][], count: number): ArrayLike<number> | null {
  const find = (pattern: RegExp) =>
    others.find(([name, { values }]) => pattern.test(name.toLowerCase()) && values.length === count)?.[1].values;
  const [seconds, nanoseconds] = [find(SECONDS), find(NANOSECONDS)];
  if (seconds) return seconds.map((value, at) => value + 1e-9 * (nanoseconds?.[at] ?? 0));
  return count > 1 ? (find(TIMES) ?? null) : null;
}

/** @param count of scans */
function posesOf(others: [string, Numbers][], count: number): (Poses & { role: PoseRole })[] {
  return POSES.flatMap(([role, pattern]) => {
    const found = others.find(([name, { dims, values }]) => {
      const others = POSES.filter(([other]) => other !== role && role === 'poses');
      const isOther = others.some(([, pattern]) => pattern.test(name.toLowerCase()));
      return pattern.test(name.toLowerCase()) && !isOther && values.length === 3 * count && dims.includes(3);
    });
    if (!found) return [];
    const [, { dims, values }] = found;
    const isByRow = dims[1] === 3;
    const at = (row: number, column: number) =>
      (isByRow ? values[column * count + row] : values[3 * row + column]) ?? Number.NaN;
    return [{ role, at }];
  });
}

/** Rad. */
type Angles = { isEven: boolean; start: number; step: number; values: number[] };

/** @param count of beams */
function anglesOf(others: [string, Numbers][], count: number): Angles | null {
  const listed = others.find(([name, { values }]) => {
    const word = name.toLowerCase();
    return ANGLES.test(word) && !NO_ANGLES.test(word) && values.length >= count && values.length % count === 0;
  });
  const scalar = (pattern: RegExp) => others.find(([name]) => pattern.test(name.toLowerCase()))?.[1].values[0];
  if (listed) {
    const { dims, values } = listed[1];
    // The same angles for every scan: those of the first one.
    const stride = dims[1] === count ? (dims[0] ?? 1) : 1;
    return describe(Array.from({ length: count }, (_, beam) => values[beam * stride] ?? Number.NaN));
  }
  const step = scalar(STEPS);
  if (step === undefined || step === 0 || !Number.isFinite(step)) return null;
  // Without a start, the laser looks ahead.
  const start = scalar(STARTS) ?? (-step * (count - 1)) / 2;
  return describe(Array.from({ length: count }, (_, beam) => start + step * beam));
}

/** @param given in radians or degrees */
function describe(given: number[]): Angles {
  const values = inRadians(given);
  const [start = 0] = values;
  const step = ((values.at(-1) ?? 0) - start) / Math.max(1, values.length - 1);
  const isEven =
    step !== 0 && values.every((angle, beam) => Math.abs(angle - start - step * beam) < EVEN * Math.abs(step));
  return { isEven, start, step, values };
}

function asTable(
  ranges: Ranges,
  angles: Angles | null,
  times: ArrayLike<number> | null,
  poses: (Poses & { role: PoseRole })[],
) {
  const first = (times ? 1 : 0) + 3 * poses.length + 1;
  const degrees = (angle: number) => `${Number(((angle * 180) / Math.PI).toFixed(6))}deg`;
  const format = [
    `ranges=${first}:${first + ranges.beams - 1}`,
    ...(angles ? [`start=${degrees(angles.start)}`, `step=${degrees(angles.step)}`] : []),
    ...(times ? ['time=1'] : []),
    ...poses.map(({ role }, at) => `${role}=${[0, 1, 2].map((column) => (times ? 2 : 1) + 3 * at + column).join(':')}`),
  ];
  const rows = Array.from({ length: ranges.rows }, (_, row) => {
    const beside = poses.flatMap(({ at }) => [at(row, 0), at(row, 1), at(row, 2)]);
    const readings = Array.from({ length: ranges.beams }, (_, beam) => ranges.at(row, beam));
    return `${[...(times ? [times[row] ?? Number.NaN] : []), ...beside, ...readings].join(' ')}\n`;
  });
  return `# table: ${format.join(',')}\n${rows.join('')}`;
}

function asJson(
  ranges: Ranges,
  theta: number[],
  times: ArrayLike<number> | null,
  poses: (Poses & { role: PoseRole })[],
) {
  const names = { odometry: 'odometry', poses: 'odometry', reference: 'true_pose' } as const;
  const rows = Array.from({ length: ranges.rows }, (_, row) => {
    const readings = Array.from({ length: ranges.beams }, (_, beam) => ranges.at(row, beam));
    const known = poses.map(({ role, at }) => [names[role], [at(row, 0), at(row, 1), at(row, 2)]]);
    const timestamp = times ? { timestamp: times[row] } : {};
    // JSON has no NaN: null is no reading.
    return `${JSON.stringify({ readings, theta, ...Object.fromEntries(known), ...timestamp })}\n`;
  });
  return rows.join('');
}

/** The longest list of poses, a row each: a trajectory. */
function posesAlone(groups: Group[]) {
  const lists = groups.flatMap((group) =>
    [...group].flatMap(([name, { dims, values }]) => {
      const matrices = dims.length === 3 && dims[1] === 4 && (dims[0] === 4 || dims[0] === 3) ? 4 * (dims[0] ?? 0) : 0;
      const width = matrices || [3, 2, 7, 8, 12, 4].find((width) => dims.length === 2 && dims.includes(width)) || 0;
      const isNamed = POSES.some(([, pattern]) => pattern.test(name.toLowerCase()));
      return width === 0 || (!isNamed && values.length < MIN_POSES * width)
        ? []
        : [{ dims, values, width, count: values.length / width, isMatrix: matrices > 0 }];
    }),
  );
  const [longest] = lists.sort((a, b) => b.count - a.count);
  if (!longest || longest.count < 2) return null;
  const {
    dims: [height = 1],
    dims,
    values,
    width,
    count,
    isMatrix,
  } = longest;
  const isByRow = !isMatrix && dims[1] === width;
  const at = (row: number, column: number) => {
    if (isByRow) return values[column * count + row];
    // Of a matrix, row by row.
    return values[row * width + (isMatrix ? (column % 4) * height + Math.floor(column / 4) : column)];
  };
  const line = (_: unknown, row: number) =>
    `${Array.from({ length: width }, (_, column) => at(row, column)).join(' ')}\n`;
  return Array.from({ length: count }, line).join('');
}

/**
 * Points, an array a cloud: lists of such arrays, and arrays of such names, a point a row or a column.
 * @returns a point a row
 */
export function cloudsOf(variables: Variables): { name: string; columns: 2 | 3; points: Numbers }[] {
  return [...variables].flatMap(([name, value]) => {
    const items = value.kind === 'cell' ? value.items : POINTS.test(name.toLowerCase()) ? [value] : [];
    return items.flatMap((item, at) => {
      if (item.kind !== 'numbers' || item.dims.length !== 2 || Math.max(...item.dims) < MIN_BEAMS) return [];
      const columns = Math.min(...item.dims);
      if (columns !== 2 && columns !== 3) return [];
      return [{ name: items.length > 1 ? `${name}_${at}` : name, columns, points: inRows(item) }];
    });
  });
}

function inRows({ dims: [rows = 0, columns = 0], values }: Numbers): Numbers {
  if (rows >= columns) return { kind: 'numbers', dims: [rows, columns], values };
  const turned = values.map((_, at) => values[(at % columns) * rows + Math.floor(at / columns)] ?? 0);
  return { kind: 'numbers', dims: [columns, rows], values: turned };
}

/** What a file holds, for messages. */
export function contentsOf(variables: Variables) {
  const words = [...variables].slice(0, 8).map(([name, value]) => {
    return value.kind === 'other'
      ? `${name} (${value.what})`
      : `${name} (${value.dims.join(' x ')}${value.kind === 'numbers' ? '' : ` ${value.kind}`})`;
  });
  return words.length === 0 ? 'nothing' : `${words.join(', ')}${variables.size > 8 ? ', ...' : ''}`;
}
