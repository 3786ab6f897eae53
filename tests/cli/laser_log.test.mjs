// @ts-check
/** `scanstitch reconstruct` on laser logs: outputs, odometry, bad lines. */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { readReport, scanstitch, temporaryFolder, writeFiles } from './support.mjs';

/** A robot that drives 5 cm a scan ahead in a room with a niche, as CARMEN logs it. @param {number} numScans */
function roomLog(numScans) {
  const line = (/** @type {unknown} */ _, /** @type {number} */ scan) => {
    const x = 0.05 * scan;
    const ranges = Array.from({ length: 180 }, (_, beam) => {
      const angle = ((beam - 90) * Math.PI) / 180;
      const toSide = (beam < 60 ? 2 : 3) / Math.max(Math.abs(Math.sin(angle)), 1e-9);
      return Math.min(toSide, (4 - x) / Math.max(Math.cos(angle), 1e-9), 50).toFixed(3);
    });
    return `FLASER 180 ${ranges.join(' ')} ${x} 0 0 ${x} 0 0 ${scan} robot ${scan}`;
  };
  return `# a room\n${Array.from({ length: numScans }, line).join('\n')}\n`;
}

const rows = (/** @type {number} */ count, scale = 1) =>
  Array.from({ length: count }, (_, i) => `${i} ${0.05 * i * scale} 0 0\n`).join('');

test('a log: a trajectory of all its scans, a grid for map_server, and the poses in it as a reference', (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, { 'drive.log': roomLog(9) });
  const { status, stdout, stderr } = scanstitch([
    'reconstruct',
    join(folder, 'drive.log'),
    '--out',
    join(folder, 'out'),
  ]);
  assert.equal(status, 0, stderr);
  const { frames, comparison } = readReport(join(folder, 'out'));
  assert.equal(frames.length, 9);
  assert.equal(frames[8].name, 'drive.log #8');
  assert.equal(comparison.name, 'the poses in the log');
  assert.ok(comparison.max < 0.01, `${comparison.max} m`);
  assert.match(stdout, /9 scans in/);
  const pgm = readFileSync(join(folder, 'out', 'map.pgm'));
  const [, width, height] =
    pgm
      .subarray(0, 40)
      .toString('latin1')
      .match(/^P5\n(\d+) (\d+)\n255\n/) ?? [];
  assert.equal(pgm.length, `P5\n${width} ${height}\n255\n`.length + Number(width) * Number(height));
  const yaml = readFileSync(join(folder, 'out', 'map.yaml'), 'utf8');
  assert.match(yaml, /^image: map\.pgm\nmode: trinary\nresolution: 0\.05\norigin: \[-?[\d.]+, -?[\d.]+, 0\.0\]\n/);
});

test('odometry that is named gives the first guess; one without headings is told', (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, { 'drive.log': roomLog(9), 'wheels.txt': rows(9, 1.1), 'positions.txt': '0 0\n0.05 0\n' });
  const at = (/** @type {string} */ name) => join(folder, name);
  const used = scanstitch(['reconstruct', at('drive.log'), '--odometry', at('wheels.txt'), '--out', at('out')]);
  assert.equal(used.status, 0, used.stderr);
  assert.match(used.stderr, /wheels\.txt gives the first guess/);
  assert.ok(readReport(at('out')).comparison.max < 0.01);
  const refused = scanstitch(['reconstruct', at('drive.log'), '--odometry', at('positions.txt'), '--out', at('out')]);
  assert.equal(refused.status, 2);
  assert.match(refused.stderr, /positions\.txt: These positions have no headings/);
});

test('a bad line is told with its number', (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, { 'bad.log': 'FLASER 3 1 2 3 0 0 0 0 0 0\nFLASER 3 1 x 3 0 0 0 0 0 0\n# end\n' });
  const { status, stderr } = scanstitch(['reconstruct', join(folder, 'bad.log'), '--out', join(folder, 'out')]);
  assert.notEqual(status, 0);
  assert.match(stderr, /bad\.log, line 2: "x" in the place of readings is no number/);
});
