// @ts-check
/** The npm package: what is in it, that it installs and runs alone, its typed API, its documented example. */
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { join } from 'node:path';
import { test } from 'node:test';
import * as api from '../../npm/index.js';
import {
  asciiPly,
  neededPackages,
  ROOM_FILES,
  ROOM_POSES,
  ROOT,
  roomScan,
  temporaryFolder,
  writeFiles,
} from './support.mjs';

await api.load();

/** @param {string} source */
function bytes(source) {
  return new TextEncoder().encode(source);
}

test('packed, installed elsewhere and run alone', (t) => {
  const folder = temporaryFolder(t);
  const npm = (/** @type {string[]} */ args, cwd = folder) =>
    execFileSync('npm', [...args, '--offline', '--loglevel=error'], { cwd, encoding: 'utf8' });
  const [{ filename, files }] = JSON.parse(
    npm(['pack', '--json', '--ignore-scripts', '--pack-destination', folder], ROOT),
  );

  const paths = files.map((/** @type {{ path: string }} */ { path }) => path);
  const foreign = paths.filter((/** @type {string} */ path) => {
    return !/^(npm\/((\w+\/)?\w+(\.d\.ts|\.js)|custom-elements\.json)|pkg\/scanstitch(_formats)?(_bg)?\.(js|wasm|d\.ts|wasm\.d\.ts)|www\/dist\/(standalone\/scanstitch-app|module\/[\w-]+)\.js|package\.json|README\.md|LICEN[CS]E.*)$/.test(
      path,
    );
  });
  assert.deepEqual(foreign, [], 'nothing that the package does not need');
  for (const licence of ['LICENSE-MIT', 'LICENSE-APACHE']) assert.ok(paths.includes(licence));

  writeFileSync(join(folder, 'package.json'), '{ "type": "module" }');
  // With what it depends on, as it is installed here.
  npm(['install', '--install-links', '--ignore-scripts', filename, ...neededPackages()]);
  writeFiles(folder, ROOM_FILES);
  const command = join(folder, 'node_modules', '.bin', 'scanstitch');
  const run = spawnSync(command, ['reconstruct', '.'], { cwd: folder, encoding: 'utf8' });
  assert.equal(run.status, 0, run.stderr);
  assert.ok(existsSync(join(folder, 'scanstitch-out', 'map.ply')));

  const trajectory = ROOM_POSES.map(([x, y], index) => `${index} ${x} ${y} ${index ** 2} 0 0 0 1\n`).join('');
  writeFiles(folder, { 'reference.tum': trajectory, 'mine.tum': trajectory });
  for (const [index, example] of examples().entries()) {
    const path = join(folder, `example${index}.js`);
    writeFileSync(path, example);
    const { status, stdout, stderr } = spawnSync(process.execPath, [path], { cwd: folder, encoding: 'utf8' });
    assert.equal(status, 0, `${example}\n${stderr}`);
    assert.equal(stdout !== '', example.includes('console.log'), example);
  }
});

/** The JavaScript that the documentation shows for Node. */
function examples() {
  const types = ['index.d.ts', 'recording_reader.d.ts']
    .map((name) => readFileSync(join(ROOT, 'npm', name), 'utf8').replaceAll(/^ \* ?/gm, ''))
    .join('\n');
  const guide = existsSync(join(ROOT, 'docs', 'api.md')) ? readFileSync(join(ROOT, 'docs', 'api.md'), 'utf8') : '';
  const found = [types, guide].flatMap((text) =>
    [...text.matchAll(/^```js\n(.*?)^```$/gms)].map(([, code = '']) => code),
  );
  const ofNode = found.filter((code) => code.includes("from 'scanstitch'") && code.includes('node:fs'));
  assert.ok(ofNode.length > 0);
  return ofNode;
}

test('the types declare what the module exports', () => {
  const types = ['index.d.ts', 'api/api.d.ts'].map((name) => readFileSync(join(ROOT, 'npm', name), 'utf8')).join('\n');
  const listed = [...types.matchAll(/^export \{([^}]*)\} from/gm)].flatMap(([, names = '']) =>
    names
      .split(',')
      .map((name) => name.trim())
      .filter((name) => name !== ''),
  );
  const functions = [...types.matchAll(/^export declare function (\w+)/gm)].map(([, name]) => name);
  assert.deepEqual([...listed, ...functions].toSorted(), Object.keys(api).toSorted());
});

test('the engine loads once, from bytes too', async () => {
  assert.equal(api.load(), api.load());
  const url = `../../npm/index.js?${Date.now()}`;
  /** @type {typeof api} */
  const again = await import(url);
  await again.load(await readFile(join(ROOT, 'pkg', 'scanstitch_bg.wasm')));
  assert.equal(again.version(), api.version());
});

