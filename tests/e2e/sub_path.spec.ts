import type { Server } from 'node:http';
import type { AddressInfo } from 'node:net';
import { join } from 'node:path';
import { test } from '@playwright/test';
import { expect, ScanstitchPage } from './scanstitch_page.js';
import { serve } from './static_server.mjs';

const PREFIX = '/a/b/c/';

let server: Server;

test.beforeAll(async () => {
  server = await serve(join(import.meta.dirname, '..', '..', 'www', 'dist'), { prefix: PREFIX });
});

test.afterAll(() => {
  server.close();
});

test('the build stitches under a path of any static host', async ({ page }) => {
  const faults: string[] = [];
  page.on('requestfailed', (request) => faults.push(`${request.url()}: ${request.failure()?.errorText}`));
  page.on('response', (response) => {
    if (response.status() >= 400) faults.push(`${response.url()}: ${response.status()}`);
  });
  const app = new ScanstitchPage(page);
  const address = `http://localhost:${(server.address() as AddressInfo).port}${PREFIX}`;
  const { result } = await app.open(address);
  expect(result.frames).toHaveLength(10);
  expect(result.comparison?.mean).toBeLessThan(0.02);
  expect(await app.numPainted()).toBeGreaterThan(1000);

  // Workers that are started later find their scripts as well.
  await page.getByRole('button', { name: 'Evaluate' }).click();
  await expect(page.getByRole('table', { name: 'Estimates, ranked' }).getByRole('row')).toHaveCount(2);
  expect(faults).toEqual([]);
  expect(app.faults).toEqual([]);
});
