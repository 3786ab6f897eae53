/**
 * Tables of poses in conventions that the engine's own reader leaves to its callers, as tables that it reads, in seconds and metres:
 * roll, pitch and yaw, latitude and longitude, decimal commas, other units, dates; the messages that `ros2 topic echo --csv` writes; the
 * exports of Vicon's and OptiTrack's motion capture; NCLT's ground truth.
 */
import { DEGREE, haveDecimalCommas, LENGTH_UNIT, perMetre, ticksPerSecond } from '../base/units.js';

const TIME_UNITS: Readonly<Record<string, number>> = {
  ms: 1e3,
  msec: 1e3,
  millis: 1e3,
  us: 1e6,
  usec: 1e6,
  ns: 1e9,
  nsec: 1e9,
};
/** Angles beyond it are degrees: a turn and what unwrapping adds. */
const MAX_RADIANS = 2 * Math.PI + 0.1;
/** How far the norm of a rounded quaternion may be from 1. */
const NORM_TOLERANCE = 1e-2;
/** Lines above a table of motion capture. */
const MAX_HEAD = 12;

type Table = { names: string[]; rows: string[][] };
/** The stem of a name, and its unit: `Pos X [mm]` is `posx` in `mm`. */
type Column = { at: number; stem: string; unit: string };

/** The poses of a table as one that the engine reads; null where it reads the text as it is. */
export function posesOfTable(text: string): string | null {
  const lines = text
    .replace(/^\uFEFF/, '')
    .split(/\r\n|\r|\n/)
    .filter((line) => line.trim() !== '');
  return ofVicon(lines) ?? ofOptiTrack(lines) ?? ofEcho(lines) ?? ofNames(lines) ?? ofAngles(lines) ?? ofCommas(lines);
}

const numbersOf = (cells: readonly string[]) => cells.map((cell) => (cell.trim() === '' ? Number.NaN : Number(cell)));
const written = (head: string, rows: readonly (readonly (number | string)[])[]) =>
  rows.length === 0 ? null : `${[head, ...rows.map((row) => row.join(','))].join('\n')}\n`;
const isUnit = (quaternion: readonly number[]) => Math.abs(Math.hypot(...quaternion) - 1) < NORM_TOLERANCE;

/** x y z w of a rotation by yaw about z, then pitch about y, then roll about x. */
function quaternionOf(roll: number, pitch: number, yaw: number) {
  const [[cr, sr], [cp, sp], [cy, sy]] = [roll, pitch, yaw].map((angle) => [
    Math.cos(angle / 2),
    Math.sin(angle / 2),
  ]) as [[number, number], [number, number], [number, number]];
  return [
    sr * cp * cy - cr * sp * sy,
    cr * sp * cy + sr * cp * sy,
    cr * cp * sy - sr * sp * cy,
    cr * cp * cy + sr * sp * sy,
  ];
}

/** The positions of the first object of a Vicon export: the rate stands in the second line, the units below the names. */
function ofVicon(lines: readonly string[]): string | null {
  const at = lines.slice(0, MAX_HEAD).findIndex((line) => /^frame,sub frame,/i.test(line));
  if (at < 0) return null;
  const cells = (line = '') => line.split(',').map((cell) => cell.trim().toLowerCase());
  const [names, units] = [cells(lines[at]), cells(lines[at + 1])];
  const first = names.findIndex((name, column) => name === 'tx' && names[column + 2] === 'tz');
  const start = first < 0 ? names.indexOf('x') : first;
  const rate = lines
    .slice(0, at)
    .map(Number)
    .find((number) => number > 0);
  if (start < 0 || rate === undefined) return null;
  const divisor = perMetre(units[start] ?? '');
  const rows = lines.slice(at + 2).map((line) => numbersOf(line.split(',')));
  const known = rows.filter((row) => row.slice(start, start + 3).every(Number.isFinite) && row.length > start + 2);
  return written(
    'time,x,y,z',
    known.map((row) => [(row[0] ?? 0) / rate, ...row.slice(start, start + 3).map((value) => value / divisor)]),
  );
}

