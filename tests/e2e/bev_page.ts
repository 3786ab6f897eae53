/**
 * The bird's-eye view as its tests see it: opened, given pictures, clicked, asked for what it shows.
 */
import { readFileSync } from 'node:fs';
import { deflateSync } from 'node:zlib';
import { expect, type Locator, type Page, test as base } from '@playwright/test';
import type { BevPreset } from '../../pkg/scanstitch.js';
import * as engine from '../../npm/index.js';

export { engine, expect };

export interface Picture {
  name: string;
  mimeType: string;
  buffer: Buffer;
}

type Color = (u: number, v: number) => readonly [number, number, number];

/** A PNG file with these colours. */
export function picture(name: string, width: number, height: number, color: Color): Picture {
  const rows = Buffer.alloc(height * (1 + 3 * width));
  for (let v = 0; v < height; v++) {
    for (let u = 0; u < width; u++) rows.set(color(u, v), v * (1 + 3 * width) + 1 + 3 * u);
  }
  const header = Buffer.alloc(13);
  header.writeUInt32BE(width, 0);
  header.writeUInt32BE(height, 4);
  header.set([8, 2, 0, 0, 0], 8); // 8 bits, RGB
  const parts = [chunk('IHDR', header), chunk('IDAT', deflateSync(rows)), chunk('IEND', Buffer.alloc(0))];
  return { name, mimeType: 'image/png', buffer: Buffer.concat([Buffer.from('\x89PNG\r\n\x1a\n', 'latin1'), ...parts]) };
}

function chunk(type: string, data: Buffer): Buffer {
  const body = Buffer.concat([Buffer.from(type, 'latin1'), data]);
  const ends = Buffer.alloc(4);
  ends.writeUInt32BE(crc(body));
  const length = Buffer.alloc(4);
  length.writeUInt32BE(data.length);
  return Buffer.concat([length, body, ends]);
}

/** The checksum of PNG, bit by bit. */
function crc(bytes: Buffer): number {
  let sum = 0xffffffff;
  for (const byte of bytes) {
    sum ^= byte;
    for (let bit = 0; bit < 8; bit++) sum = sum & 1 ? (sum >>> 1) ^ 0xedb88320 : sum >>> 1;
  }
  return (sum ^ 0xffffffff) >>> 0;
}

/** A floor of 16 x 16 tiles in the top view; plain grey in the front view. */
export function pair(size: number): Picture[] {
  const tile = size / 16;
  const floor: Color = (u, v) => ((Math.floor(u / tile) + Math.floor(v / tile)) % 2 ? [230, 90, 40] : [40, 90, 230]);
  return [picture('top.png', size, size, floor), picture('front.png', size, size, () => [128, 128, 128])];
}

declare global {
  interface Window {
    /** What each drawing took (ms). */
    drawn: number[];
  }
}

export class BevPage {
  readonly faults: string[] = [];

  constructor(readonly page: Page) {
    page.on('pageerror', (error) => this.faults.push(error.message));
  }

  async open(address = './#bev'): Promise<void> {
    await this.page.addInitScript(() => {
      window.drawn = [];
      addEventListener('scanstitch-projected', (event) => window.drawn.push((event as CustomEvent).detail.elapsed_ms));
    });
    await this.page.goto(address);
    await this.drawn(0);
  }

  /** Waits until something was drawn after this many times. */
  async drawn(before: number): Promise<void> {
    // At every frame: a test clicks often, and would wait a tenth of a second each time to ask again.
    await this.page.waitForFunction((before) => window.drawn.length > before, before, { timeout: 60_000 });
  }

  async numDrawn(): Promise<number> {
    return this.page.evaluate(() => window.drawn.length);
  }

  get view(): Locator {
    return this.page.locator('scanstitch-bev');
  }

  /** The middle of a pixel on the screen. */
  async place(role: 'top' | 'front', u: number, v: number): Promise<[number, number]> {
    const picture = this.page.locator(`scanstitch-bev-picture#${role}`);
    const [width, height] = await picture.evaluate((one: HTMLElement & { width: number; height: number }) => [
      one.width,
      one.height,
    ]);
    const box = await picture.locator('.marks').boundingBox();
    if (!box) throw new Error('The picture has no size.');
    return [box.x + ((u + 0.5) * box.width) / (width ?? 1), box.y + ((v + 0.5) * box.height) / (height ?? 1)];
  }

  async click(role: 'top' | 'front', u: number, v: number): Promise<void> {
    const before = await this.numDrawn();
    await this.page.mouse.click(...(await this.place(role, u, v)));
    await this.drawn(before);
  }

  async load(files: Picture[] | string[]): Promise<void> {
    await this.page.locator('#pick').setInputFiles(files);
  }

  async choose(menu: 'Open' | 'Export', item: RegExp): Promise<void> {
    await this.view.getByRole('button', { name: menu, exact: true }).click();
    await this.page.getByRole('menuitem', { name: item }).click();
  }

  async download(item: RegExp): Promise<Buffer> {
    const saving = this.page.waitForEvent('download');
    await this.choose('Export', item);
    return readFileSync((await (await saving).path()) as string);
  }

  get rows(): Locator {
    return this.page.getByRole('table', { name: 'Points and their projections' }).locator('tbody tr');
  }

  /** What the table says of the projections. */
  async projections(): Promise<string[]> {
    const cells = await this.rows.evaluateAll((rows) =>
      rows.map((row) => [...row.querySelectorAll('.front')].map((cell) => cell.textContent).join(' ')),
    );
    return cells;
  }

  /** Colour of a pixel of a layer of a picture. */
  async colorAt(role: 'top' | 'front', layer: 'base' | 'warp', u: number, v: number): Promise<number[]> {
    return this.page
      .locator(`scanstitch-bev-picture#${role} .${layer}`)
      .evaluate(
        (canvas: HTMLCanvasElement, [u, v]) => [...(canvas.getContext('2d')?.getImageData(u, v, 1, 1).data ?? [])],
        [u, v] as const,
      );
  }
}

/** A test with the view open on the worked numbers; script errors fail it. */
export const test = base.extend<{ bev: BevPage }>({
  bev: async ({ page }, use) => {
    await page.setViewportSize({ width: 1600, height: 1100 }); // room for pictures in their full size
    await engine.load();
    const bev = new BevPage(page);
    // By a link: the sample's pictures would be fetched, and warped, before another scene is opened.
    const { scene } = presetNamed('homework_numbers');
    await bev.open(`./#bev=${Buffer.from(JSON.stringify({ scene })).toString('base64url')}`);
    await use(bev);
    expect(bev.faults).toEqual([]);
  },
});

/** A scene to begin with. The engine is loaded once a test has begun. */
export function presetNamed(name: string): BevPreset {
  const found = engine.bev_presets().find((preset) => preset.name === name);
  if (!found) throw new Error(`There is no preset ${name}.`);
  return found;
}
