// @ts-check
/** `scanstitch optimize`: chi squared, files in and out, what is told of graphs that are not whole, bad arguments. */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { scanstitch, temporaryFolder, writeFiles } from './support.mjs';

/** A square whose last side is 0.2 m too long, and no pose. */
const SQUARE = [0, 1, 2, 3]
  .map((from) => `EDGE_SE2 ${from} ${(from + 1) % 4} ${from === 3 ? 1.2 : 1} 0 1.5707963267948966 100 0 0 100 0 400\n`)
  .join('');

test('a square that does not close: the error is spread, and the result is a g2o file and a trajectory', async (t) => {
  const folder = temporaryFolder(t);
  const [path = ''] = writeFiles(folder, { 'square.g2o': SQUARE });
  const out = join(folder, 'out.g2o');
  const json = await scanstitch(['optimize', path, '--json', '--out', out]);
  assert.equal(json.status, 0);
  assert.match(json.stderr, /4 nodes have no pose in the file/);
  const report = JSON.parse(json.stdout);
  assert.deepEqual([report.num_nodes, report.num_edges, report.degrees_of_freedom], [4, 4, 3]);
  const [file, chordal] = [report.from_file, report.from_chordal];
  assert.ok(file.converged && chordal.converged);
  // At first all of it is in the edge that closes the square: 100 * 0.2^2.
  assert.ok(Math.abs(file.initial_chi_squared - 4) < 1e-9 && file.chi_squared < 2.1, JSON.stringify(file));
  assert.ok(Math.abs(file.chi_squared - chordal.chi_squared) < 1e-9);
  assert.equal(report.worst_edges.length, 4);

  const again = JSON.parse((await scanstitch(['optimize', out, '--json', '--start', 'file'])).stdout);
  assert.ok(Math.abs(again.from_file.initial_chi_squared - file.chi_squared) < 1e-9);
  assert.deepEqual([again.num_composed, again.from_chordal], [0, null]);

  // TORO's order, read by position: xx xy yy tt xt yt.
  const skewed = writeFiles(folder, { 'skewed.g2o': 'EDGE_SE2 3 5 1 2 0.5 10 1 2 20 3 30\nFIX 3\n' })[0] ?? '';
  const graph = join(folder, 'out.graph');
  assert.equal((await scanstitch(['optimize', skewed, '--out', graph])).status, 0);
  const lines = readFileSync(graph, 'utf8').trimEnd().split('\n');
  const fields = lines.map((line) => line.split(' ')).map(([kind, ...numbers]) => [kind, ...numbers.map(Number)]);
  assert.deepEqual(fields, [
    ['VERTEX2', 3, 0, 0, 0],
    ['VERTEX2', 5, 1, 2, 0.5],
    ['EDGE2', 3, 5, 1, 2, 0.5, 10, 1, 20, 30, 2, 3],
  ]);
  const read = JSON.parse((await scanstitch(['optimize', graph, '--json', '--start', 'file'])).stdout);
  assert.ok(read.num_edges === 1 && read.from_file.initial_chi_squared < 1e-20);
  const [deep = ''] = writeFiles(folder, {
    'deep.g2o': 'EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n',
  });
  assert.match((await scanstitch(['optimize', deep, '--out', graph])).stderr, /in space is written as g2o/);

  const tum = join(folder, 'poses.tum');
  const plain = await scanstitch(['optimize', path, '--out', tum]);
  assert.match(plain.stdout, /4 poses and 4 measured motions in the plane; .*chi squared is about 3\n/);
  assert.match(plain.stdout, /from the edges alone +1 +0\.94\d+ +\d+ +(not )?kept/);
  assert.deepEqual(
    readFileSync(tum, 'utf8')
      .split('\n')
      .map((line) => line.split(' ').length),
    [8, 8, 8, 8, 1],
  );
});

test('parts that no edge joins and a search that was stopped are told', async (t) => {
  const [path = ''] = writeFiles(temporaryFolder(t), { 'g.g2o': `${SQUARE}EDGE_SE2 8 9 1 0 0 1 0 0 1 0 1\n` });
  const { status, stderr } = await scanstitch(['optimize', path, '--iterations', '1']);
  assert.equal(status, 0);
  assert.match(stderr, /in 2 parts that no edge joins/);
  assert.match(stderr, /stopped before it converged: raise --iterations/);
});

test('bad arguments and bad graphs are one line', async (t) => {
  const [path = ''] = writeFiles(temporaryFolder(t), {
    'bad.g2o': 'EDGE_SE2 0 1 1 0 0 1 5 0 1 0 1\n',
    'good.g2o': SQUARE,
  });
  for (const [args, told] of /** @type {const} */ ([
    [[], 'Name one pose graph'],
    [[path, path], 'Name one pose graph'],
    [[path], 'bad.g2o, line 1: The information matrix is not positive'],
    [['nowhere.g2o'], 'nowhere.g2o'],
    [[path.replace('bad', 'good'), '--start', 'middle'], '--start is one of both, file, chordal, not "middle"'],
    [[path.replace('bad', 'good'), '--iterations', '0'], '--iterations is a whole number from 1, not "0"'],
  ])) {
    const { status, stdout, stderr } = await scanstitch(['optimize', ...args]);
    assert.deepEqual([status, stdout], [1, '']);
    assert.ok(stderr.includes(told) && stderr.trim().split('\n').length === 1, stderr);
  }
});