/** The first rigid body of an OptiTrack export. */
function ofOptiTrack([head = '', ...lines]: readonly string[]): string | null {
  if (!/^format version,/i.test(head)) return null;
  const at = lines.slice(0, MAX_HEAD).findIndex((line) => /^frame,time/i.test(line));
  const [axes, kinds, types] = [
    lines[at],
    lines[at - 1],
    lines.slice(0, at).find((line) => /rigid body/i.test(line)),
  ].map((line) => (line ?? '').split(',').map((cell) => cell.trim().toLowerCase()));
  const column = (kind: string, axis: string) =>
    axes?.findIndex((name, at) => name === axis && kinds?.[at] === kind && (types?.[at] ?? '') === 'rigid body') ?? -1;
  const columns = [
    ...['x', 'y', 'z'].map((axis) => column('position', axis)),
    ...['x', 'y', 'z', 'w'].map((axis) => column('rotation', axis)),
  ];
  if (columns.includes(-1)) return null;
  const unit = /length units,\s*(\w+)/i.exec(head)?.[1]?.toLowerCase() ?? '';
  const rows = lines.slice(at + 1).map((line) => numbersOf(line.split(',')));
  const poses = rows.map((row) => [row[1] ?? Number.NaN, ...columns.map((column) => row[column] ?? Number.NaN)]);
  const divisor = perMetre(unit);
  return written(
    'time,x,y,z,qx,qy,qz,qw',
    poses
      .filter((pose) => pose.every(Number.isFinite))
      .map((pose) => pose.map((value, at) => (at > 0 && at < 4 ? value / divisor : value))),
  );
}

/** Seconds, nanoseconds, one name of a frame or two, the position, the quaternion, and what follows. */
function ofEcho(lines: readonly string[]): string | null {
  const MESSAGE = /^(\d{1,10}),(\d{1,9}),([A-Za-z/_][\w/]*,){1,2}(?=[-\d])/;
  const rows = lines.map((line) => {
    const [head, seconds, nanoseconds] = MESSAGE.exec(line) ?? [];
    const pose = head === undefined ? [] : numbersOf(line.slice(head.length).split(',').slice(0, 7));
    return pose.length === 7 && isUnit(pose.slice(3)) ? [Number(seconds) + 1e-9 * Number(nanoseconds), ...pose] : null;
  });
  // The last line may be cut off.
  const whole = rows.filter((row) => row !== null);
  return whole.length < Math.max(rows.length - 1, 1) ? null : written('timestamp,x,y,z,qx,qy,qz,qw', whole);
}

/** Seven numbers a line whose last three are no part of a quaternion: t x y z roll pitch yaw, as NCLT has it. */
function ofAngles(lines: readonly string[]): string | null {
  const rows = lines.filter((line) => !line.startsWith('#')).map((line) => numbersOf(line.trim().split(/[\s,;]+/)));
  const isTimed = rows.every((row, at) => row.length === 7 && (at === 0 || (row[0] ?? 0) > (rows[at - 1]?.[0] ?? 0)));
  const areAngles = rows.every((row) => row.slice(4).every((angle) => Math.abs(angle) <= 360 || Number.isNaN(angle)));
  const known = rows.filter((row) => row.every(Number.isFinite));
  if (rows.length < 2 || known.length === 0 || !isTimed || !areAngles || known.every((row) => isUnit(row.slice(3))))
    return null;
  const [first = 0] = known[0] ?? [];
  const divisor = ticksPerSecond(first) ?? 1;
  const columns = [4, 5, 6].map((column) => known.map((row) => row[column] ?? 0));
  const turns = turnsOf(columns, '');
  return written(
    'timestamp,x,y,z,qx,qy,qz,qw',
    known.map(([time = 0, x = 0, y = 0, z = 0], row) => [
      time / divisor,
      x,
      y,
      z,
      ...turns.map((part) => part[row] ?? 0),
    ]),
  );
}

/** Rows without names whose numbers have decimal commas, with points. */
function ofCommas(lines: readonly string[]): string | null {
  const rows = lines.filter((line) => !line.startsWith('#'));
  if (!haveDecimalCommas(rows) || !rows.every((row) => /^[-+\d.,;\seE]+$/.test(row))) return null;
  return rows.map((row) => `${row.replaceAll(',', '.')}\n`).join('');
}