test('PointCloud: arrays in, arrays out, PLY both ways', () => {
  const xyz = Float32Array.of(1, 2, 3, 4, 5, 6);
  const cloud = api.PointCloud.from_positions(xyz);
  assert.equal(cloud.length, 2);
  assert.equal(cloud.is_planar, false);
  assert.equal(api.PointCloud.from_positions(Float32Array.of(1, 2, 0, 3.5, 4, -0)).is_planar, true);
  assert.deepEqual(cloud.positions(), xyz);
  assert.equal(cloud.normals(), undefined);
  assert.equal(cloud.colors(), undefined);
  for (const format of /** @type {const} */ (['ascii', 'binary_little_endian'])) {
    const back = api.PointCloud.from_ply(cloud.to_ply(format), 'back.ply');
    assert.deepEqual(back.positions(), xyz);
    back.free();
  }
  cloud.free();
});

test('register: the motion between two scans of a room', () => {
  const target = api.PointCloud.from_ply(bytes(roomScan(ROOM_POSES[0])), 'target.ply');
  const source = api.PointCloud.from_ply(bytes(roomScan(ROOM_POSES[1])), 'source.ply');
  const { T_target_source, converged, num_inliers } = api.register(source, target);
  const [x, y, theta] = ROOM_POSES[1];
  assert.ok(converged);
  assert.ok(num_inliers > 100);
  assert.ok(Math.hypot((T_target_source[3] ?? 0) - x, (T_target_source[7] ?? 0) - y) < 0.01);
  assert.ok(Math.abs(Math.atan2(T_target_source[4] ?? 0, T_target_source[0] ?? 0) - theta) < 0.005);
});

test('Reconstruction: step by step, results at any time, other settings on the same scans', () => {
  const reconstruction = new api.Reconstruction({ strategy: 'scan_to_map' });
  assert.deepEqual(reconstruction.result().frames, []);
  for (const [name, text] of Object.entries(ROOM_FILES)) {
    const { num_read, num_kept } = reconstruction.add_scan(name, bytes(text));
    assert.deepEqual([num_read, num_kept], [180, 180]);
    // A bad one leaves the others in place.
    assert.throws(() => reconstruction.add_scan('bad.ply', bytes('not a scan')), { name: 'ScanstitchError' });
  }
  const run = () => {
    for (let steps = 0; reconstruction.step().stage !== 'done'; steps += 1) assert.ok(steps < 1000);
    return reconstruction.result();
  };
  assert.equal(reconstruction.step().frame, 0);
  assert.equal(reconstruction.result().frames.length, 1);
  assert.equal(reconstruction.map_points().length, 2 * 180);
  assert.equal(run().frames.length, 3);
  const points = reconstruction.map_points().length / 2;
  assert.equal(reconstruction.map_frames().length, points);
  assert.equal(reconstruction.trajectory_matrices().length, 3);
  assert.equal(reconstruction.correspondences(1).length % 4, 0);
  assert.ok(reconstruction.correspondences(1).length > 0);

  reconstruction.set_settings({ strategy: 'joint' });
  const result = run();
  assert.equal(result.settings.strategy, 'joint');
  assert.equal(result.frames.length, 3);
  // The report says what the result says.
  assert.equal(JSON.stringify(JSON.parse(reconstruction.report_json())), JSON.stringify(result));
  reconstruction.free();
});

test('what is thrown names the file, the place, the problem and the remedy', () => {
  const truncated = bytes(asciiPly([[1, 2, 0]], 5));
  const wrong = /** @type {Partial<api.Settings>} */ ({ maxrange: 3 });
  const reconstruction = new api.Reconstruction();
  const cases = /** @type {[() => unknown, string | null, RegExp][]} */ ([
    [() => api.PointCloud.from_ply(truncated, 'short.ply'), 'short.ply', /^short\.ply, line \d+: /],
    [() => reconstruction.add_scan('short.ply', truncated), 'short.ply', /^short\.ply, line \d+: /],
    [() => reconstruction.set_reference('not.tum', bytes('0 0 zero')), 'not.tum', /^not\.tum, line 1: /],
    [() => new api.Reconstruction(wrong), null, /maxrange/],
    [() => new api.Reconstruction({ max_iterations: 0 }), null, /max_iterations/],
    [() => api.PointCloud.from_positions(Float32Array.of(1, 2)), null, /2 numbers/],
  ]);
  for (const [action, file, message] of cases) {
    assert.throws(action, (error) => {
      assert.ok(error instanceof Error);
      const { name, problem, remedy, place } = /** @type {api.ScanstitchError} */ (error);
      assert.equal(name, 'ScanstitchError');
      assert.match(error.message, message);
      assert.equal(/** @type {api.ScanstitchError} */ (error).file, file);
      assert.ok(problem && remedy && error.message.includes(problem) && error.message.includes(remedy));
      assert.equal(error.message.includes(', line '), place !== null && 'line' in place);
      return true;
    });
  }
});
