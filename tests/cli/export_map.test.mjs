// @ts-check
/** `scanstitch export`: masks as nav2's map_server reads them, walls as DXF and SVG, a world file; files of areas that are wrong. */
import assert from 'node:assert/strict';
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { wallFile } from '../../npm/report/wall_mesh.js';
import { scanstitch, temporaryFolder, writeFiles } from './support.mjs';

/** From the top: `#` is a wall, `.` free, `?` unknown. A room with a pillar, and two walls that touch in a corner. */
const ROWS = [
  '##########??',
  '#........#??',
  '#..##....#??',
  '#..##....#??',
  '#........#??',
  '###########?',
  '???????????#',
];
const [SIDE, ORIGIN, YAW] = [0.5, [-2, 3], 0.3];
/** @type {Record<string, number>} */
const GREYS = { '#': 0, '.': 254, '?': 205 };
const YAML = `image: room.pgm
resolution: ${SIDE}
origin: [${ORIGIN.join(', ')}, ${YAW}]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
`;

function room() {
  const greys = ROWS.flatMap((row) => [...row].map((cell) => GREYS[cell] ?? NaN));
  return Buffer.concat([Buffer.from(`P5\n12 7\n255\n`), Buffer.from(greys)]);
}

/** The world's point at columns and rows from the lower left corner, by the origin's definition in map_server. */
function world(/** @type {number} */ column, /** @type {number} */ row) {
  const [along, up] = [SIDE * column, SIDE * row];
  return [
    (ORIGIN[0] ?? 0) + along * Math.cos(YAW) - up * Math.sin(YAW),
    (ORIGIN[1] ?? 0) + along * Math.sin(YAW) + up * Math.cos(YAW),
  ];
}

/** What nav2's map_server publishes for a map: per cent from the lowest row up, -1 unknown (nav2_map_server/src/map_io.cpp). */
function served(/** @type {string} */ folder, /** @type {string} */ name) {
  const text = readFileSync(join(folder, name), 'utf8');
  const yaml = Object.fromEntries(text.split('\n').map((line) => line.split(': ')));
  const picture = readFileSync(join(folder, yaml.image));
  const header = /^P5\n(\d+) (\d+)\n255\n/.exec(picture.toString('latin1'));
  assert.ok(header);
  const [width, height] = [Number(header[1]), Number(header[2])];
  const [occupied, free] = [Number(yaml.occupied_thresh), Number(yaml.free_thresh)];
  const cell = (/** @type {number} */ grey) => {
    const occupancy = (255 - grey) / 255;
    if (occupied < occupancy) return 100;
    if (occupancy < free) return 0;
    return yaml.mode === 'scale' ? Math.round((100 * (occupancy - free)) / (occupied - free)) : -1;
  };
  const rows = Array.from({ length: height }, (_, row) =>
    Array.from(picture.subarray(header[0].length + row * width).subarray(0, width), cell),
  );
  const origin = JSON.parse(yaml.origin).map((/** @type {number} */ value) => Number(value.toFixed(9)));
  assert.deepEqual(origin, [...ORIGIN, YAW]);
  assert.deepEqual([Number(yaml.resolution), yaml.negate], [SIDE, '0']);
  return rows.reverse();
}

/** The values of each tag of a TIFF file, by the specification: type 2 ASCII, 3 SHORT, 4 LONG, 12 DOUBLE. */
function tiffTags(/** @type {Buffer} */ file) {
  assert.equal(file.toString('latin1', 0, 4), 'II*\0');
  const directory = file.readUInt32LE(4);
  const entries = Array.from({ length: file.readUInt16LE(directory) }, (_, i) => directory + 2 + 12 * i);
  const read = (/** @type {number} */ entry) => {
    const [tag, type, count] = [file.readUInt16LE(entry), file.readUInt16LE(entry + 2), file.readUInt32LE(entry + 4)];
    const size = { 2: 1, 3: 2, 4: 4, 12: 8 }[type] ?? NaN;
    const at = size * count > 4 ? file.readUInt32LE(entry + 8) : entry + 8;
    assert.equal(at % 2, 0, 'values begin at even bytes');
    const value = (/** @type {number} */ offset) =>
      size === 8 ? file.readDoubleLE(offset) : file.readUIntLE(offset, size);
    return /** @type {const} */ ([tag, Array.from({ length: count }, (_, i) => value(at + size * i))]);
  };
  const tags = entries.map(read);
  assert.deepEqual(
    tags,
    tags.toSorted(([a], [b]) => a - b),
  );
  return new Map(tags);
}