/** A table whose first line names the columns, one of them in a convention that the engine leaves out. */
function ofNames(lines: readonly string[]): string | null {
  const table = tableOf(lines);
  if (!table) return null;
  const columns = table.names.map((name, at) => columnOf(name, at));
  const find = (pattern: RegExp) => columns.find(({ stem }) => pattern.test(stem));
  const time = find(/^(u?time(stamp)?|(header)?stamp|t|date(time)?|zeit(stempel)?|temps)$/);
  const axes = ['x', 'y', 'z'].map((axis) => find(new RegExp(`^(p|t|pos(ition)?|trans(lation)?)?${axis}$`)));
  const quaternion = ['x', 'y', 'z', 'w'].map((axis) =>
    find(new RegExp(`^(q|r|quat(ernion)?|rot(ation)?|orientation)${axis}$`)),
  );
  const angles = ['roll', 'pitch', 'yaw'].map((name) => find(new RegExp(`^${name}(angle)?$`)));
  const globe = [/^lat(itude)?$/, /^lon(g|gitude)?$/, /^(alt(itude)?|height|ele(vation)?|h)$/].map(find);
  const numbers = (column: Column | undefined) => table.rows.map((row) => Number(row[column?.at ?? -1] || Number.NaN));
  const isGlobal = globe[0] !== undefined && globe[1] !== undefined && !axes[0];
  const heading = find(/^(yaw|heading|theta)$/);
  const isHeading = heading?.unit.startsWith('deg') && !angles[0];
  // Of a turn in the plane the other two are 0.
  const isFlat = !quaternion[0] && !quaternion[1] && quaternion[2] !== undefined && quaternion[3] !== undefined;
  const isTurned = !isFlat && quaternion.includes(undefined) && (isHeading || !angles.includes(undefined));
  const cells = (column: Column) => table.rows.map((row) => row[column.at] ?? '');
  const [seconds, nanoseconds] = [
    /^(stamp|header|time)?secs?(onds)?$/,
    /^(stamp|header|time)?n(ano)?secs?(onds)?$/,
  ].map(find);
  const times =
    seconds && nanoseconds
      ? {
          seconds: numbers(seconds).map((time, row) => time + 1e-9 * (numbers(nanoseconds)[row] ?? 0)),
          isConverted: true,
        }
      : time && timesOf(cells(time), time.unit);
  const inOtherUnit = axes.some((axis) => axis !== undefined && perMetre(axis.unit) !== 1);
  if (!(isGlobal || isTurned || isFlat || inOtherUnit || times?.isConverted || haveDecimalCommas(lines.slice(1))))
    return null;
  if (!isGlobal && (!axes[0] || !axes[1])) return null;
  const positions = isGlobal
    ? onTangentPlane(globe.map(numbers))
    : axes.map((axis) => axis && numbers(axis).map((value) => value / perMetre(axis.unit)));
  const turns = isTurned
    ? turnsOf(
        (isHeading ? [undefined, undefined, heading] : angles).map(numbers),
        (isHeading ? heading : angles[0])?.unit ?? '',
      )
    : quaternion.map((column) => (column ? numbers(column) : isFlat ? table.rows.map(() => 0) : undefined));
  const count = find(/^(frame|id|index|number)$/);
  const parts: [string, number[] | undefined][] = [
    ['frame', count && numbers(count)],
    ['timestamp', times?.seconds],
    ...['x', 'y', 'z'].map((name, at): [string, number[] | undefined] => [name, positions[at]]),
    ...['qx', 'qy', 'qz', 'qw'].map((name, at): [string, number[] | undefined] => [name, turns[at]]),
  ];
  const used = parts.flatMap(([name, values]) => (values ? [{ name, values }] : []));
  const rows = table.rows.map((_, row) => used.map(({ values }) => values[row] ?? Number.NaN));
  return written(used.map(({ name }) => name).join(','), rows);
}

