// @ts-check
/** The crate as it is published: what is in it. That it compiles in an empty project is a stage of its own (scripts/test.mjs). */
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { test } from 'node:test';
import { ROOT } from './support.mjs';

test('the package holds the sources, the licences and nothing else', () => {
  const list = ['package', '--list', '--allow-dirty', '--package', 'scanstitch', '--offline', '--quiet'];
  const paths = execFileSync('cargo', list, { cwd: ROOT, encoding: 'utf8' }).trim().split('\n');
  for (const path of ['LICENSE-APACHE', 'LICENSE-MIT', 'README.md', 'crate/src/lib.rs']) {
    assert.ok(paths.includes(path), `${path} is missing`);
  }
  const own = /^(crate\/src\/.*\.rs|Cargo\.(toml|toml\.orig|lock)|README\.md|LICENSE-\w+|\.cargo_vcs_info\.json)$/;
  assert.deepEqual(
    paths.filter((path) => !own.test(path)),
    [],
  );
});
