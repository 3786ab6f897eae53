// @ts-check
/** Help says everything there is. */
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import * as engine from '../../npm/index.js';
import { ROOT, scanstitch, spawnScanstitch } from './support.mjs';

await engine.load();

test('--help names every command, option, exit code, setting and preset', async () => {
  const { status, stdout, stderr } = await scanstitch(['--help']);
  assert.equal(status, 0);
  assert.equal(stderr, '');
  const words = [
    'reconstruct',
    'evaluate',
    'convert',
    'map-quality',
    'consistency',
    'strategies',
    'bev',
    'topics',
    'live',
    '--seconds',
    'settings',
    '--topic',
    '--odometry',
    '--map-format',
    '--align',
    '--json',
    '--reference',
    '--preset',
    '--set',
    '--workers',
    '--intrinsics',
    '--recording',
    '--out',
    '--version',
    'Exit codes',
  ];
  const settings = [...engine.describe_settings(), ...engine.describe_spatial_settings()];
  assert.ok(settings.length >= 30);
  for (const word of [...words, ...[...engine.presets(), ...engine.spatial_presets()].map(({ name }) => name)])
    assert.ok(stdout.includes(word), word);
  for (const { name, kind } of settings) {
    assert.match(stdout, new RegExp(`^ +${name}=\\S+`, 'm'), `${name} with its default`);
    if (kind.type === 'choice') for (const { value } of kind.choices) assert.ok(stdout.includes(value), value);
  }
  const long = stdout.split('\n').filter((line) => line.length > 120);
  assert.deepEqual(long, [], 'lines fit a terminal');
});

test('each command has its own help, and settings lists the settings', async () => {
  const help = await scanstitch(['reconstruct', '--help']);
  assert.equal(help.status, 0);
  assert.match(help.stdout, /^scanstitch reconstruct FILES-OR-FOLDER-OR-ZIP/);
  const list = await scanstitch(['settings']);
  assert.equal(list.status, 0);
  assert.ok(help.stdout.endsWith(list.stdout));
});

test('--version is the version of the package', async () => {
  const { version } = JSON.parse(readFileSync(join(ROOT, 'package.json'), 'utf8'));
  assert.deepEqual(await scanstitch(['--version']), { status: 0, stdout: `${version}\n`, stderr: '' });
});

test('a process prints what the command prints, and ends with its exit code', async () => {
  const data = join(ROOT, 'tests', 'data', 'evaluation');
  const [reference, estimate] = [join(data, 'reference.tum'), join(data, 'estimate.tum')];
  for (const [code, ...args] of /** @type {const} */ ([
    [0, 'settings'],
    [1, 'reconstrukt'],
    [2, 'evaluate', reference, estimate, join(data, 'absent.tum'), '--max-diff', '0.05'],
  ])) {
    const found = spawnScanstitch(args);
    assert.equal(found.status, code);
    assert.deepEqual(found, await scanstitch(args));
  }
});

test('a reader that closes the pipe early is no failure', () => {
  const command = `"${process.execPath}" npm/cli.js --help | head -n 1`;
  const { status, stdout, stderr } = spawnSync('bash', ['-o', 'pipefail', '-c', command], {
    cwd: ROOT,
    encoding: 'utf8',
  });
  assert.deepEqual({ status, stderr }, { status: 0, stderr: '' });
  assert.match(stdout, /trajectory/);
});
