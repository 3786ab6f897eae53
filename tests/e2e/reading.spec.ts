/** What is assumed of depth images: shown, asked where it is open, changed, and compared with the ground truth. */
import { findWeakContrast } from './access.js';
import { recording, truth } from './spatial_recording.js';
import { expect, test } from './spatial_page.js';

const NUM_FRAMES = 8;
/** 16 bits over 10 m: what the size of rooms alone does not tell from other scales. */
const PER_METRE = 6553.5;

test('an open depth scale is asked for with pictures, and a wrong answer is found by the ground truth', async ({
  spatial,
  page,
}) => {
  await spatial.drop([...recording(NUM_FRAMES, 0, PER_METRE), truth(NUM_FRAMES)]);
  const { result } = await spatial.stitched();
  expect(result.depth_scale).toBeCloseTo(PER_METRE, 6);
  expect(result.suggestion).toBeNull();
  await expect(spatial.figures).toContainText('6553.5 values per metre (assumed; supported by the ground truth)');
  const question = page.getByRole('region', { name: 'Which size is right?' });
  await expect(question.getByRole('img', { name: /^From above, surfaces up to 4\D/ })).toBeVisible();
  const other = question.getByRole('button', { name: /4000 per metre/ });
  await expect(other.getByRole('img', { name: /^From above, surfaces up to 6\.6/ })).toBeVisible();
  expect(await page.evaluate(findWeakContrast)).toEqual([]);
  const [asked, map] = [await question.boundingBox(), await spatial.map.boundingBox()];
  expect(asked?.x, 'it lies beside the map').toBeGreaterThanOrEqual((map?.x ?? Infinity) + (map?.width ?? 0));

  await other.click();
  const wrong = await spatial.stitched();
  expect(wrong.result.depth_scale).toBeCloseTo(4000, 6);
  await expect(question).toBeHidden();
  const offer = page.getByRole('region', { name: 'The ground truth suggests another depth scale' });
  await expect(offer).toContainText(/The path is 1\.6\d times as long as the ground truth's/);
  await offer.getByRole('button', { name: 'Compute with depth_scale 6553.5' }).click();
  const right = await spatial.stitched();
  expect(right.result.comparison?.mean).toBeLessThanOrEqual(0.02);
  await expect(offer).toBeHidden();
});

test('what is assumed can be changed beside its figure, also on a phone in the dark', async ({ spatial, page }) => {
  await page.emulateMedia({ colorScheme: 'dark' });
  await page.setViewportSize({ width: 390, height: 780 });
  const files = recording(4).filter(({ name }) => !name.endsWith('.txt'));
  await spatial.drop(files);
  const { result } = await spatial.stitched();
  expect(result.assumptions.map(({ setting, value }) => [setting, Math.round(value)])).toEqual([
    ['depth_scale', 1000],
    ['fx', 131],
  ]);
  await page.getByRole('tab', { name: 'Result' }).click();
  await expect(spatial.figures).toContainText(
    'all good if the depth scale is 1000 raw values per metre and the focal length is 131.3 pixels, which nothing in the recording confirms',
  );
  // No figure's explanation is cut: a condition stands at the end of it.
  const cut = await spatial.figures
    .locator('.meaning')
    .evaluateAll((meanings) =>
      meanings
        .filter((meaning) => meaning.scrollHeight > meaning.clientHeight || meaning.scrollWidth > meaning.clientWidth)
        .map((meaning) => meaning.textContent),
    );
  expect(cut).toEqual([]);
  await expect(spatial.figures).toContainText(
    'depth: 1000 values per metre (assumed), rounded to whole values, focal length (assumed)',
  );
  await spatial.figures.getByRole('button', { name: 'Change what the good frames assume' }).click();
  const dialog = page.getByRole('dialog', { name: 'What is assumed of the depth images' });
  await expect(dialog.getByRole('radio', { name: /^1000 values per metre/ })).toBeChecked();
  expect(await page.evaluate(findWeakContrast)).toEqual([]);
  await dialog.getByRole('radio', { name: /^80 pixels, 90°/ }).check();
  await dialog.getByRole('spinbutton', { name: 'Depth scale, raw values per metre' }).fill('500');
  await dialog.getByRole('button', { name: 'Compute again' }).click();
  const changed = await spatial.stitched();
  expect([changed.result.depth_scale, changed.result.camera?.fx, changed.result.camera?.cx]).toEqual([500, 80, 79.5]);
  expect(changed.result.assumptions).toEqual([]);
  await expect(spatial.figures).not.toContainText('which nothing in the recording confirms');
});

test('a camera file dropped after the frames is used; one of other images is refused in plain words', async ({
  spatial,
  page,
}) => {
  const files = recording(4).filter(({ name }) => !name.endsWith('.txt'));
  await spatial.drop(files);
  const guessed = await spatial.stitched();
  expect(guessed.result.camera?.fx).toBeCloseTo(131.25, 6);
  const yaml = (width: number, height: number): string =>
    `image_width: ${width}\nimage_height: ${height}\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [${width / 2}, 0, ${width / 2}, 0, ${width / 2}, ${height / 2}, 0, 0, 1]\n`;
  await spatial.drop([{ name: 'color_info.yaml', content: yaml(1280, 720) }]);
  await expect(spatial.messages).toContainText(
    'This camera is for 1280 x 720 pixels, the depth images have 160 x 120. Give the camera of the depth images',
  );
  await spatial.drop([{ name: 'camera_info.yaml', content: yaml(320, 240) }]);
  await expect(spatial.messages).toContainText(
    "The camera of 320 x 240 pixels is scaled to the depth images' 160 x 120",
  );
  await expect.poll(async () => (await spatial.figures.textContent()) ?? '').toContain('160 × 120, 90°');
  await expect(page.getByRole('button', { name: 'Change what is assumed of the camera' })).toBeVisible();
});
