// @ts-check
/**
 * A map, its masks and a graph as they are exported, for programs of others to read: `node tests/cli/exported_files.mjs FOLDER` writes
 * them, export_readings.py says what those programs read, and export_readings.test.mjs compares.
 */
import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { mapMcap } from '../../npm/report/map_mcap.js';
import { scanstitch, writeFiles } from './support.mjs';

/** From the top: `#` is a wall, `.` free, `?` unknown. */
export const ROWS = ['######?', '#....#?', '#.##.#?', '#....#?', '######?'];
/** Side of a cell (m), the lower left corner (m) and the turn (rad) of the map. */
export const [SIDE, ORIGIN, YAW] = [0.5, [-2, 3], 0.3];
/** @type {Record<string, number>} */
const GREYS = { '#': 0, '.': 254, '?': 205 };

/** The world's point at columns and rows from the lower left corner. @param {number} column @param {number} row */
export function world(column, row) {
  const [along, up] = [SIDE * column, SIDE * row];
  return [
    (ORIGIN[0] ?? 0) + along * Math.cos(YAW) - up * Math.sin(YAW),
    (ORIGIN[1] ?? 0) + along * Math.sin(YAW) + up * Math.cos(YAW),
  ];
}

const polygon = [world(1, 1), world(3, 1), world(3, 2), world(1, 2)];
const AREAS = [
  { kind: 'keepout', polygon },
  { kind: 'speed', percent: 40, polygon },
];

/** @type {import('../../npm/report/map_mcap.js').PlanarMap['grid']} */
export const SMALL_GRID = {
  width: 3,
  height: 2,
  resolution: 0.5,
  origin: [-1, 1.5],
  grey_values: Uint8Array.of(0, 254, 205, 254, 254, 0),
};

/** Two scans, of which the first looks along y. */
const MCAP = {
  trajectory: `# timestamp tx ty tz qx qy qz qw\n1700000000.5 1 2 0 0 0 ${Math.SQRT1_2} ${Math.SQRT1_2}\n1700000002.5 3 2 0 0 0 0 1\n`,
  points: Float32Array.of(1, 3, 0, 2, 4, 2.5),
  sizes: [2, 1],
  grid: SMALL_GRID,
};

/** A square whose last side is 0.2 m too long. */
const SQUARE = [0, 1, 2, 3]
  .map((from) => `EDGE_SE2 ${from} ${(from + 1) % 4} ${from === 3 ? 1.2 : 1} 0 1.5707963267948966 100 0 0 100 0 400\n`)
  .join('');

/** Writes the exports; chi squared of the graph at its optimum. @param {string} folder */
export async function writeExports(folder) {
  const [map = '', , areas = '', square = ''] = writeFiles(folder, {
    'room.yaml': `image: room.pgm\nresolution: ${SIDE}\norigin: [${ORIGIN.join(', ')}, ${YAW}]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n`,
    'room.pgm': Buffer.concat([
      Buffer.from('P5\n7 5\n255\n'),
      Buffer.from(ROWS.flatMap((row) => [...row].map((cell) => GREYS[cell] ?? NaN))),
    ]),
    'areas.json': JSON.stringify({ scanstitch_areas: 1, areas: AREAS }),
    'square.g2o': SQUARE,
  });
  const exported = await scanstitch(['export', map, areas, '--out', folder]);
  assert.equal(exported.status, 0, exported.stderr);
  const optimized = await scanstitch(['optimize', square, '--json', '--out', join(folder, 'graph.g2o')]);
  assert.equal(optimized.status, 0, optimized.stderr);
  writeFileSync(join(folder, 'map.mcap'), mapMcap(MCAP));
  return Number(JSON.parse(optimized.stdout).from_file.chi_squared);
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const [, , folder = ''] = process.argv;
  mkdirSync(folder, { recursive: true });
  await writeExports(folder);
}
