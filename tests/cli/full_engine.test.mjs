// @ts-check
/** The page of `npm start` before the full engine is compiled. */
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { test } from 'node:test';
import { createServer } from 'vite';
import { fullEngineLater } from '../../scripts/full_engine.mjs';
import { ROOT } from '../../scripts/steps.mjs';

/** @param {Promise<void>} compiled @param {(url: string, server: import('vite').ViteDevServer) => Promise<void>} check */
async function served(compiled, check) {
  const server = await createServer({
    root: join(ROOT, 'www'),
    logLevel: 'silent',
    optimizeDeps: { noDiscovery: true },
    plugins: [fullEngineLater(compiled, () => 'Compiling the full engine, 34 of 62, 12 s')],
    server: { host: 'localhost', port: 0, fs: { allow: [ROOT] }, watch: null },
  });
  try {
    await server.listen();
    await check(server.resolvedUrls?.local[0] ?? '', server);
  } finally {
    await server.close();
  }
}

test('the page is there at once; what only the full engine does waits for it', async () => {
  /** @type {() => void} */
  let compile = () => undefined;
  const compiled = /** @type {Promise<void>} */ (new Promise((resolve) => (compile = resolve)));
  await served(compiled, async (url, server) => {
    const page = await (await fetch(url)).text();
    assert.match(page, /src="\/dev\/engine-status\.ts"/);
    assert.equal((await fetch(`${url}src/engine/planar-package.ts`)).status, 200);
    // Its address is known while the file is not there.
    const absent = await server.pluginContainer.resolveId('../../../pkg/scanstitch_absent.wasm?url');
    assert.equal(absent?.id, join(ROOT, 'pkg', 'scanstitch_absent.wasm?url'));
    let isAnswered = false;
    const waiting = fetch(`${url}src/engine/package.ts`).then((response) => {
      isAnswered = true;
      return response.text();
    });
    const wasm = fetch(`${url}@fs${join(ROOT, 'pkg', 'scanstitch_bg.wasm')}`);
    // What is asked for later is answered sooner.
    assert.equal((await fetch(`${url}src/engine/engine-files.ts`)).status, 200);
    assert.equal(isAnswered, false);
    compile();
    assert.match(await waiting, /pkg\/scanstitch\.js/);
    assert.equal((await wasm).headers.get('content-type'), 'application/wasm');
  });
});

test('a full engine that cannot be compiled is refused, not waited for', async () => {
  await served(Promise.reject(new Error('no memory')), async (url) => {
    const response = await fetch(`${url}src/engine/package.ts`);
    assert.equal(response.status, 503);
    assert.equal(response.statusText, 'The full engine could not be compiled');
    assert.equal((await fetch(url)).status, 200);
  });
});
