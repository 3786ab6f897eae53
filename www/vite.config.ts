/// <reference types="node" />
import { defineConfig, type Plugin } from 'vite';
import { offline } from './offline/plugin.js';

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

export default defineConfig({
  root: import.meta.dirname,
  base: './', // every address relative: the build works under any path of any static host
  publicDir: false,
  server: { fs: { allow: ['..'] } }, // pkg/ lies beside www/
  worker: { format: 'es' },
  plugins: [preloadEngine, offline()],
  build: {
    target: 'es2023',
    outDir: 'dist',
    emptyOutDir: true,
    assetsInlineLimit: 0, // scans stay files: they are fetched only when the sample is shown
    chunkSizeWarningLimit: 650, // kB; three.js, which only the view in space loads
    rolldownOptions: {
      input: { index: 'index.html', [ELEMENT]: `src/${ELEMENT}.ts` },
      output: {
        entryFileNames: ({ name }) => (name === ELEMENT ? '[name].js' : 'assets/[name]-[hash].js'),
      },
    },
  },
});