function tableOf(lines: readonly string[]): Table | null {
  const [head = '', ...rows] = lines;
  const separator = [';', '\t', ','].find((mark) => head.includes(mark));
  if (separator === undefined || rows.length === 0) return null;
  const cells = (line: string) => line.split(separator).map((cell) => cell.trim().replace(/^"(.*)"$/, '$1'));
  const names = cells(head.replace(/^[#%]/, ''));
  if (names.some((name) => name !== '' && Number.isFinite(Number(name)))) return null;
  const withPoints = haveDecimalCommas(rows) ? (cell: string) => cell.replace(',', '.') : (cell: string) => cell;
  const whole = rows.filter((row) => !row.startsWith('#')).map((row) => cells(row).map(withPoints));
  // The last line may be cut off; of others the engine tells which.
  const isWhole = (row: string[]) => row.length >= names.length;
  return whole.slice(0, -1).every(isWhole) ? { names, rows: whole.filter(isWhole) } : null;
}

function columnOf(name: string, at: number): Column {
  const SUFFIX = new RegExp(`[_ ](deg(rees)?|rad(ians)?|${LENGTH_UNIT}|[mun]?s(ec)?)$`, 'i');
  // `rostopic echo -p` has all times in nanoseconds.
  const told = /^field\..*stamp$/.test(name)
    ? 'ns'
    : (/[[(]\s*([a-z°]+)\s*[\])]/i.exec(name)?.[1] ?? SUFFIX.exec(name)?.[1]);
  const bare = name
    .replace(/[[(].*$/, '')
    .trim()
    .replace(SUFFIX, '');
  // `pose.pose.position.x` is a message's field.
  const field = bare.split('.').slice(-2).join('');
  return { at, stem: field.toLowerCase().replaceAll(/[^a-z]/g, ''), unit: (told ?? '').toLowerCase() };
}

/** Times in seconds, and whether they were not so: dates, and numbers in another unit. */
function timesOf(cells: readonly string[], unit: string) {
  const numbers = numbersOf(cells);
  if (numbers.some(Number.isFinite)) {
    const first = numbers.find(Number.isFinite) ?? 0;
    const divisor = unit === 'ns' ? 1e9 : (ticksPerSecond(first) ?? TIME_UNITS[unit] ?? 1);
    return { seconds: numbers.map((number) => number / divisor), isConverted: divisor !== 1 };
  }
  return { seconds: cells.map(secondsOf), isConverted: true };
}

/** Seconds since 1970 of a date and time by ISO 8601, in UTC where no offset is told. */
function secondsOf(cell: string) {
  const [, date, clock, fraction = '', offset = 'Z'] =
    /^(\d{4}-\d\d-\d\d)[T ](\d\d:\d\d:\d\d)(\.\d+)?\s*(Z|[+-]\d\d:?\d\d)?$/i.exec(cell.trim()) ?? [];
  return date === undefined ? Number.NaN : Date.parse(`${date}T${clock}${offset}`) / 1000 + Number(`0${fraction}`);
}

/** Quaternions x y z w, by component. */
function turnsOf(angles: readonly (readonly number[])[], unit: string) {
  const largest = angles.flat().reduce((most, angle) => (Math.abs(angle) > most ? Math.abs(angle) : most), 0);
  const scale = unit.startsWith('deg') || unit === '°' || (unit !== 'rad' && largest > MAX_RADIANS) ? DEGREE : 1;
  const [roll = [], pitch = [], yaw = []] = angles;
  const all = yaw.map((_, at) =>
    quaternionOf(scale * (roll[at] || 0), scale * (pitch[at] || 0), scale * (yaw[at] ?? 0)),
  );
  return [0, 1, 2, 3].map((part) => all.map((quaternion) => quaternion[part] ?? 0));
}

/** Of WGS 84: half of the longer axis (m), and the square of the eccentricity. */
const [SEMI_MAJOR, ECCENTRICITY_2] = [6378137, 6.69437999014e-3];

/** East, north and up (m) of the first place, by coordinate: geographic coordinates in degrees by way of geocentric ones. */
function onTangentPlane([latitudes = [], longitudes = [], heights = []]: readonly (readonly number[])[]) {
  const geocentric = latitudes.map((degrees, at) => {
    const [latitude, longitude, height] = [DEGREE * degrees, DEGREE * (longitudes[at] ?? 0), heights[at] || 0];
    const normal = SEMI_MAJOR / Math.sqrt(1 - ECCENTRICITY_2 * Math.sin(latitude) ** 2);
    const across = (normal + height) * Math.cos(latitude);
    return [
      across * Math.cos(longitude),
      across * Math.sin(longitude),
      (normal * (1 - ECCENTRICITY_2) + height) * Math.sin(latitude),
    ];
  });
  const first = geocentric.findIndex((point) => point.every(Number.isFinite));
  const [phi, lambda] = [DEGREE * (latitudes[first] ?? 0), DEGREE * (longitudes[first] ?? 0)];
  const origin = geocentric[first] ?? [0, 0, 0];
  const axes = [
    [-Math.sin(lambda), Math.cos(lambda), 0],
    [-Math.sin(phi) * Math.cos(lambda), -Math.sin(phi) * Math.sin(lambda), Math.cos(phi)],
    [Math.cos(phi) * Math.cos(lambda), Math.cos(phi) * Math.sin(lambda), Math.sin(phi)],
  ];
  const along = (axis: readonly number[], point: readonly number[]) =>
    axis.reduce((sum, part, at) => sum + part * ((point[at] ?? 0) - (origin[at] ?? 0)), 0);
  return axes.map((axis) => geocentric.map((point) => along(axis, point)));
}
