// @ts-check
/** A map in pieces that are not connected: the outputs say so, and each piece of several scans has a grid of its own. */
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { asciiPly, scanstitch, temporaryFolder, writeFiles } from './support.mjs';

/** Walls from corner to corner, closed. @param {[number, number][]} corners */
function walls(corners) {
  return corners.map((corner, i) => [corner, corners[(i + 1) % corners.length] ?? corner]);
}

/** What a laser with a beam in every degree sees. @param {number[][][]} world @param {[number, number]} place */
function scan(world, [x, y]) {
  return Array.from({ length: 360 }, (_, degree) => {
    const [dx, dy] = [Math.cos((degree * Math.PI) / 180), Math.sin((degree * Math.PI) / 180)];
    const ranges = world.map(([[ax = 0, ay = 0] = [], [bx = 0, by = 0] = []]) => {
      const [ex, ey] = [bx - ax, by - ay];
      const cross = dx * ey - dy * ex;
      const range = ((ax - x) * ey - (ay - y) * ex) / cross;
      const share = ((ax - x) * dy - (ay - y) * dx) / cross;
      return cross !== 0 && range > 0 && share >= 0 && share <= 1 ? range : Infinity;
    });
    const range = Math.min(...ranges) + 0.004 * Math.sin(12.9898 * degree + 78.233 * x);
    return [range * dx, range * dy, 0];
  });
}

const HALL = walls([[-3, -2], [9, -2], [9, 4], [6, 4], [6, 2.5], [2, 2.5], [2, 5], [-3, 5]]); // prettier-ignore
const CELLAR = walls([[-1, -1.2], [2, -1.2], [2.6, -3.4], [4, -3], [4.5, 1], [3, 1.6], [-0.6, 1.1]]); // prettier-ignore

test('stderr, the summary, the reports and the grids say so', async (t) => {
  const folder = temporaryFolder(t);
  const places = Array.from({ length: 12 }, (_, i) => /** @type {[number, number]} */ ([0.25 * i, 0.02 * i]));
  const scans = [HALL, CELLAR].flatMap((world) => places.map((place) => asciiPly(scan(world, place))));
  const files = Object.fromEntries(scans.map((text, i) => [`${String(i).padStart(2, '0')}.ply`, text]));
  writeFiles(folder, files);
  const out = join(folder, 'out');
  const { status, stdout, stderr } = await scanstitch(['reconstruct', folder, '--out', out]);
  // One scan is lost between the rooms.
  assert.equal(status, 2, stderr);
  assert.match(
    stderr,
    /^note: The map is in \d+ pieces that are not connected: \d+ of \d+ placed scans are in the main piece/m,
  );
  assert.match(stdout, /^Map in \d+ pieces that are not connected$/m);
  const read = (/** @type {string} */ name) => readFileSync(join(out, name), 'utf8');
  assert.match(read('report.html'), /<dt>Map<\/dt><dd><strong>\d+ pieces<\/strong> not connected/);
  const { unconnected, frames } = JSON.parse(read('report.json'));
  assert.match(unconnected, /^The map is in \d+ pieces/);
  const grids = readdirSync(out).filter((name) => name.endsWith('.yaml'));
  const pieces = Number(/in (\d+) pieces/.exec(stderr)?.[1]);
  /** @type {Map<number, number>} */
  const sizes = new Map();
  for (const { piece, status } of frames) if (status !== 'lost') sizes.set(piece, (sizes.get(piece) ?? 0) + 1);
  assert.equal(sizes.size, pieces);
  const hasGrid = (/** @type {[number, number]} */ [piece, size]) => piece === 0 || size > 1;
  assert.equal(grids.length, [...sizes].filter(hasGrid).length);
  assert.ok(grids.length > 1, grids.join());
  for (const name of grids) {
    assert.match(
      read(name),
      new RegExp(`^image: ${name.replace('.yaml', '.pgm')}\\n[^]*\\n# This is .* of a map in ${pieces} pieces`),
    );
  }
  // The folder of results is no recording of maps.
  const again = await scanstitch(['reconstruct', out, '--out', join(folder, 'again')]);
  assert.doesNotMatch(again.stderr, /map_piece/);
});
