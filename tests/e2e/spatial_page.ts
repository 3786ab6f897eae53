/** The view of depth images and clouds as its tests see it: through what a user has, and the documented event. */
import { expect, type Locator, type Page, test as base } from '@playwright/test';
import type { SpatialResult } from '../../pkg/scanstitch.js';
import { type InputFile, ScanstitchPage } from './scanstitch_page.js';

export { expect };

/** The detail of the event `scanstitch-done` of a run in space. */
export interface SpatialStitched {
  result: SpatialResult;
  timing: { total: number; frames: number[] };
  elapsed_ms: number;
}

/** Maps in space are not drawn on this page: graphics are emulated here, which costs more than all else. */
export async function drawNothing(page: Page): Promise<void> {
  await page.addInitScript(() => {
    for (const name of ['drawArrays', 'drawElements'] as const)
      WebGL2RenderingContext.prototype[name] = () => undefined;
  });
}

export class SpatialPage {
  constructor(
    readonly page: Page,
    readonly app = new ScanstitchPage(page),
  ) {}

  /** Opens the page with nothing on it. `draws`: a test looks at what is drawn. */
  async open({ draws = false } = {}): Promise<void> {
    if (!draws) await drawNothing(this.page);
    await this.app.openEmpty();
  }

  drop(files: readonly InputFile[]): Promise<void> {
    return this.app.drop(files);
  }

  /** The next computation that has not been waited for yet: its map is on the screen. */
  stitched(): Promise<SpatialStitched> {
    return this.app.stitched() as unknown as Promise<SpatialStitched>;
  }

  get map(): Locator {
    return this.page.locator('scanstitch-map3d');
  }

  get canvas(): Locator {
    return this.map.locator('canvas');
  }

  get figures(): Locator {
    return this.page.locator('scanstitch-spatial').getByLabel('Result in figures');
  }

  get panel(): Locator {
    return this.page.locator('scanstitch-frame-panel');
  }

  get messages(): Locator {
    return this.page.getByRole('region', { name: 'Messages' });
  }

  get table(): Locator {
    return this.page.getByRole('table', { name: /Results per frame/ });
  }

  get slider(): Locator {
    return this.page.getByRole('slider', { name: 'Frames shown' });
  }

  get section(): Locator {
    return this.page.getByRole('slider', { name: /^Section height/ });
  }

  /** Number of pixels of the map that are far from the background's colour, at the left of the buttons. */
  async numPainted(): Promise<number> {
    await this.settled();
    const picture = await this.canvas.screenshot();
    return this.page.evaluate(async (base64) => {
      const image = new Image();
      image.src = `data:image/png;base64,${base64}`;
      await image.decode();
      const canvas = new OffscreenCanvas(image.width, image.height);
      const context = canvas.getContext('2d');
      context?.drawImage(image, 0, 0);
      const { data } = context?.getImageData(0, 0, image.width, image.height) ?? { data: [] };
      let count = 0;
      for (let i = 0; i < data.length; i += 4) {
        const far = [0, 1, 2].reduce((sum, k) => sum + Math.abs((data[i + k] ?? 0) - (data[k] ?? 0)), 0);
        if (far > 100) count++;
      }
      return count;
    }, picture.toString('base64'));
  }

  /** The map as it is drawn, without what lies over it. */
  async picture(): Promise<string> {
    await this.settled();
    const style = '.controls, .corner, .section, .scale { opacity: 0 !important; }';
    return (await this.canvas.screenshot({ style })).toString('base64');
  }

  /** Waits until the map is drawn as it is to be: nothing is about to be drawn, and the view has stopped moving. */
  async settled(): Promise<void> {
    await this.page.evaluate(() => new Promise((resolve) => requestAnimationFrame(resolve)));
    await expect(this.map.getByRole('group', { name: 'Map' })).toHaveAttribute('aria-busy', 'false');
  }
}

async function useSpatial(page: Page, draws: boolean, use: (spatial: SpatialPage) => Promise<void>): Promise<void> {
  const spatial = new SpatialPage(page);
  await spatial.open({ draws });
  await use(spatial);
  expect(spatial.app.faults).toEqual([]);
}

/** A test with the page open and nothing on it; script errors fail it. `drawn`: maps are drawn. */
export const test = base.extend<{ spatial: SpatialPage; drawn: SpatialPage }>({
  spatial: ({ page }, use) => useSpatial(page, false, use),
  drawn: ({ page }, use) => useSpatial(page, true, use),
});
