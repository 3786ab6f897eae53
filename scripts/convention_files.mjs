// @ts-check
/** The files of one recording by conventions that are drawn: for convention_trials.mjs. */
import { greyPng } from '../tests/cli/depth_room.mjs';

/** Where a frame is, as seen from the first one (m, rad), and in which piece of the map. @typedef {{ isGood: boolean, place: number[], heading: number, piece?: number }} Motion */
/** @typedef {import('./convention_trials.mjs').Trial} Trial */
/** @typedef {(next: (() => number) | null, truth: Motion[]) => Trial} Make */

/** One of these, by the next random number; the first without one. @template T @param {(() => number) | null} next @param {readonly T[]} all @returns {T} */
function draw(next, all) {
  return /** @type {T} */ (all[next ? Math.floor(next() * all.length) : 0]);
}

/** @param {Record<string, unknown>} chosen */
function words(chosen) {
  return Object.entries(chosen)
    .map(([name, value]) => `${name} ${value}`)
    .join(', ');
}

/** @param {readonly Motion[]} truth @param {(place: number[]) => number[]} as @param {number} [sense] of headings */
function moved(truth, as, sense = 1) {
  return truth.map(({ place, heading, ...motion }) => ({ ...motion, place: as(place), heading: sense * heading }));
}

/** The same path, begun at its end. @param {readonly Motion[]} truth */
function backwards(truth) {
  const { place: [x0 = 0, y0 = 0] = [], heading = 0 } = truth.at(-1) ?? {};
  const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
  const seen = (/** @type {Motion} */ { place: [x = 0, y = 0], ...motion }) => {
    const place = [cos * (x - x0) + sin * (y - y0), cos * (y - y0) - sin * (x - x0), 0];
    return { ...motion, place, heading: motion.heading - heading };
  };
  return truth.map(seen).reverse();
}

/** Units, of which a metre has so many, and the decimals that they are written with. */
const UNITS = /** @type {const} */ ({
  m: [1, 4],
  cm: [100, 1],
  mm: [1000, 0],
  'mm with fractions': [1000, 2],
  'tenths of mm': [10_000, 0],
});

/**
 * Planar scans.
 * @param {{ bearings: number[], ranges: number[] }[]} scans
 * @returns {Make}
 */
export function planarFiles(scans) {
  return (next, truth) => {
    const unit = draw(next, /** @type {(keyof typeof UNITS)[]} */ (Object.keys(UNITS)));
    const none = draw(next, ['inf', '0', '-1', 'nan', 'largest']);
    const layout = draw(next, ['readings', 'rows', 'points', 'carmen', 'csm']);
    const angles = draw(next, ['degrees', 'radians']);
    const sense = draw(next, ['counter-clockwise', 'clockwise']);
    const mount = draw(next, ['ahead', 'ahead', 'behind']);
    const order = draw(next, ['as recorded', 'backwards']);
    const [scale, decimals] = UNITS[unit];
    const turn = mount === 'behind' ? Math.PI : 0;
    const sign = sense === 'clockwise' ? -1 : 1;
    const number = (/** @type {number} */ range) => {
      if (Number.isFinite(range)) return (scale * range).toFixed(decimals);
      return none === 'largest' ? (scale * 65.535).toFixed(decimals) : none;
    };
    const ordered = order === 'backwards' ? scans.toReversed() : scans;
    const all = ordered.map(({ bearings, ranges }) => ({
      // As the file counts them.
      bearings: bearings.map((bearing) => sign * (bearing + turn)),
      ranges,
    }));
    const written = (/** @type {number} */ bearing) =>
      angles === 'degrees' ? ((bearing * 180) / Math.PI).toFixed(2) : bearing.toFixed(5);
    /** @type {Record<string, () => Record<string, string>>} */
    const layouts = {
      readings: () => ({
        'scan.csv': `scan,angle,range\n${all.flatMap(({ bearings, ranges }, scan) => bearings.map((b, at) => `${scan},${written(b)},${number(ranges[at] ?? 0)}\n`)).join('')}`,
      }),
      rows: () => ({
        'scan.txt': all
          .map(({ ranges }) => `${(sign < 0 ? ranges.toReversed() : ranges).map(number).join(' ')}\n`)
          .join(''),
      }),
      points: () =>
        Object.fromEntries(
          all.map(({ bearings, ranges }, scan) => {
            const there = bearings.flatMap((b, at) => (Number.isFinite(ranges[at]) ? [[b, ranges[at] ?? 0]] : []));
            const lines = there.map(
              ([b = 0, r = 0]) =>
                `${(scale * r * Math.cos(b)).toFixed(decimals)},${(scale * r * Math.sin(b)).toFixed(decimals)}\n`,
            );
            return [`scan_${scan + 1}.csv`, `x,y\n${lines.join('')}`];
          }),
        ),
      carmen: () => ({
        'robot.log': all
          .map(
            ({ ranges }, scan) =>
              `FLASER ${ranges.length} ${ranges.map(number).join(' ')} 0 0 0 0 0 0 ${scan} robot ${scan}\n`,
          )
          .join(''),
      }),
      csm: () => ({
        'log.json': all
          .map(({ bearings, ranges }, scan) => {
            const readings = ranges.map((r) => (Number.isFinite(r) ? Number(number(r)) : null));
            const theta = bearings.map((b) => Number(written(b)));
            return `${JSON.stringify({ nrays: ranges.length, min_theta: theta[0], max_theta: theta.at(-1), theta, readings, timestamp: [scan, 0] })}\n`;
          })
          .join(''),
      }),
    };
    const isFan = layout !== 'rows' && layout !== 'carmen';
    const isBehind = isFan && mount === 'behind';
    // Without angles, the readings of a file say nothing of how the laser is mounted; points, and angles as the format has them, say
    // where a reading is.
    const isByFormat = layout === 'points' || (layout === 'csm' && unit === 'm' && angles === 'radians');
    const isMirrored = sense === 'clockwise' && isByFormat;
    const ends = order === 'backwards' ? backwards(truth) : truth;
    // Rows without angles look ahead.
    const [first] = scans;
    const middle = isFan || !next ? 0 : ((first?.bearings[0] ?? 0) + (first?.bearings.at(-1) ?? 0)) / 2;
    const [cos, sin] = [Math.cos(middle), Math.sin(middle)];
    const side = isMirrored ? -1 : 1;
    const as = (/** @type {number[]} */ [x0 = 0, y0 = 0]) => {
      const [x, y] = [cos * x0 + sin * y0, cos * y0 - sin * x0];
      return isBehind ? [-x, -side * y, 0] : [x, side * y, 0];
    };
    const expected = moved(ends, as, side);
    const changes = words({ unit, none, layout, angles, sense, mount, order });
    return { files: layouts[layout]?.() ?? {}, expected, offset: [0, 0, 0], changes };
  };
}