/** Closed polylines of a DXF file by its pairs of codes and values. */
function polylines(/** @type {string} */ text) {
  const lines = text.trimEnd().split('\n');
  assert.equal(lines.length % 2, 0);
  const pairs = Array.from({ length: lines.length / 2 }, (_, i) => [Number(lines[2 * i]), lines[2 * i + 1]]);
  assert.deepEqual(pairs.at(-1), [0, 'EOF']);
  /** @type {number[][][]} */
  const found = [];
  let entity;
  for (const [code, value] of pairs) {
    if (code === 0) entity = value;
    if (code === 0 && value === 'POLYLINE') found.push([]);
    if (code === 70 && entity === 'POLYLINE') assert.equal(value, '1', 'it is closed');
    if (code === 10 && entity === 'VERTEX') found.at(-1)?.push([Number(value)]);
    if (code === 20 && entity === 'VERTEX') found.at(-1)?.at(-1)?.push(Number(value));
  }
  return found;
}

/** The area that a line runs round to the left (m^2). */
function area(/** @type {number[][]} */ line) {
  const sides = line.map(([x = 0, y = 0], index) => {
    const [to_x = 0, to_y = 0] = line[(index + 1) % line.length] ?? [];
    return x * to_y - y * to_x;
  });
  return sides.reduce((sum, side) => sum + side, 0) / 2;
}

const rectangle = (/** @type {number[]} */ ...[left = 0, low = 0, right = 0, high = 0]) =>
  [
    [left, low],
    [right, low],
    [right, high],
    [left, high],
  ].map(([column = 0, row = 0]) => world(column, row));

test('masks have the values of nav2, walls and picture lie where the map has them', async (t) => {
  const folder = temporaryFolder(t);
  const areas = [
    { kind: 'keepout', polygon: rectangle(1, 2, 3.6, 4.4) },
    { kind: 'speed', percent: 40, polygon: rectangle(5, 2, 9, 4) },
    { kind: 'speed', percent: 1, polygon: rectangle(7, 3, 20, 20) },
    { kind: 'speed', percent: 7, polygon: rectangle(4.1, 4.1, 4.2, 4.2) },
  ];
  const [map = '', , file = ''] = writeFiles(folder, {
    'room.yaml': YAML,
    'room.pgm': room(),
    'areas.json': JSON.stringify({ scanstitch_areas: 1, areas }),
  });
  const out = join(folder, 'out');
  const { status, stderr } = await scanstitch(['export', map, file, '--out', out]);
  assert.deepEqual([status, /Area (\d) holds no cell/.exec(stderr)?.[1]], [2, '4'], stderr);

  const keepout = served(out, 'keepout_mask.yaml');
  const speed = served(out, 'speed_mask.yaml');
  for (let row = 0; row < 7; row++) {
    for (let column = 0; column < 12; column++) {
      const isOut = column >= 1 && column < 4 && row >= 2 && row < 4;
      const isSlow = column >= 5 && column < 9 && row >= 2 && row < 4;
      const limit = column >= 7 && row >= 3 ? 99 : isSlow ? 60 : 0;
      assert.deepEqual([keepout[row]?.[column], speed[row]?.[column]], [isOut ? 100 : 0, limit], `${column}, ${row}`);
    }
  }
  /** @type {Record<string, number>} */
  const values = { '#': 100, '.': 0, '?': -1 };
  const expected = ROWS.toReversed().map((row) => [...row].map((c) => values[c]));
  assert.deepEqual(served(out, 'map.yaml'), expected);

  const [alongX = 0, alongY = 0, downX = 0, downY = 0, x = 0, y = 0] = readFileSync(join(out, 'map.pgw'), 'utf8')
    .split('\n')
    .map(Number);
  const [ends_x = 0, ends_y = 0] = world(10.5, 1.5);
  assert.ok(Math.hypot(x + 10 * alongX + 5 * downX - ends_x, y + 10 * alongY + 5 * downY - ends_y) < 1e-6);
  assert.equal(readFileSync(join(out, 'map.png')).readUInt32BE(16), 12);

  const tiff = readFileSync(join(out, 'map.tif'));
  const tags = tiffTags(tiff);
  const [width, height, [strip = 0] = [], transformation = []] = [256, 257, 273, 34264].map((tag) => tags.get(tag));
  assert.deepEqual([width, height, tags.get(258), tags.get(279)], [[12], [7], [8], [84]]);
  const expectedGreys = ROWS.flatMap((row) => [...row].map((cell) => GREYS[cell]));
  assert.deepEqual([...tiff.subarray(strip, strip + 84)], expectedGreys);
  // From columns and rows of the picture, counted from its upper left corner.
  const [xx = 0, xy = 0, , x0 = 0, yx = 0, yy = 0, , y0 = 0] = transformation;
  const placed = [xx * 10.5 + xy * 5.5 + x0, yx * 10.5 + yy * 5.5 + y0].map((value) => value.toFixed(9));
  assert.deepEqual(
    placed,
    world(10.5, 1.5).map((value) => value.toFixed(9)),
  );
  assert.equal(String.fromCharCode(...(tags.get(42113) ?? [])), '205\0');

  // Outside, the room inside, the pillar: their areas are those of the cells.
  const walls = polylines(readFileSync(join(out, 'walls.dxf'), 'utf8'));
  const cells = walls.map((line) => Math.round((100 * area(line)) / SIDE ** 2) / 100).sort((a, b) => a - b);
  assert.equal(cells.length, 3);
  assert.deepEqual(cells.slice(0, 2), [-32, 4]);
  const corners = [world(3, 3), world(5, 3), world(5, 5), world(3, 5)].map((point) => point.map((v) => v.toFixed(4)));
  const pillar = walls.find((line) => area(line) > 0 && area(line) < 2)?.map((point) => point.map((v) => v.toFixed(4)));
  assert.deepEqual(pillar?.toSorted(), corners.toSorted());
  const drawn = readFileSync(join(out, 'walls.svg'), 'utf8').match(/[ML](\S+) (\S+?)(?=[LZ])/g)?.length;
  assert.equal(drawn, walls.flat().length);
});

