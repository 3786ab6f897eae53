/** Links to a scene that somebody has changed: told, and the view goes on with a scene that is whole. */
import { expect, ScanstitchPage, test } from './scanstitch_page.js';

const LINKS = {
  'no scene': {},
  'an empty scene': { scene: {} },
  'cameras without anything': { scene: { top: {}, front: {} } },
  'lists in place of cameras': { scene: { top: [], front: null }, points: [[1]], pairs: [null] },
};

test('a link that somebody has changed is told, and a whole scene is shown', async ({ page }) => {
  const app = new ScanstitchPage(page);
  for (const [name, content] of Object.entries(LINKS)) {
    await page.goto('about:blank');
    await page.goto(`./#bev=${Buffer.from(JSON.stringify(content)).toString('base64url')}`);
    await expect(page.getByRole('alert'), name).toContainText(/link/i);
    await expect(page.getByRole('region', { name: 'Sketch' }), name).toBeVisible();
  }
  expect(app.faults).toEqual([]);
});
