/** The engine draws on a host's canvas: compared with the page's own picture of the same scans. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Page } from '@playwright/test';
import type * as Api from '../../npm/index.js';
import { expect, sampleScans, test } from './scanstitch_page.js';
import { recording } from './spatial_recording.js';

const ROOT = join(import.meta.dirname, '..', '..');
const TYPES: Record<string, string> = { '.js': 'text/javascript', wasm: 'application/wasm' };
/** What the page leaves free around its map, and what is left free here. */
const [TOP, RIGHT, BOTTOM, LEFT] = [36, 64, 52, 36];
const MARGIN = 24;

/** The package lies beside the page, as a host's own script would find it. */
async function servePackage(page: Page): Promise<void> {
  await page.route('**/package/**', (route) => {
    const path = new URL(route.request().url()).pathname.split('/package/')[1] ?? '';
    const contentType = TYPES[path.slice(path.lastIndexOf('.'))] ?? TYPES[path.slice(-4)] ?? 'text/plain';
    return route.fulfill({ contentType, body: readFileSync(join(ROOT, path)) });
  });
}

test('of laser scans, the same picture as on the page', async ({ app, page }) => {
  await servePackage(page);
  // The page draws the ground truth as well.
  await page.getByRole('button', { name: /^Remove the ground truth/ }).click();
  await app.stitched();
  const told = await page.evaluate(
    async ({ scans, margins: [top, right, bottom, left], margin }) => {
      const module = './package/npm/browser.js';
      const { load, Reconstruction } = (await import(new URL(module, location.href).href)) as typeof Api;
      await load();
      const reconstruction = new Reconstruction();
      for (const { name, bytes } of scans) reconstruction.add_scan(name, Uint8Array.from(bytes));
      while (reconstruction.step().stage !== 'done');
      const shown = document
        .querySelector('scanstitch-app')
        ?.shadowRoot?.querySelector('scanstitch-planar')
        ?.shadowRoot?.querySelector('scanstitch-map')
        ?.shadowRoot?.querySelector('canvas') as HTMLCanvasElement;
      const canvas = document.createElement('canvas');
      canvas.width = shown.width - left - right + 2 * margin;
      canvas.height = shown.height - top - bottom + 2 * margin;
      reconstruction.draw(canvas, { margin });
      const offscreen = new OffscreenCanvas(canvas.width, canvas.height);
      reconstruction.draw(offscreen, { margin });
      const mine = pixelsOf(canvas);
      const theirs = pixelsOf(shown);
      const [dx, dy] = [left - margin, top - margin];
      const same = pixelsOf(offscreen).data.every((value, i) => value === mine.data[i]);
      return { there: share(mine, theirs, dx, dy), back: share(theirs, mine, -dx, -dy), same };

      function pixelsOf(of: HTMLCanvasElement | OffscreenCanvas): ImageData {
        const context = of.getContext('2d') as CanvasRenderingContext2D;
        return context.getImageData(0, 0, of.width, of.height);
      }
      function colorAt({ data, width, height }: ImageData, x: number, y: number): number[] {
        if (x < 0 || y < 0 || x >= width || y >= height) return [];
        return [...data.slice(4 * (y * width + x), 4 * (y * width + x) + 3)];
      }
      /** Of the coloured pixels, how many have one of about the same colour within a pixel in the other picture. */
      function share(one: ImageData, other: ImageData, dx: number, dy: number): { count: number; share: number } {
        let [count, found] = [0, 0];
        for (let y = 0; y < one.height; y++) {
          for (let x = 0; x < one.width; x++) {
            const color = colorAt(one, x, y);
            const isOutside = colorAt(other, x + dx, y + dy).length === 0;
            if (isOutside || Math.max(...color) - Math.min(...color) < 90) continue;
            count++;
            const near = [-1, 0, 1].some((i) =>
              [-1, 0, 1].some((j) => {
                const there = colorAt(other, x + dx + i, y + dy + j);
                return there.length > 0 && there.every((value, k) => Math.abs(value - (color[k] ?? 0)) < 48);
              }),
            );
            if (near) found++;
          }
        }
        return { count, share: found / count };
      }
    },
    {
      scans: sampleScans().map(({ name, content }) => ({ name, bytes: [...Buffer.from(content)] })),
      margins: [TOP, RIGHT, BOTTOM, LEFT] as [number, number, number, number],
      margin: MARGIN,
    },
  );
  expect(told.same).toBe(true);
  for (const { count } of [told.there, told.back]) expect(count).toBeGreaterThan(1500);
  expect(
    [told.there.share, told.back.share].map((share) => share > 0.95),
    JSON.stringify(told),
  ).toEqual([true, true]);
  expect(app.faults).toEqual([]);
});

test('of depth images from above, and what cannot be drawn on', async ({ page, app }) => {
  await servePackage(page);
  const files = recording(3).map(({ name, content }) => ({ name, bytes: [...Buffer.from(content)] }));
  const told = await page.evaluate(async (given) => {
    const module = './package/npm/browser.js';
    const { load, prepare_frame, SpatialReconstruction } = (await import(
      new URL(module, location.href).href
    )) as typeof Api;
    await load();
    const bytesOf = (part: string, i: number): Uint8Array =>
      Uint8Array.from(given.find(({ name }) => name === `room/${part}/${i + 1}.png`)?.bytes ?? []);
    const reconstruction = new SpatialReconstruction({ fx: 80, fy: 80 });
    const config = reconstruction.begin('1.png', bytesOf('depth', 0));
    for (let i = 0; i < 3; i++) {
      reconstruction.add_prepared(prepare_frame(config, `${i}.png`, i, undefined, bytesOf('depth', i)));
      reconstruction.step();
    }
    while (reconstruction.step().stage !== 'done');
    const canvas = new OffscreenCanvas(300, 240);
    const colored = (): number => {
      const { data } = (canvas.getContext('2d') as OffscreenCanvasRenderingContext2D).getImageData(0, 0, 300, 240);
      let count = 0;
      for (let i = 0; i < data.length; i += 4) if (Math.abs((data[i] ?? 0) - (data[i + 2] ?? 0)) > 40) count++;
      return count;
    };
    reconstruction.draw(canvas);
    const numAll = colored();
    reconstruction.draw(canvas, { max_height: -9 });
    const num_low = colored();
    const error = (draw: () => void): string => {
      try {
        draw();
        return '';
      } catch (thrown) {
        return (thrown as Error).message;
      }
    };
    const taken = new OffscreenCanvas(4, 4);
    taken.getContext('bitmaprenderer');
    const errors = [
      error(() => reconstruction.draw({} as OffscreenCanvas)),
      error(() => reconstruction.draw(taken)),
      error(() => reconstruction.draw(new OffscreenCanvas(0, 4))),
      error(() => reconstruction.draw(canvas, { colour: 'red' } as never)),
    ];
    return { numAll, num_low, errors };
  }, files);
  expect(told.numAll).toBeGreaterThan(1000);
  expect(told.num_low).toBeLessThan(told.numAll / 2);
  const [first, second, third, fourth] = told.errors;
  expect(first).toContain('is not a canvas');
  expect(second).toContain('a context of another kind');
  expect(third).toContain('no size');
  expect(fourth).toContain('unknown field `colour`');
  expect(app.faults).toEqual([]);
});
