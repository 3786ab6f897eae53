/** A frame of a run in space, looked into: against the map that it was registered to. */
import { expect, type Locator } from '@playwright/test';
import { recording } from './spatial_recording.js';
import { test } from './spatial_page.js';

test('a frame is registered to the map of the frames before it, and to any other', async ({ spatial, page }) => {
  test.slow();
  await spatial.drop(recording(4));
  await spatial.stitched();
  await spatial.slider.focus();
  await page.keyboard.press('Home');
  for (let i = 0; i < 3; i++) await page.keyboard.press('ArrowRight');
  await expect(spatial.panel.getByRole('heading', { level: 2 })).toHaveText('4.png');
  await page.getByRole('button', { name: 'Look inside' }).click();
  const lab: Locator = page.locator('scanstitch-lab');
  const heading = lab.getByRole('tabpanel').getByRole('heading', { level: 2 });
  await expect(heading).toHaveText('At the start', { timeout: 60_000 });
  const [source, target] = [lab.getByLabel('Source').first(), lab.getByLabel('Target').first()];
  await expect(source).toHaveValue(/4\.png$/);
  await expect(target).toHaveValue('map of 3 frames');
  await lab.getByRole('button', { name: 'One iteration on (.)' }).click();
  await expect(heading).toHaveText(/^(After iteration 1|At the end)$/);
  await lab.getByRole('application', { name: 'The two clouds' }).focus();
  await page.keyboard.press('End');
  await expect(heading).toHaveText('At the end');
  await target.selectOption({ label: '3.png' });
  await expect(heading).toHaveText('At the start', { timeout: 60_000 });
});
