/// <reference types="node" />
/**
 * The element in one file: engine, workers and all views are inside, nothing else is fetched. For bundlers, notebooks and frames
 * that may not fetch anything. A classic script, which any of them can load; the samples of several megabytes are left out.
 */
import { build, defineConfig, type InlineConfig, type Plugin } from 'vite';

const MODE = 'standalone';
const WORKER = /\?worker&url$/;
const LARGE_SAMPLE = /import\.meta\.glob<string>\('[^']*\/samples\/(?:apartment|bev)\/[^)]*\)/g;

const shared: InlineConfig = {
  root: import.meta.dirname,
  mode: MODE,
  publicDir: false,
  // There is no address that others would count from.
  define: { 'import.meta.url': 'undefined' },
  build: { target: 'es2023', assetsInlineLimit: Number.POSITIVE_INFINITY, modulePreload: false },
};

/** A worker is a script of its own, kept as text, and started from a blob. */
function workersInside(): Plugin {
  return {
    name: 'workers-inside',
    enforce: 'pre',
    async load(id) {
      if (!WORKER.test(id)) return null;
      const code = await codeOfWorker(id.replace(WORKER, ''));
      const blob = `new Blob([${JSON.stringify(code)}], { type: 'text/javascript' })`;
      return `export default URL.createObjectURL(${blob});`;
    },
  };
}

async function codeOfWorker(input: string): Promise<string> {
  const options = { input, output: { format: 'iife' as const, codeSplitting: false } };
  const built = await build({
    ...shared,
    configFile: false,
    logLevel: 'error',
    build: { ...shared.build, write: false, rolldownOptions: options },
  });
  const [chunk] = 'output' in built ? built.output : [];
  if (chunk?.type !== 'chunk') throw new Error(`${input} was not built`);
  return chunk.code;
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
  plugins: [workersInside(), withoutLargeSamples()],
  build: {
    ...shared.build,
    outDir: 'dist/standalone',
    emptyOutDir: true,
    chunkSizeWarningLimit: 8000,
    rolldownOptions: {
      input: 'src/scanstitch-app.ts',
      output: { format: 'iife', codeSplitting: false, entryFileNames: 'scanstitch-app.js' },
    },
  },
});
