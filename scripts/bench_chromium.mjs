// @ts-check
/**
 * Times one benchmark compiled to WebAssembly in Chromium, as bench_wasm.mjs does under Node: the same arguments, the
 * same two lines. `node bench_chromium.mjs PKG_DIR NAME WARM_UP_MS SAMPLE_MS SAMPLES [FILE]...`
 */
import { readFile } from 'node:fs/promises';
import { join } from 'node:path';
import { chromium } from '@playwright/test';
import { findChromium } from './steps.mjs';

const [folder = '', name = '', warm_up, sample, samples, ...files] = process.argv.slice(2);
const ORIGIN = 'http://bench.invalid'; // answered here, never looked up
const browser = await chromium.launch({ executablePath: findChromium() ?? 'chromium', args: ['--no-sandbox'] });
try {
  const page = await browser.newPage();
  const served = new Map([
    ['/', ['text/html', '<!doctype html>']],
    ['/glue.js', ['text/javascript', join(folder, 'scanstitch_bench.js')]],
    ['/engine.wasm', ['application/wasm', join(folder, 'scanstitch_bench_bg.wasm')]],
    ['/samples.js', ['text/javascript', join(import.meta.dirname, 'bench_samples.mjs')]],
    .../** @type {[string, string[]][]} */ (
      files.map((file, index) => [`/file/${index}`, ['application/octet-stream', file]])
    ),
  ]);
  await page.route(`${ORIGIN}/**`, async (route) => {
    const [contentType = '', path = ''] = served.get(new URL(route.request().url()).pathname) ?? [];
    if (contentType === '') return route.fulfill({ status: 404 });
    return route.fulfill({ contentType, body: path.startsWith('<') ? path : await readFile(path) });
  });
  await page.goto(`${ORIGIN}/`);
  const result = await page.evaluate(
    async ({ name, files, policy }) => {
      const [glue, { takeSamples }] = await Promise.all(['/glue.js', '/samples.js'].map((url) => import(url)));
      await glue.default({ module_or_path: '/engine.wasm' });
      const bytes = files.map(async (_, index) => {
        const response = await fetch(`/file/${index}`);
        return new Uint8Array(await response.arrayBuffer());
      });
      const benchmark = new glue.PreparedBenchmark(name, files, await Promise.all(bytes));
      return { work: benchmark.work(), nanoseconds: /** @type {number[]} */ (takeSamples(benchmark, policy)) };
    },
    { name, files, policy: { warm_up_ms: Number(warm_up), sample_ms: Number(sample), samples: Number(samples) } },
  );
  console.log(result.work);
  console.log(result.nanoseconds.map((sample) => sample.toFixed(1)).join(' '));
} finally {
  await browser.close();
}