/**
 * Clouds in space.
 * @param {number[][][]} clouds
 * @returns {Make}
 */
export function cloudFiles(clouds) {
  return (next, truth) => {
    const unit = draw(next, /** @type {(keyof typeof UNITS)[]} */ (Object.keys(UNITS)));
    const [scale, decimals] = UNITS[unit];
    const offset = draw(next, [
      [0, 0, 0],
      [0, 0, 0],
      [20, 0, 0],
      [-1000, 300, 5],
      [539_720, 4_065_742, 100],
    ]);
    const axes = draw(next, ['z up', 'y up', 'left-handed']);
    // Whole metres would leave nothing.
    const whole = unit === 'm' || unit === 'cm' ? 'ply' : 'ply of whole numbers';
    const format = draw(next, ['ply', whole, 'csv', 'csv with semicolons', 'pcd', 'bin']);
    const order = draw(next, ['as recorded', 'shuffled points']);
    const names = draw(next, ['counted', 'counted without zeros', 'times']);
    const turned = (/** @type {number[]} */ [x = 0, y = 0, z = 0]) =>
      axes === 'y up' ? [x, z, -y] : axes === 'left-handed' ? [x, -y, z] : [x, y, z];
    const all = clouds.map((points) => {
      const list = points.map((point) => turned(point).map((value, axis) => scale * (value + (offset[axis] ?? 0))));
      return order === 'shuffled points' && next
        ? list
            .map((point) => [next(), point])
            .sort(([a], [b]) => Number(a) - Number(b))
            .map(([, point]) => /** @type {number[]} */ (point))
        : list;
    });
    const name = (/** @type {number} */ at) =>
      names === 'counted'
        ? `cloud_00${at}`
        : names === 'times'
          ? `${(1_600_000_000 + 0.1 * at).toFixed(1)}`
          : `cloud${8 + at}`;
    const ending = format.startsWith('csv') ? 'csv' : format.startsWith('ply') ? 'ply' : format;
    const files = Object.fromEntries(
      all.map((points, at) => [`${name(at)}.${ending}`, cloudFile(points, format, decimals)]),
    );
    const expected = moved(truth, turned);
    return { files, expected, offset, changes: words({ unit, offset, axes, format, order, names }) };
  };
}

