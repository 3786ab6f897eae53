/// <reference types="node" />
import { defineConfig, type Plugin } from 'vite';
import { FORMATS_ENGINE, oneScript } from './chunks.js';
import { offline } from './offline/plugin.js';
import { scansAsRanges } from './ranges.js';

/** The file a course page loads: `<script type="module" src=".../scanstitch-app.js">`. Its name carries no hash. */
const ELEMENT = 'scanstitch-app';

/** What the page begins with once its scripts run: fetched along with them. */
const FIRST_ENGINE = /scanstitch_planar_bg.*\.wasm$/;

const preloadEngine: Plugin = {
  name: 'preload-engine',
  transformIndexHtml: {
    order: 'post',
    handler: (_, { bundle = {} }) =>
      Object.keys(bundle)
        .filter((file) => FIRST_ENGINE.test(file))
        .map((file) => ({
          tag: 'link',
          attrs: { rel: 'preload', as: 'fetch', crossorigin: true, href: `./${file}` },
        })),
  },
};

/** The name of the script with all that the page begins with. */
const FIRST = 'first';
/** Chromium compiles it while it arrives, and not function by function: the sample stands in 0.96 of the time (twelve loads). */
const COMPILED_AT_ONCE = '//# allFunctionsCalledOnLoad';

const compileAtOnce: Plugin = {
  name: 'compile-at-once',
  generateBundle: {
    order: 'post',
    handler: (_, bundle) => {
      for (const chunk of Object.values(bundle)) {
        if (chunk.type === 'chunk' && chunk.name === FIRST) chunk.code = `${COMPILED_AT_ONCE}\n${chunk.code}`;
      }
    },
  },
};

export default defineConfig({
  root: import.meta.dirname,
  base: './', // every address relative: the build works under any path of any static host
  publicDir: false,
  server: { fs: { allow: ['..'] } }, // pkg/ lies beside www/
  resolve: { alias: FORMATS_ENGINE },
  worker: { format: 'es' },
  plugins: [scansAsRanges, preloadEngine, compileAtOnce, offline()],
  build: {
    target: 'es2023',
    outDir: 'dist',
    emptyOutDir: true,
    assetsInlineLimit: 0, // scans stay files: they are fetched only when the sample is shown
    modulePreload: { polyfill: false }, // every browser that runs the engine knows it
    chunkSizeWarningLimit: 650, // kB; three.js, which only the view in space loads
    rolldownOptions: {
      input: { index: 'index.html', [ELEMENT]: `src/${ELEMENT}.ts` },
      output: {
        codeSplitting: { groups: [oneScript(FIRST, [`${ELEMENT}.ts`])] },
        entryFileNames: ({ name }) => (name === ELEMENT ? '[name].js' : 'assets/[name]-[hash].js'),
      },
    },
  },
});
