/**
 * The page as its tests see it: opened, fed with files, asked for what it shows. Everything here goes through what a
 * user has (the controls, a drop, the keyboard) and through the documented event of the element.
 */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test as base, expect, type Locator, type Page } from '@playwright/test';
import type { ReconstructionResult } from '../../pkg/scanstitch.js';

export { expect };

export const SAMPLE_FOLDER = join(import.meta.dirname, '../../www/samples/corridor');
export const ZJU_FOLDER = join(import.meta.dirname, '../../../shared/data/laser/zju10');

export interface InputFile {
  name: string;
  content: string | Buffer;
}

/** The detail of the element's event `scanstitch-done`. */
export interface Stitched {
  result: ReconstructionResult;
  timing: { total: number; frames: number[] };
  elapsed_ms: number;
}

declare global {
  interface Window {
    stitched: Stitched[];
  }
}

/** Every tool beside the map that has something to show at once, its element, and words that it shows once its worker and the engine are there. */
export const TOOL_RESULTS: readonly (readonly [tool: string, element: string, result: string])[] = [
  ['Evaluate', 'scanstitch-evaluate', '1 compared'],
  ["Bird's-eye view", 'scanstitch-bev', 'Polygon'],
  ['ICP', 'scanstitch-lab', 'Point to'],
  ['Strategies', 'scanstitch-strategies', 'Voxels 0.1 m'],
];

/** Drops files on an element, all at once. That they are dragged over it before is for warm_up.spec.ts. */
export async function dropOn(target: Locator, files: readonly InputFile[]): Promise<void> {
  const sent = files.map(({ name, content }) => ({ name, base64: Buffer.from(content).toString('base64') }));
  const dataTransfer = await target.page().evaluateHandle((given) => {
    const all = new DataTransfer();
    for (const { name, base64 } of given) {
      all.items.add(new File([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], name));
    }
    return all;
  }, sent);
  await target.dispatchEvent('drop', { dataTransfer });
}

/** What the browser remembers of a user who has unfolded every panel around the map. */
const ALL_PANELS = 'figures table details settings tabs';

export class ScanstitchPage {
  /** Errors of scripts on the page; a test fails on any that it does not expect. */
  readonly faults: string[] = [];
  /** How many computations of this page were waited for. */
  private numSeen = 0;

  /** `panels`: those that are unfolded already, as the browser remembers them. */
  constructor(
    readonly page: Page,
    private readonly panels = ALL_PANELS,
  ) {
    page.on('pageerror', (error) => this.faults.push(error.message));
  }

  /** Opens the page and waits for the sample. */
  async open(path = './'): Promise<Stitched> {
    await this.goto(path);
    return this.stitched();
  }

  /** Opens the page with nothing on it, as by `src="none"`. */
  async openEmpty(): Promise<void> {
    await this.page.addInitScript(() => {
      const observer = new MutationObserver(() => {
        const app = document.querySelector('scanstitch-app');
        app?.setAttribute('src', 'none');
        if (app) observer.disconnect();
      });
      observer.observe(document, { childList: true, subtree: true });
    });
    await this.goto('./');
    await expect(this.page.getByRole('heading', { name: /^(Drop|Open) laser scans/ })).toBeVisible();
  }

  /** Opens the page, whether or not anything is computed. */
  async goto(path: string): Promise<void> {
    await this.page.addInitScript((panels) => {
      window.stitched = [];
      addEventListener('scanstitch-done', (event) => window.stitched.push((event as CustomEvent).detail));
      // Frames without an origin have no storage.
      if (origin !== 'null' && localStorage['scanstitch-panels'] === undefined)
        localStorage['scanstitch-panels'] = panels;
    }, this.panels);
    await this.page.goto(path);
  }

  /** The next computation that has not been waited for yet: its map is on the screen. */
  async stitched(): Promise<Stitched> {
    const index = this.numSeen++;
    await this.page.waitForFunction((i) => window.stitched.length > i, index, { timeout: 0 }); // as long as a test may take
    return this.page.evaluate((i) => window.stitched[i] as Stitched, index);
  }

  /** How many computations came to their end so far. */
  async numStitched(): Promise<number> {
    return this.page.evaluate(() => window.stitched.length);
  }

  /** Drops files on the map, all at once. */
  async drop(files: readonly InputFile[]): Promise<void> {
    await dropOn(this.map, files);
  }

  get map(): Locator {
    return this.page.locator('scanstitch-map');
  }

  get stage(): Locator {
    return this.page.getByRole('group', { name: 'Map' });
  }

  get table(): Locator {
    return this.page.getByRole('table', { name: /Results per scan/ });
  }

