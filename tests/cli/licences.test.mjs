// @ts-check
/** Everything the project is built from may be used freely, and comes from the registries alone. */
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { billOfMaterials } from '../../scripts/sbom.mjs';
import { ROOT } from './support.mjs';

const PERMISSIVE = new Set([
  ...['MIT', 'MIT-0', 'Apache-2.0', 'Apache-2.0 WITH LLVM-exception', 'BSD-2-Clause', 'BSD-3-Clause', '0BSD', 'ISC'],
  ...['Zlib', 'Unlicense', 'CC0-1.0', 'BSL-1.0', 'Unicode-3.0', 'BlueOak-1.0.0'],
  // As Zlib's, in other words: of libbz2-rs-sys.
  'bzip2-1.0.6',
]);
/** Used to build or to test, changed by nobody here, no part of what is shipped. */
const TOOLS_ALONE = new Map([['lightningcss', 'MPL-2.0']]);

/** Whether an SPDX expression leaves a permissive choice. @param {string} expression */
function isPermissive(expression) {
  const choices = expression.replaceAll(/[()]/g, '').split(/ OR |\//);
  return choices.some((choice) => choice.split(' AND ').every((licence) => PERMISSIVE.has(licence.trim())));
}

test('Rust crates', () => {
  const metadata = execFileSync('cargo', ['metadata', '--format-version', '1', '--locked'], {
    cwd: ROOT,
    encoding: 'utf8',
    maxBuffer: 2 ** 26,
    // What cargo complains of is part of the error that is thrown.
    stdio: ['ignore', 'pipe', 'pipe'],
  });
  /** @type {{ name: string, license: string | null, source: string | null }[]} */
  const packages = JSON.parse(metadata).packages;
  const foreign = packages.filter(({ source }) => source !== null);
  assert.ok(foreign.length > 20);
  assert.deepEqual(
    foreign.filter(({ license }) => !isPermissive(license ?? '')),
    [],
  );
  assert.deepEqual(
    foreign.filter(({ source }) => !source?.startsWith('registry+')),
    [],
  );
});

test('npm packages', () => {
  /** @type {Record<string, { license?: string, resolved?: string }>} */
  const packages = JSON.parse(readFileSync(join(ROOT, 'package-lock.json'), 'utf8')).packages;
  const foreign = Object.entries(packages).filter(([path]) => path !== '');
  assert.ok(foreign.length > 10);
  const refused = foreign.filter(([path, { license = '' }]) => {
    const name = path.replace('node_modules/', '');
    return !isPermissive(license) && ![...TOOLS_ALONE].some(([tool, its]) => name.startsWith(tool) && license === its);
  });
  assert.deepEqual(refused, []);
  assert.deepEqual(
    foreign.filter(([, { resolved }]) => resolved !== undefined),
    [],
    'the lock names no host',
  );
});

test('the bill of materials names what the page is made of, with versions and licences', () => {
  const { components } = billOfMaterials();
  const names = components.map(({ name }) => name);
  for (const name of ['lit', 'three', 'fflate', 'fzstd', 'd3-scale', 'nalgebra', 'glam', 'png', 'wasm-bindgen']) {
    assert.ok(names.includes(name), name);
  }
  // What builds and tests it is no part of it.
  for (const name of ['vite', 'typescript', 'playwright', 'wasm-bindgen-cli-support'])
    assert.ok(!names.includes(name), name);
  assert.ok(components.every(({ version, licenses }) => /^\d+\./.test(version) && licenses.length === 1));
});
