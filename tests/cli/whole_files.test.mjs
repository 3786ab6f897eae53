// @ts-check
/** Results are written whole or not at all, whatever ends the writing. */
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { existsSync, mkdirSync, readdirSync, readFileSync, statSync, symlinkSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { writeWhole } from '../../npm/cli/disk.js';
import { Random } from '../../scripts/fuzz/random.mjs';
import { signals, wholeFiles } from '../../scripts/fuzz/signals.mjs';
import { ROOM_FILES, roomScan, ROOT, scanstitch, temporaryFolder, writeFiles } from './support.mjs';

const CLI = join(ROOT, 'npm', 'cli.js');
const hasShell = process.platform !== 'win32';
const SCANS = 60;
/** A walk through the room, there and back. */
const WALK = Object.fromEntries(
  Array.from({ length: SCANS }, (_, i) => {
    const part = Math.abs(1 - (2 * i) / SCANS);
    return [`${i}.ply`, roomScan([0.6 * part, part, 0.1 * part])];
  }),
);

/** What a run in the plane writes. */
const ALL_FILES = ['map.pgm', 'map.ply', 'map.yaml', 'report.html', 'report.json', 'trajectory.tum'];

/** @param {string} tum */
function posesIn(tum) {
  return tum.split('\n').filter((line) => line !== '' && !line.startsWith('#'));
}

test('a file that exists keeps its contents until the new ones are complete', async (t) => {
  const folder = temporaryFolder(t);
  const path = join(folder, 'map.ply');
  writeFileSync(path, 'old', { mode: 0o640 });
  symlinkSync(path, join(folder, 'link.ply'));
  await writeWhole(join(folder, 'link.ply'), 'new');
  assert.equal(readFileSync(path, 'utf8'), 'new');
  assert.equal(statSync(path).mode & 0o777, 0o640);
  mkdirSync(join(folder, 'occupied'));
  await assert.rejects(
    writeWhole(join(folder, 'occupied'), 'x'),
    /occupied: The file could not be written\. This is a folder/,
  );
  await assert.rejects(writeWhole(join(folder, 'absent', 'x'), 'x'), /There is no such file or folder/);
  assert.deepEqual(readdirSync(folder).sort(), ['link.ply', 'map.ply', 'occupied']);
});

test('no space for the map: what was complete before is named, what was there is kept', { skip: !hasShell }, (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, WALK);
  const out = join(folder, 'out');
  mkdirSync(out);
  writeFileSync(join(out, 'map.ply'), 'an older map');
  // Files of at most 16 kB: the trajectory fits, the map does not.
  const script = `trap '' XFSZ; ulimit -f 16; exec "$0" "$@"`;
  const args = ['-c', script, process.execPath, CLI, 'reconstruct', folder, '--out', out];
  const { status, stderr } = spawnSync('bash', args, { encoding: 'utf8' });
  assert.match(
    stderr,
    /map\.ply: The file could not be written\. The file would be larger than the system allows\. Complete before that: .*trajectory\.tum/,
  );
  assert.equal(status, 2, stderr);
  assert.equal(readFileSync(join(out, 'map.ply'), 'utf8'), 'an older map');
  assert.deepEqual(readdirSync(out).sort(), ['map.ply', 'trajectory.tum']);
});

test('an output that cannot be printed', { skip: !existsSync('/dev/full') && 'no /dev/full' }, (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, ROOM_FILES);
  const run = (/** @type {string} */ to, /** @type {string[]} */ ...args) =>
    spawnSync('bash', ['-c', `exec "$0" "$@" ${to}`, process.execPath, CLI, ...args], {
      encoding: 'utf8',
      cwd: folder,
    });
  const full = run('> /dev/full', 'reconstruct', '.', '--out', 'out');
  assert.equal(full.stderr, 'scanstitch: The output could not be printed. There is no space left on the device.\n');
  assert.equal(full.status, 2, 'the results are written');
  assert.deepEqual(wholeFiles(join(folder, 'out')), ALL_FILES);
  assert.equal(run('> /dev/full', 'settings').status, 1);
  assert.equal(run('| head -1 > /dev/null; exit ${PIPESTATUS[0]}', 'settings').status, 0);
  assert.equal(run('2> /dev/full', 'reconstruct', 'absent.ply').status, 1);
  assert.equal(run('>&- 2>&-', 'reconstruct', '.', '--out', 'out').status, 0);
});

for (const signal of /** @type {const} */ (['SIGINT', 'SIGTERM'])) {
  test(`${signal} in the plane: the scans placed so far are written`, { skip: !hasShell }, async (t) => {
    const folder = temporaryFolder(t);
    writeFiles(folder, WALK);
    const out = join(folder, 'out');
    // The signal comes when the engine has begun, from within: outside, nobody can tell when that is.
    const script = `
      import { Reconstruction } from ${JSON.stringify(join(ROOT, 'npm', 'index.js'))};
      const step = Reconstruction.prototype.step;
      let count = 0;
      Reconstruction.prototype.step = function () {
        if ((count += 1) === 10) process.kill(process.pid, '${signal}');
        return step.call(this);
      };
      process.argv.splice(1, 1, 'scanstitch');
      await import(${JSON.stringify(CLI)});`;
    const args = ['--input-type=module', '-e', script, '--', 'cli', 'reconstruct', folder, '--out', out];
    const { status, stderr } = spawnSync(process.execPath, args, { encoding: 'utf8' });
    const [, count] = stderr.match(/^Stopped after (\d+) scans; these are written/m) ?? [];
    assert.ok(Number(count) >= 5 && Number(count) < SCANS, stderr);
    assert.equal(status, 2);
    assert.deepEqual(wholeFiles(out), ALL_FILES);
    assert.equal(posesIn(readFileSync(join(out, 'trajectory.tum'), 'utf8')).length, Number(count));
  });
}

// `npm run fuzz -- --time 500 signals` is the long run, over the commands that only print as well.
for (const name of ['plane', 'space', 'strategies', 'convert', 'bev', 'icp']) {
  test(`a signal at any time, ${name}: every file that is there is whole`, { skip: !hasShell }, async () => {
    const seed = Math.floor(2 ** 31 * Math.random());
    await signals(new Random(seed), name).catch((error) => {
      throw new Error(`signals(new Random(${seed}), '${name}')`, { cause: error });
    });
  });
}

test('each command writes its file whole', async (t) => {
  const folder = temporaryFolder(t);
  const [path = ''] = writeFiles(folder, { 'a.tum': '0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n' });
  const target = join(folder, 'b.kitti');
  writeFileSync(target, 'old');
  assert.equal((await scanstitch(['convert', path, target])).status, 0);
  assert.match(readFileSync(target, 'utf8'), /^1\.0 0\.0 0\.0 0\.0 /);
  if (!existsSync('/dev/stdout')) return;
  const args = ['-c', '"$0" "$@" | cat', process.execPath, CLI, 'convert', path, '/dev/stdout', '--to', 'tum'];
  assert.match(spawnSync('bash', args, { encoding: 'utf8' }).stdout, /^0\.0 0\.0 /m);
});
