// @ts-check
/** The shape of page and package: imports point one way, no file imports itself by a detour, and one module of the page knows the
 * engine. */
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { dirname, join, normalize } from 'node:path';
import { test } from 'node:test';
import { ROOT } from './support.mjs';

/**
 * The rooms of each folder of sources from the ground up. A room may import from those before its own line, and from itself; the
 * page from those of the package.
 */
const LAYERS = {
  package: [
    ['base'],
    ['files'],
    ['archive'],
    ['bag'],
    ['formats'],
    ['recording'],
    ['run', 'lab', 'evaluation', 'mesh', 'live'],
    ['report'],
    ['api'],
    ['index', 'browser', 'element', 'recording_reader'],
    ['cli'],
  ],
  'www/src': [
    ['engine'],
    ['datasets', 'export', 'views'],
    ['components'],
    ['drawing'],
    ['run'],
    ['planar', 'spatial', 'lab', 'bev', 'evaluate', 'strategies', 'localize'],
    ['live'],
    ['app'],
    ['scanstitch-app'],
  ],
};
/** What the page does not import: what Node alone runs, and what is emitted. */
const NOT_FOR_PAGES = /^(package\/(cli|index|api)\b|npm\/)/;
const FILES = ['files', 'in-modules', 'in-one-file'].map((name) => `www/src/engine/engine-${name}.ts`);
const FORMATS = ['www/src/engine/formats-engine-packed.ts'];
/** The modules that import the engine's packages: their JavaScript, and their WebAssembly. */
const KNOW_THE_PACKAGE = new Map([
  ['pkg/scanstitch.js', ['www/src/engine/package.ts']],
  ['pkg/scanstitch_planar.js', ['www/src/engine/planar-package.ts']],
  ['pkg/scanstitch_bg.wasm', FILES],
  ['pkg/scanstitch_planar_bg.wasm', FILES],
  ['pkg/scanstitch_formats.js', FORMATS],
  ['pkg/scanstitch_formats_bg.wasm', FORMATS],
]);

/** @typedef {{ line: number, from: string, isTypeOnly: boolean, isLazy: boolean }} Import `from`: a path from the root of the clone */
/** @typedef {{ path: string, text: string }} Source */

