/// <reference types="node" />
import { createHash } from 'node:crypto';
import { readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join, relative, sep } from 'node:path';
import type { Plugin } from 'vite';

const NAME = 'scanstitch-offline.js';

/** Writes the service worker beside the page, with the names of all that was built: it is kept as a whole. */
export function offline(): Plugin {
  let folder = '';
  return {
    name: 'scanstitch-offline',
    apply: 'build',
    configResolved({ root, build }) {
      folder = join(root, build.outDir);
    },
    closeBundle: {
      order: 'post',
      handler() {
        const entries = readdirSync(folder, { recursive: true, withFileTypes: true });
        const paths = entries
          .filter((entry) => entry.isFile() && entry.name !== NAME)
          .map((entry) => relative(folder, join(entry.parentPath, entry.name)).split(sep).join('/'))
          .toSorted();
        const digest = createHash('sha256');
        for (const path of paths) digest.update(path).update(readFileSync(join(folder, path)));
        const head = `const VERSION = '${digest.digest('hex').slice(0, 16)}';\nconst FILES = ${JSON.stringify(paths)};\n`;
        writeFileSync(join(folder, NAME), head + readFileSync(join(import.meta.dirname, 'service-worker.js'), 'utf8'));
      },
    },
  };
}
