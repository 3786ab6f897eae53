// @ts-check
/** The crate as it is published: what is in it, and that it compiles in an empty project. */
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { TARGET_DIR } from '../../scripts/steps.mjs';
import { ROOT, temporaryFolder } from './support.mjs';

/** @param {string[]} args @param {string} cwd @param {NodeJS.ProcessEnv} [env] */
function cargo(args, cwd, env = {}) {
  return execFileSync('cargo', [...args, '--offline', '--quiet'], {
    cwd,
    encoding: 'utf8',
    env: { ...process.env, ...env },
    stdio: ['ignore', 'pipe', 'ignore'],
  });
}

test('the package holds the sources, the licences and nothing else', () => {
  const paths = cargo(['package', '--list', '--allow-dirty', '--package', 'scanstitch'], ROOT).trim().split('\n');
  for (const path of ['LICENSE-APACHE', 'LICENSE-MIT', 'README.md', 'crate/src/lib.rs']) {
    assert.ok(paths.includes(path), `${path} is missing`);
  }
  const own = /^(crate\/src\/.*\.rs|Cargo\.(toml|toml\.orig|lock)|README\.md|LICENSE-\w+|\.cargo_vcs_info\.json)$/;
  assert.deepEqual(
    paths.filter((path) => !own.test(path)),
    [],
  );
});

test(
  'the package compiles in an empty project, with the example of docs/api.md',
  { skip: !process.env.CI && 'compiled where CI=true' },
  (t) => {
    const folder = temporaryFolder(t);
    // Dependencies are compiled once; the package, which lies elsewhere each time, every time.
    const target = join(TARGET_DIR, 'consumer');
    const env = { CARGO_TARGET_DIR: target };
    cargo(['package', '--no-verify', '--allow-dirty', '--package', 'scanstitch'], ROOT, env);
    const { version } = JSON.parse(readFileSync(join(ROOT, 'package.json'), 'utf8'));
    execFileSync('tar', ['-xzf', join(target, 'package', `scanstitch-${version}.crate`)], { cwd: folder });
    cargo(['init', '--name', 'consumer', 'consumer'], folder);
    const project = join(folder, 'consumer');
    cargo(['add', '--path', join('..', `scanstitch-${version}`)], project);
    const guide = readFileSync(join(ROOT, 'docs', 'api.md'), 'utf8');
    const [, example = ''] = /^```rust\n([^]*?)^```$/m.exec(guide) ?? [];
    assert.match(example, /fn main/);
    writeFileSync(join(project, 'src', 'main.rs'), example);
    // What it computes, its doctest asserts (crate/src/lib.rs).
    cargo(['check'], project, env);
  },
);
