import type { Server } from 'node:http';
import type { AddressInfo } from 'node:net';
import { join } from 'node:path';
import { expect, test } from '@playwright/test';
import { serve } from './static_server.mjs';

const PREFIX = '/a/b/c/';

let server: Server;

test.beforeAll(async () => {
  server = await serve(join(import.meta.dirname, '..', '..', 'www', 'dist'), { prefix: PREFIX });
});

test.afterAll(() => {
  server.close();
});

test('the build works under a path of any static host', async ({ page }) => {
  const faults: string[] = [];
  page.on('pageerror', (error) => faults.push(error.message));
  page.on('requestfailed', (request) => faults.push(`${request.url()}: ${request.failure()?.errorText}`));
  const engines: string[] = [];
  page.on('response', (response) => {
    if (response.status() >= 400) faults.push(`${response.url()}: ${response.status()}`);
    if (response.url().endsWith('.wasm')) engines.push(response.url());
  });

  await page.goto(`http://localhost:${(server.address() as AddressInfo).port}${PREFIX}`);
  await page.waitForFunction(() => customElements.get('scanstitch-app') !== undefined);
  await expect.poll(() => engines.length, { message: 'the engine is fetched' }).toBeGreaterThan(0);
  await page.waitForLoadState('networkidle');
  expect(faults).toEqual([]);
});