  /** The row of a scan. */
  row(name: string): Locator {
    return this.table.getByRole('row').filter({ has: this.page.getByRole('button', { name, exact: true }) });
  }

  /** The names in the table, from the first row on. */
  async scanNames(): Promise<string[]> {
    return this.table.getByRole('rowheader').allInnerTexts();
  }

  get messages(): Locator {
    return this.page.getByRole('region', { name: 'Messages' });
  }

  get why(): Locator {
    return this.page.getByRole('complementary', { name: 'Details' });
  }

  setting(label: string): Locator {
    return this.page.getByLabel(label, { exact: true });
  }

  /** Number of pixels of the canvas whose colour is far from the corner's: points, paths, arrows. */
  async numPainted(): Promise<number> {
    return this.map.locator('canvas').evaluate((canvas: HTMLCanvasElement) => {
      const { data } = canvas.getContext('2d')?.getImageData(0, 0, canvas.width, canvas.height) ?? { data: [] };
      let count = 0;
      for (let i = 0; i < data.length; i += 4) {
        const difference =
          Math.abs((data[i] ?? 0) - (data[0] ?? 0)) +
          Math.abs((data[i + 1] ?? 0) - (data[1] ?? 0)) +
          Math.abs((data[i + 2] ?? 0) - (data[2] ?? 0));
        if (difference > 120) count++;
      }
      return count;
    });
  }

  /** What the read-out says of a place of the window, in whole pixels: "x 1.20 m y -0.35 m". */
  async worldAt(x: number, y: number): Promise<string> {
    await this.page.mouse.move(x, y);
    const words = await this.map.locator('.readout > span').allInnerTexts();
    return words.slice(0, 2).join(' ');
  }

  /** A place of the window, in whole pixels, so far from the upper left corner of the map. */
  async placeOnMap(right: number, down: number): Promise<[number, number]> {
    const box = await this.map.boundingBox();
    if (!box) throw new Error('The map has no size.');
    return [Math.round(box.x + right), Math.round(box.y + down)];
  }

  /** A digest of what the canvas shows, for telling whether it changed. */
  async picture(): Promise<string> {
    return this.map.locator('canvas').evaluate(async (canvas: HTMLCanvasElement) => {
      await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
      let hash = 0x811c9dc5; // FNV-1a
      for (const character of canvas.toDataURL()) hash = Math.imul(hash ^ character.charCodeAt(0), 0x01000193);
      return (hash >>> 0).toString(16);
    });
  }
}

/** How much wider than the window the page is (CSS pixels), once it has been laid out. */
export async function overflowOf(page: Page): Promise<number> {
  await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
  return page.locator('scanstitch-app').evaluate((app) => app.scrollWidth - innerWidth);
}

/** A test with the page open, and the sample stitched or nothing on it; script errors fail it. */
export const test = base.extend<{ app: ScanstitchPage; empty: ScanstitchPage }>({
  app: async ({ page }, use) => {
    const app = new ScanstitchPage(page);
    await app.open();
    await use(app);
    expect(app.faults).toEqual([]);
  },
  empty: async ({ page }, use) => {
    const app = new ScanstitchPage(page);
    await app.openEmpty();
    await use(app);
    expect(app.faults).toEqual([]);
  },
});

/** The sample's scans, from the first to the last. */
export function sampleScans(): InputFile[] {
  return Array.from({ length: 10 }, (_, i) => ({
    name: `${i}.ply`,
    content: readFileSync(join(SAMPLE_FOLDER, `${i}.ply`)),
  }));
}

/** The ten recorded scans. */
export function zjuScans(): InputFile[] {
  return Array.from({ length: 10 }, (_, i) => ({
    name: `${i}.ply`,
    content: readFileSync(join(ZJU_FOLDER, `${i}.ply`)),
  }));
}

/** An ASCII PLY file of these points. */
export function ply(points: readonly (readonly [number, number, number])[]): string {
  const rows = points.map((point) => point.join(' '));
  return [
    'ply',
    'format ascii 1.0',
    `element vertex ${points.length}`,
    'property double x',
    'property double y',
    'property double z',
    'end_header',
    ...rows,
    '',
  ].join('\n');
}

/** A rectangular room, `width` by `depth` m, seen from its middle, with a corner cut so that it looks like no other. */
export function room(width: number, depth: number): [number, number, number][] {
  return Array.from({ length: 180 }, (_, i) => {
    const angle = (i * Math.PI) / 90;
    const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
    const to_side = width / 2 / Math.max(Math.abs(cos), 1e-9);
    const to_end = depth / 2 / Math.max(Math.abs(sin), 1e-9);
    const range = Math.min(to_side, to_end) * (i > 20 && i < 40 ? 0.6 : 1);
    return [range * cos, range * sin, 0];
  });
}
