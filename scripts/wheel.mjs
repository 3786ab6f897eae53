// @ts-check
/**
 * `npm run wheel`: the Python package for notebooks, into target/wheel. It carries the built element, so that neither building
 * nor installing it takes a compiler, nor Python to build it.
 *
 * Source of the format: the binary distribution format, packaging.python.org.
 */
import { createHash } from 'node:crypto';
import { existsSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { zipSync } from 'fflate';
import { buildStandalone, ELEMENT } from './engine.mjs';
import { ROOT, runMain, TARGET_DIR } from './steps.mjs';

/** Writes the wheel and returns its path. */
export function makeWheel() {
  const { version, description, license } = JSON.parse(readFileSync(join(ROOT, 'package.json'), 'utf8'));
  const info = `scanstitch-${version}.dist-info`;
  const read = (/** @type {string[]} */ ...path) => readFileSync(join(ROOT, ...path));
  const text = (/** @type {string} */ content) => Buffer.from(content);
  /** @type {Record<string, Buffer>} */
  const files = {
    'scanstitch/__init__.py': read('python', 'scanstitch', '__init__.py'),
    'scanstitch/widget.js': Buffer.concat([readFileSync(ELEMENT), text('\n'), read('python', 'widget.js')]),
    [`${info}/METADATA`]: text(
      `Metadata-Version: 2.4\nName: scanstitch\nVersion: ${version}\nSummary: ${description}\n` +
        `License-Expression: ${license}\nLicense-File: LICENSE-APACHE\nLicense-File: LICENSE-MIT\n` +
        'Requires-Python: >=3.10\nRequires-Dist: anywidget>=0.9\nRequires-Dist: numpy\n',
    ),
    [`${info}/WHEEL`]: text('Wheel-Version: 1.0\nGenerator: scanstitch\nRoot-Is-Purelib: true\nTag: py3-none-any\n'),
    [`${info}/licenses/LICENSE-APACHE`]: read('LICENSE-APACHE'),
    [`${info}/licenses/LICENSE-MIT`]: read('LICENSE-MIT'),
  };
  const records = Object.entries(files).map(([path, bytes]) => {
    const digest = createHash('sha256').update(bytes).digest('base64url');
    return `${path},sha256=${digest},${bytes.length}\n`;
  });
  files[`${info}/RECORD`] = text(`${records.join('')}${info}/RECORD,,\n`);
  const folder = join(TARGET_DIR, 'wheel');
  mkdirSync(folder, { recursive: true });
  const path = join(folder, `scanstitch-${version}-py3-none-any.whl`);
  writeFileSync(path, zipSync(files, { mtime: new Date(1980, 0, 2) }));
  return path;
}

if (process.argv[1] === import.meta.filename) {
  await runMain(async () => {
    if (!existsSync(ELEMENT)) await buildStandalone();
    console.log(`Install it with: pip install ${makeWheel()}`);
  });
}