/** @param {number[][]} points @param {string} format @param {number} decimals */
function cloudFile(points, format, decimals) {
  const count = points.length;
  if (format === 'csv')
    return `x,y,z\n${points.map((p) => `${p.map((v) => v.toFixed(decimals)).join(',')}\n`).join('')}`;
  if (format === 'csv with semicolons')
    return `x;y;z\n${points.map((p) => `${p.map((v) => v.toFixed(decimals).replace('.', ',')).join(';')}\n`).join('')}`;
  if (format === 'bin') return floats(points, 4);
  if (format === 'pcd') {
    const head = `# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH ${count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS ${count}\nDATA binary\n`;
    return joined(head, new Uint8Array(Float64Array.from(points.flat()).buffer));
  }
  const type = format === 'ply' ? 'double' : 'int';
  const head = `ply\nformat binary_little_endian 1.0\nelement vertex ${count}\n${['x', 'y', 'z'].map((axis) => `property ${type} ${axis}\n`).join('')}end_header\n`;
  const values = points.flat();
  return joined(
    head,
    new Uint8Array((type === 'int' ? Int32Array.from(values, Math.round) : Float64Array.from(values)).buffer),
  );
}

/** @param {number[][]} points @param {number} columns */
function floats(points, columns) {
  const values = new Float32Array(columns * points.length);
  points.forEach((point, at) => values.set(point, columns * at));
  return new Uint8Array(values.buffer);
}

/** @param {string} head @param {Uint8Array} body */
function joined(head, body) {
  return new Uint8Array(Buffer.concat([Buffer.from(head), body]));
}

/** Of 65,535: no depth, as some cameras write it. */
const NONE = 65_535;

/**
 * Depth images.
 * @param {{ images: { width: number, height: number, depth: Float64Array }[], camera: number[] }} recording in millimetres, 0 is none
 * @returns {Make}
 */
export function depthFiles({ images, camera }) {
  return (next, truth) => {
    const perMetre = draw(next, [1000, 1000, 5000, 6553.5, 10_000, 4000, 256, 100]);
    const flip = draw(next, ['no', 'no', 'left to right', 'upside down']);
    const none = draw(next, ['0', '65535']);
    const bytes = draw(next, ['high byte first', 'high byte first', 'low byte first']);
    const stored = draw(next, ['depth', 'depth', 'inverted', '8 bits', '8 bits inverted', 'disparity']);
    const known = draw(next, ['camera file', 'none']);
    const names = draw(next, ['counted', 'counted without zeros']);
    const [fx = 0, fy = 0, cx = 0, cy = 0] = camera;
    const files = Object.fromEntries(
      images.map(({ width, height, depth }, at) => {
        const value = (/** @type {number} */ mm) => valueOf(mm, { perMetre, none, bytes, stored, focal: fx });
        const pixel = (/** @type {number} */ index) => {
          const [row, column] = [Math.floor(index / width), index % width];
          return flip === 'left to right'
            ? row * width + width - 1 - column
            : flip === 'upside down'
              ? (height - 1 - row) * width + column
              : index;
        };
        const values = Uint16Array.from(depth, (_, index) => value(depth[pixel(index)] ?? 0));
        const name = `depth/${names === 'counted' ? `00${at}` : 8 + at}.png`;
        return [name, greyPng(values, width, stored.startsWith('8 bits') ? 8 : 16)];
      }),
    );
    const { width = 0, height = 0 } = images[0] ?? {};
    const [u, v] = [flip === 'left to right' ? width - 1 - cx : cx, flip === 'upside down' ? height - 1 - cy : cy];
    /** @type {Record<string, string>} */
    const told = known === 'camera file' ? { 'camera.txt': `${fx} 0 ${u}\n0 ${fy} ${v}\n0 0 1\n` } : {};
    const expected = moved(truth, ([x = 0, y = 0, z = 0]) => [
      flip === 'left to right' ? -x : x,
      flip === 'upside down' ? -y : y,
      z,
    ]);
    return {
      files: { ...files, ...told },
      expected,
      offset: [0, 0, 0],
      changes: words({ perMetre, flip, none, bytes, stored, known, names }),
    };
  };
}

/** @param {number} mm @param {{ perMetre: number, none: string, bytes: string, stored: string, focal: number }} how */
function valueOf(mm, { perMetre, none, bytes, stored, focal }) {
  if (stored.startsWith('8 bits')) {
    const grey = mm === 0 ? 0 : Math.min(255, Math.floor((mm / 10_000) * 255));
    return stored === '8 bits' ? grey : 255 - grey;
  }
  const most = NONE - 1;
  let value = Math.min(most, Math.round((mm * perMetre) / 1000));
  if (stored === 'inverted') value = most - Math.min(most, Math.round(mm * 6.5));
  if (stored === 'disparity') value = mm === 0 ? 0 : Math.min(most, Math.round((256 * focal * 0.1 * 1000) / mm));
  if (mm === 0) value = none === '0' ? 0 : NONE;
  return bytes === 'high byte first' ? value : ((value & 255) << 8) | (value >> 8);
}