const IMPORT =
  /(?<!\w)(?:(?:import|export)\s+(?<type>type\s)?(?:[\w*{][^'";]*?\sfrom\s*)?|(?<lazy>import\s*\(\s*))['"](?<from>\.[^'"?]*)(?:\?[^'"]*)?['"]/g;

/** What a source imports from files of the clone; packages are not among it. @param {Source} source @returns {Import[]} */
function importsOf({ path, text }) {
  const code = text.replace(/\/\*[^]*?\*\/|^\s*\/\/.*$/gm, (comment) => comment.replace(/[^\n]/g, ' '));
  return [...code.matchAll(IMPORT)].map(({ index, groups = {} }) => ({
    line: code.slice(0, index).split('\n').length,
    from: normalize(join(dirname(path), groups.from ?? '')).replaceAll('\\', '/'),
    isTypeOnly: groups.type !== undefined,
    isLazy: groups.lazy !== undefined,
  }));
}

/** The folder of sources and the room of a file; null for one outside. @param {string} path */
function placeOf(path) {
  const [, folder, room = ''] = /^(www\/src|package)\/([^/]+?)(?:\/|\.ts$|\.js$)/.exec(path) ?? [];
  if (folder !== 'package' && folder !== 'www/src') return null;
  return { folder, room, rank: LAYERS[folder].findIndex((layer) => layer.includes(room)) };
}

/** Imports that point up or sideways. @param {Source[]} sources */
function wrongDirections(sources) {
  return sources.flatMap((source) => {
    const { folder, room, rank } = placeOf(source.path) ?? { folder: null, room: '', rank: -1 };
    if (rank < 0) return [`${source.path}: ${room} has no place in LAYERS`];
    return importsOf(source).flatMap(({ line, from }) => {
      const imported = placeOf(from);
      const isForbidden =
        imported?.folder === folder
          ? imported.room !== room && (imported.rank < 0 || imported.rank >= rank)
          : folder === 'package'
            ? !/^pkg\/scanstitch(_formats)?(_bg\.wasm|\.js)$/.test(from)
            : NOT_FOR_PAGES.test(from);
      return isForbidden ? [`${source.path}:${line}: ${room} must not import from ${imported?.room ?? from}`] : [];
    });
  });
}

/** Uses of the engine's package anywhere but in its one home. @param {Source[]} sources */
function packageUses(sources) {
  return sources.flatMap((source) =>
    importsOf(source).flatMap(({ line, from, isTypeOnly }) => {
      const homes = KNOW_THE_PACKAGE.get(from) ?? [];
      const isWorker = /worker\.ts$/.test(source.path) || /engine\/(planar-)?package\.ts$/.test(source.path);
      if (from.startsWith('pkg/') && !homes.includes(source.path))
        return [`${source.path}:${line}: ${from} is imported by ${homes.join(' and ')} alone`];
      if (/^www\/src\/engine\/(planar-)?package\.js$/.test(from) && !isTypeOnly && !isWorker) {
        return [`${source.path}:${line}: only a worker calls the engine`];
      }
      return [];
    }),
  );
}

/** The first ring of files that import each other; null where there is none. @param {Source[]} sources */
function cycleAmong(sources) {
  const paths = new Map(sources.map((source) => [source.path.replace(/\.ts$/, '.js'), source]));
  /** @type {Map<string, 'open' | 'closed'>} */
  const states = new Map();
  /** @type {string[]} */
  const trail = [];
  /** @param {string} path @returns {string[] | null} */
  const visit = (path) => {
    const source = paths.get(path);
    if (!source || states.get(path) === 'closed') return null;
    if (states.get(path) === 'open') return [...trail.slice(trail.indexOf(path)), path];
    states.set(path, 'open');
    trail.push(path);
    for (const { from } of importsOf(source)) {
      const found = visit(from.replace(/\.ts$/, '.js'));
      if (found) return found;
    }
    trail.pop();
    states.set(path, 'closed');
    return null;
  };
  for (const path of paths.keys()) {
    const found = visit(path);
    if (found) return found;
  }
  return null;
}

/** @param {string} folder @returns {Source[]} */
function readSources(folder) {
  const names = readdirSync(join(ROOT, folder), { recursive: true, encoding: 'utf8' });
  return names
    .filter((name) => name.endsWith('.ts'))
    .map((name) => `${folder}/${name.replaceAll('\\', '/')}`)
    .map((path) => ({ path, text: readFileSync(join(ROOT, path), 'utf8') }));
}

const page = readSources('www/src');
const sources = [...readSources('package'), ...page];

test('imports point one way', () => {
  assert.ok(sources.length > 300, `only ${sources.length} sources were found`);
  const count = sources.reduce((sum, source) => sum + importsOf(source).length, 0);
  assert.ok(count > 1000, `only ${count} imports were found: are they read rightly?`);
  assert.deepEqual(wrongDirections(sources), []);
});

test('no file imports itself by way of others', () => {
  assert.deepEqual(cycleAmong(sources), null);
});

test('one module imports the package of the engine, and only workers call it', () => {
  assert.deepEqual(packageUses(page), []);
});

test('a forbidden import is found', () => {
  const path = 'www/src/engine/made-up.ts';
  const upwards = { path, text: "/* import 'x' */\nimport type {\n  Row,\n} from '../views/rows.js';\n" };
  assert.deepEqual(wrongDirections([upwards]), [`${path}:2: engine must not import from views`]);
  const lazily = { path: 'www/src/planar/made-up.ts', text: "const x = await import('../spatial/session.js');\n" };
  assert.deepEqual(wrongDirections([lazily]), ['www/src/planar/made-up.ts:1: planar must not import from spatial']);
  const url = { path, text: "import url from '../bev/worker.ts?worker&url';\n" };
  assert.deepEqual(wrongDirections([url]), [`${path}:1: engine must not import from bev`]);
  const homeless = { path: 'www/src/attic/made-up.ts', text: '' };
  assert.deepEqual(wrongDirections([homeless]), ['www/src/attic/made-up.ts: attic has no place in LAYERS']);
  const lower = { path: 'package/files/made-up.ts', text: "import { understand } from '../recording/understand.js';" };
  assert.deepEqual(wrongDirections([lower]), ['package/files/made-up.ts:1: files must not import from recording']);
  const ofPage = { path: 'package/run/made-up.ts', text: "import type { Row } from '../../www/src/views/rows.js';" };
  assert.deepEqual(wrongDirections([ofPage]), ['package/run/made-up.ts:1: run must not import from views']);
  const ofNode = { path, text: "import { print } from '../../../package/cli/terminal.js';" };
  assert.deepEqual(wrongDirections([ofNode]), [`${path}:1: engine must not import from cli`]);
  const emitted = { path, text: "import { append } from '../../../npm/base/append.js';" };
  assert.deepEqual(wrongDirections([emitted]), [`${path}:1: engine must not import from npm/base/append.js`]);
  const words = { path, text: "// import '../views/rows.js'\n/** from '../views/rows.js' */\nconst a = 'views';\n" };
  assert.deepEqual(wrongDirections([words]), []);
});

test('a ring of imports is found', () => {
  const [a, b, c] = ['a', 'b', 'c'].map((name) => `www/src/views/${name}.ts`);
  assert.ok(a && b && c);
  const ring = [
    { path: a, text: "import { b } from './b.js';" },
    { path: b, text: "export * from './c.js';" },
    { path: c, text: "import type { A } from './a.js';" },
  ];
  assert.deepEqual(
    cycleAmong(ring),
    [a, b, c, a].map((path) => path.replace('.ts', '.js')),
  );
  assert.equal(cycleAmong(ring.slice(0, 2)), null);
});

test('a second home of the engine is found', () => {
  const path = 'www/src/bev/made-up.ts';
  const own = { path, text: "import init from '../../../pkg/scanstitch.js';" };
  assert.deepEqual(packageUses([own]), [`${path}:1: pkg/scanstitch.js is imported by www/src/engine/package.ts alone`]);
  const called = { path, text: "import { version } from '../engine/package.js';" };
  assert.deepEqual(packageUses([called]), [`${path}:1: only a worker calls the engine`]);
  const typed = { path, text: "import type { BevScene } from '../engine/package.js';" };
  assert.deepEqual(packageUses([typed]), []);
});
