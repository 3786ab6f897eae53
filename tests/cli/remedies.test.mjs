// @ts-check
/** What messages say to do: the options and settings that they name exist, and doing it helps; of recorded input, see reports.test.mjs. */
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import * as engine from '../../npm/index.js';
import { REMEDY_CASES } from './remedy_cases.mjs';
import { ROOT, scanstitch, temporaryFolder, writeFiles } from './support.mjs';

await engine.load();

/** Sources whose texts are seen, without comments. @param {string} folder @param {RegExp} ending */
function textsOf(folder, ending) {
  const names = readdirSync(join(ROOT, folder), { recursive: true, encoding: 'utf8' });
  return names
    .filter((name) => ending.test(name))
    .map((name) => readFileSync(join(ROOT, folder, name), 'utf8').replaceAll(/^\s*(\/\/|\*|\/\*).*$/gm, ''))
    .join('\n');
}

const SHARED =
  textsOf('crate/src', /\.rs$/) +
  ['bag', 'formats', 'recording'].map((room) => textsOf(`npm/${room}`, /\.js$/)).join('\n');
const COMMANDS = textsOf('npm/cli', /\.js$/);

test('every option and every setting that a message names is there', async () => {
  const named = new Set([...`${SHARED}\n${COMMANDS}`.matchAll(/--set ([a-z]\w+)=/g)].map(([, name = '']) => name));
  const settings = [...engine.describe_settings(), ...engine.describe_spatial_settings()].map(({ name }) => name);
  const registration = [
    'init',
    'init_T_target_source',
    'metric',
    'robust_kernel',
    'step',
    'trim_fraction',
    'voxel_size',
  ];
  const unknown = [...named].filter((name) => ![...settings, ...registration].includes(name));
  assert.deepEqual(unknown, []);
  assert.ok(named.size > 5);
  const options = [...SHARED.matchAll(/(?<![\w-])--([a-z][a-z-]+) (?=[A-Za-z{$])/g)].map(([, name = '']) => name);
  const { stdout } = await scanstitch(['reconstruct', '--help']);
  const foreign = /^(export|convert-to|input|out|output|filename|include|full-length|depth|recursive|headless)/;
  const absent = options.filter((name) => !foreign.test(name) && !stdout.includes(`--${name} `));
  assert.deepEqual(absent, []);
});

test('what the page shows as well names no option of the command line but the text of a table', () => {
  const options = [...SHARED.matchAll(/--(set|intrinsics|odometry|topic|reference|recording|preset)\b/g)];
  assert.deepEqual(
    options.map(([option]) => option),
    [],
  );
});

for (const [name, { files, said, remedy, helps }] of Object.entries(REMEDY_CASES)) {
  test(`${name}: ${remedy.join(' ')}`, async (t) => {
    const run = async (/** @type {string[]} */ ...options) => {
      const folder = temporaryFolder(t);
      writeFiles(folder, files);
      const { stdout, stderr } = await scanstitch(['reconstruct', folder, '--out', join(folder, 'out'), ...options]);
      return `${stderr}\n${stdout}`;
    };
    assert.match(await run(), said);
    const after = await run(...remedy);
    assert.doesNotMatch(after, said);
    assert.match(after, helps);
  });
}
