/// <reference types="node" />
/**
 * The element of the package, with engine and workers inside its scripts, so that no bundler has to know of other files. The
 * samples of several megabytes are left out. By mode:
 *
 * - `standalone`: one classic script with everything, for pages, notebooks and frames that may not fetch anything.
 * - `module`: ES modules for bundlers. The first holds what planar scans need; the rest is imported when it is asked for.
 */
import { readdirSync, readFileSync } from 'node:fs';
import { basename, join } from 'node:path';
import { gzipSync } from 'node:zlib';
import { build, defineConfig, type InlineConfig, type Plugin } from 'vite';
import { oneScript } from './chunks.js';
import { scansAsRanges } from './ranges.js';

const WORKER = /\?worker&url$/;
const WORKERS = /^virtual:workers-(\d)$/;
/** The only one that the first planar scans need. */
const FIRST_WORKER = 'first-planar-worker.ts';
const PACKED = /\?packed$/;
/** What planar scans that a page names are shown by: compressed, pieces weigh more than a whole. */
const MODULES = [
  oneScript('first', ['scanstitch-app.ts']),
  oneScript('open', [
    'datasets/given.ts',
    'datasets/take-in.ts',
    'datasets/spatial-files.ts',
    '../../package/recording/understand.ts',
  ]),
];
const LARGE_SAMPLE = /import\.meta\.glob<string>\('[^']*\/samples\/(?:apartment|bev)\/[^)]*\)/g;

const FORMATS_ENGINE = { '#formats-engine': join(import.meta.dirname, 'src/engine/formats-engine-packed.ts') };

const shared: InlineConfig = {
  root: import.meta.dirname,
  publicDir: false,
  // There is no address that others would count from.
  define: { 'import.meta.url': 'undefined' },
  resolve: { alias: FORMATS_ENGINE },
  build: { target: 'es2023', assetsInlineLimit: Number.POSITIVE_INFINITY, modulePreload: false },
};

/**
 * Workers of a group share one script, kept as text: each is started from a blob that first says which of them it is.
 */
function workersInside(groups: readonly (readonly string[])[]): Plugin {
  return {
    name: 'workers-inside',
    enforce: 'pre',
    resolveId: (id) => (WORKERS.test(id) ? id : null),
    async load(id) {
      const [, number] = WORKERS.exec(id) ?? [];
      if (number) return `export default ${JSON.stringify(await codeOfWorkers(groups[Number(number)] ?? []))};`;
      if (!WORKER.test(id)) return null;
      const path = id.replace(WORKER, '');
      const group = groups.findIndex((paths) => paths.includes(path));
      const parts = `['self.scanstitch_worker=${groups[group]?.indexOf(path)};', workers]`;
      return `import workers from 'virtual:workers-${group}';
        export default URL.createObjectURL(new Blob(${parts}, { type: 'text/javascript' }));`;
    },
  };
}

function workerPaths(): string[] {
  const folder = join(import.meta.dirname, 'src');
  const names = readdirSync(folder, { recursive: true, encoding: 'utf8' });
  return names.filter((name) => name.endsWith('-worker.ts')).map((name) => join(folder, name));
}

async function codeOfWorkers(paths: readonly string[]): Promise<string> {
  const starts = paths.map((path) => `() => import(${JSON.stringify(path)})`);
  const input = 'virtual:one-of-the-workers';
  const built = await build({
    ...shared,
    configFile: false,
    logLevel: 'error',
    plugins: [
      {
        name: 'one-of-the-workers',
        resolveId: (id) => (id === input ? id : null),
        load: (id) => (id === input ? `[${starts.join()}][self.scanstitch_worker]();` : null),
      },
    ],
    build: {
      ...shared.build,
      write: false,
      rolldownOptions: { input, output: { format: 'iife', codeSplitting: false } },
    },
  });
  const [chunk] = 'output' in built ? built.output : [];
  if (chunk?.type !== 'chunk') throw new Error('the workers were not built');
  return chunk.code;
}

/** The engine, compressed: in a frame that fetches nothing no host does it. */
function packedInside(): Plugin {
  return {
    name: 'packed-inside',
    enforce: 'pre',
    async load(id) {
      if (!PACKED.test(id)) return null;
      const bytes = gzipSync(readFileSync(id.replace(PACKED, '')), { level: 9 });
      return `export default '${bytes.toString('base64')}';`;
    },
  };
}

function withoutLargeSamples(): Plugin {
  return {
    name: 'without-large-samples',
    enforce: 'pre',
    transform: (code, id) => (id.includes('/www/src/') ? code.replace(LARGE_SAMPLE, '({})') : null),
  };
}

export default defineConfig(({ mode }) => {
  const isModule = mode === 'module';
  const isFirst = (path: string): boolean => basename(path) === FIRST_WORKER;
  const paths = workerPaths();
  const others = paths.filter((path) => !isFirst(path));
  return {
    ...shared,
    plugins: [scansAsRanges, workersInside([others, paths.filter(isFirst)]), packedInside(), withoutLargeSamples()],
    resolve: {
      alias: {
        ...FORMATS_ENGINE,
        './engine-files.js': join(import.meta.dirname, `src/engine/engine-in-${isModule ? 'modules' : 'one-file'}.ts`),
      },
    },
    build: {
      ...shared.build,
      outDir: join('dist', mode),
      emptyOutDir: true,
      chunkSizeWarningLimit: 4000,
      ...(isModule && { lib: { entry: 'src/scanstitch-app.ts', formats: ['es'] } }),
      rolldownOptions: {
        input: 'src/scanstitch-app.ts',
        output: isModule
          ? { entryFileNames: '[name].js', chunkFileNames: '[name].js', codeSplitting: { groups: MODULES } }
          : {
              format: 'iife',
              codeSplitting: false,
              entryFileNames: 'scanstitch-app.js',
              // Loaded twice on a page, or on a server that renders pages, it does nothing.
              banner: "if (globalThis.customElements && !customElements.get('scanstitch-app'))",
            },
      },
    },
  };
});
