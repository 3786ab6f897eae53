/// <reference types="node" />
/**
 * The element in one file: engine, workers and all views are inside, nothing else is fetched. For bundlers, notebooks and frames
 * that may not fetch anything. A classic script, which any of them can load; the samples of several megabytes are left out.
 */
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { gzipSync } from 'node:zlib';
import { build, defineConfig, type InlineConfig, type Plugin } from 'vite';

const MODE = 'standalone';
const WORKER = /\?worker&url$/;
const WORKERS = 'virtual:workers';
const PACKED = /\?packed$/;
const LARGE_SAMPLE = /import\.meta\.glob<string>\('[^']*\/samples\/(?:apartment|bev)\/[^)]*\)/g;

const shared: InlineConfig = {
  root: import.meta.dirname,
  mode: MODE,
  publicDir: false,
  // There is no address that others would count from.
  define: { 'import.meta.url': 'undefined' },
  build: { target: 'es2023', assetsInlineLimit: Number.POSITIVE_INFINITY, modulePreload: false },
};

/**
 * The workers share one script, kept as text: each is started from a blob that first says which of them it is. That of the small
 * engine is not among them.
 */
function workersInside(): Plugin {
  const folder = join(import.meta.dirname, 'src');
  const paths = readdirSync(folder, { recursive: true, encoding: 'utf8' })
    .filter((path) => path.endsWith('-worker.ts') && !path.endsWith('first-planar-worker.ts'))
    .map((path) => join(folder, path));
  return {
    name: 'workers-inside',
    enforce: 'pre',
    resolveId: (id) => (id === WORKERS ? id : null),
    async load(id) {
      if (id === WORKERS) return `export default ${JSON.stringify(await codeOfWorkers(paths))};`;
      if (!WORKER.test(id)) return null;
      const parts = `['self.scanstitch_worker=${paths.indexOf(id.replace(WORKER, ''))};', workers]`;
      return `import workers from '${WORKERS}';
        export default URL.createObjectURL(new Blob(${parts}, { type: 'text/javascript' }));`;
    },
  };
}

async function codeOfWorkers(paths: readonly string[]): Promise<string> {
  const starts = paths.map((path) => `() => import(${JSON.stringify(path)})`);
  const built = await build({
    ...shared,
    configFile: false,
    logLevel: 'error',
    plugins: [
      {
        name: 'one-of-the-workers',
        resolveId: (id) => (id === WORKERS ? id : null),
        load: (id) => (id === WORKERS ? `[${starts.join()}][self.scanstitch_worker]();` : null),
      },
    ],
    build: {
      ...shared.build,
      write: false,
      rolldownOptions: { input: WORKERS, output: { format: 'iife', codeSplitting: false } },
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

export default defineConfig({
  ...shared,
  plugins: [workersInside(), packedInside(), withoutLargeSamples()],
  resolve: { alias: { './engine-files.js': join(import.meta.dirname, 'src', 'engine', 'engine-inside.ts') } },
  build: {
    ...shared.build,
    outDir: 'dist/standalone',
    emptyOutDir: true,
    chunkSizeWarningLimit: 4000,
    rolldownOptions: {
      input: 'src/scanstitch-app.ts',
      output: {
        format: 'iife',
        codeSplitting: false,
        entryFileNames: 'scanstitch-app.js',
        // Loaded twice on a page, or on a server that renders pages, it does nothing.
        banner: "if (globalThis.customElements && !customElements.get('scanstitch-app'))",
      },
    },
  },
});