/** Corners of the triangles of an STL file (m), after their normals have been looked at. */
function triangles(/** @type {Buffer} */ stl) {
  const count = stl.readUInt32LE(80);
  assert.equal(stl.length, 84 + 50 * count);
  return Array.from({ length: count }, (_, i) => {
    const [normal = [], a = [], b = [], c = []] = [0, 1, 2, 3].map((vector) =>
      [0, 4, 8].map((axis) => stl.readFloatLE(84 + 50 * i + 12 * vector + axis)),
    );
    const corners = [a, b, c].map((corner) => corner.map((value) => value / 1000));
    const [turned, length] = [cross(...edges(corners)), Math.hypot(...cross(...edges(corners)))];
    assert.ok(Math.hypot(...turned.map((value, axis) => value / length - (normal[axis] ?? 0))) < 1e-5);
    return corners;
  });
}

const edges = (/** @type {number[][]} */ [a = [], b = [], c = []]) =>
  /** @type {const} */ ([
    b.map((value, axis) => value - (a[axis] ?? 0)),
    c.map((value, axis) => value - (a[axis] ?? 0)),
  ]);

/** @param {number[]} a @param {number[]} b */
function cross([ax = 0, ay = 0, az = 0], [bx = 0, by = 0, bz = 0]) {
  return [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
}

/** The volume that triangles enclose: of the pyramids over them from the origin. */
function volume(/** @type {number[][][]} */ faces) {
  const of = (/** @type {number[][]} */ [a = [], b = [], c = []]) =>
    cross(b, c).reduce((sum, value, axis) => sum + value * (a[axis] ?? 0), 0) / 6;
  return faces.reduce((sum, face) => sum + of(face), 0);
}

test('walls in space are closed, as high as they are asked for, and face outwards', async (t) => {
  const folder = temporaryFolder(t);
  const [map = ''] = writeFiles(folder, { 'room.yaml': YAML, 'room.pgm': room() });
  const out = join(folder, 'out');
  const { status, stderr } = await scanstitch(['export', map, '--height', '1.5', '--out', out]);
  assert.equal(status, 0, stderr);
  const faces = triangles(readFileSync(join(out, 'walls.stl')));
  const levels = new Set(faces.flat().map(([, , z]) => z));
  assert.deepEqual([...levels].sort(), [0, 1.5]);
  // No side is open: the areas of the faces, with their directions, add up to nothing.
  const sum = faces.map((face) => cross(...edges(face))).reduce((all, one) => all.map((v, i) => v + (one[i] ?? 0)));
  assert.ok(Math.hypot(...sum) < 1e-4, `${sum}`);
  const footprint = polylines(readFileSync(join(out, 'walls.dxf'), 'utf8')).reduce((all, line) => all + area(line), 0);
  assert.ok(Math.abs(volume(faces) - 1.5 * footprint) < 1e-3, `${volume(faces)} of ${1.5 * footprint} m^3`);

  const glb = readFileSync(join(out, 'walls.glb'));
  const { accessors, meshes } = JSON.parse(glb.toString('utf8', 20, 20 + glb.readUInt32LE(12)));
  const { min, max } = accessors[meshes[0].primitives[0].attributes.POSITION];
  const inSpace = faces.flat();
  for (const axis of [0, 1, 2]) {
    const values = inSpace.map((corner) => corner[axis] ?? NaN);
    assert.ok(Math.abs(Math.min(...values) - min[axis]) < 1e-5 && Math.abs(Math.max(...values) - max[axis]) < 1e-5);
  }

  const [bare = ''] = writeFiles(folder, {
    'bare.yaml': YAML.replace('room', 'bare'),
    'bare.pgm': Buffer.concat([Buffer.from('P5\n12 7\n255\n'), Buffer.alloc(84, 254)]),
  });
  const none = await scanstitch(['export', bare, '--out', join(folder, 'none')]);
  assert.deepEqual([none.status, existsSync(join(folder, 'none', 'walls.glb'))], [2, false]);
  assert.match(none.stderr, /bare\.yaml: The map shows no wall, so walls\.glb and walls\.stl were not written\./);

  const flat = await scanstitch(['export', map, '--height', '0', '--out', out]);
  assert.deepEqual([flat.status, /--height 0: give a number of metres from 0\.01 to 100/.test(flat.stderr)], [1, true]);
});

test('lines that would meet are left as the steps of cells', async () => {
  // Two slanted walls beside each other: as lines of a drawing they overlap, or fall together to nothing.
  for (const [step, thick, gap, cells] of /** @type {const} */ ([
    [3, 3, 1, 72],
    [2, 1, 1, 24],
  ])) {
    const isWall = (/** @type {number} */ at) => (at >= 0 && at < thick) || (at >= thick + gap && at < 2 * thick + gap);
    const greys = Array.from({ length: 480 }, (_, at) => (isWall((at % 40) - step * Math.floor(at / 40)) ? 0 : 254));
    const grid = { width: 40, height: 12, resolution: 1, origin: new Float64Array(3), yaw: 0 };
    const stl = await wallFile({ ...grid, grey_values: () => Uint8Array.from(greys) }, 1, 'stl');
    assert.ok(Math.abs(volume(triangles(Buffer.from(stl))) - cells) < 1e-6);
  }
});

test('wrong files of areas are told with their place', async (t) => {
  const folder = temporaryFolder(t);
  const [map = ''] = writeFiles(folder, { 'room.yaml': YAML, 'room.pgm': room() });
  const polygon = rectangle(1, 1, 2, 2);
  const of = (/** @type {unknown[]} */ ...areas) => JSON.stringify({ scanstitch_areas: 1, areas });
  for (const [contents, message] of /** @type {const} */ ([
    ['{', /a\.json: This is no JSON, and so no file of areas\./],
    ['{}', /a\.json: This is no file of areas: it has no "scanstitch_areas"\./],
    ['{"scanstitch_areas": 2}', /a\.json: These areas are of version 2; this program reads 1\./],
    [of({ kind: 'keepout', polygon, name: 'x' }), /Area 1 has "name", which no area has\./],
    [
      of({ kind: 'keepout', polygon: [[1, 2]] }),
      /Area 1: "polygon" is a list of three points or more, not \[\[1,2\]\]\./,
    ],
    [of({ kind: 'keepout', polygon: [...polygon, [1, '2']] }), /Area 1: a point of "polygon" is \[x, y\] in metres/],
    [of({ kind: 'keepout', percent: 3, polygon }), /"kind" is keepout, without "percent", or speed/],
    [of({ kind: 'speed', percent: 0, polygon }), /"percent" of the speed is a whole number from 1 to 99, not 0\./],
  ])) {
    const [areas = ''] = writeFiles(folder, { 'a.json': contents });
    const { status, stderr } = await scanstitch(['export', map, areas, '--out', join(folder, 'out')]);
    assert.equal(status, 1, stderr);
    assert.match(stderr, message);
  }
});
