/** Bags of ROS 2 in the page: dropped, listed, and with other topics. */
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Page } from '@playwright/test';
import { db3Bytes, mcapBytes } from '../cli/bag_files.mjs';
import { cameraInfo, image, laserScan, poseStamped, type stampAt } from '../cli/bag_messages.mjs';
import { expectNamedControls, findWeakContrast } from './access.js';
import { expect, SpatialPage, test } from './spatial_page.js';
import { FOCAL, HEIGHT, render, walk, WIDTH } from './spatial_recording.js';

const BAGS = join(import.meta.dirname, '../../../shared/data/bags');
const TOPICS = [
  { name: '/cam/depth/image_raw', type: 'sensor_msgs/msg/Image' },
  { name: '/cam/color/image_raw', type: 'sensor_msgs/msg/Image' },
  { name: '/cam/depth/camera_info', type: 'sensor_msgs/msg/CameraInfo' },
  { name: '/ground_truth', type: 'geometry_msgs/msg/PoseStamped' },
  { name: '/wheels', type: 'geometry_msgs/msg/PoseStamped' },
  { name: '/scan', type: 'sensor_msgs/msg/LaserScan' },
  { name: '/chatter', type: 'std_msgs/msg/String' },
];
type Stamp = ReturnType<typeof stampAt>;

/** The room of the other tests as a camera's messages; depth in metres. */
function messages(num_frames: number): Parameters<typeof mcapBytes>[1] {
  const shape = { width: WIDTH, height: HEIGHT };
  return walk(num_frames).flatMap((pose, i) => {
    const stamp: Stamp = { sec: 100 + i, nsec: 0 };
    const time = BigInt(stamp.sec) * 1_000_000_000n;
    const { depth, color } = render(pose);
    const metres = Float32Array.from(depth, (value) => value / 1000);
    const truth: [number, number, number, number, number, number, number] = [
      ...[pose.x, 0, pose.z, 0],
      ...[Math.sin(pose.heading / 2), 0, Math.cos(pose.heading / 2)],
    ] as never;
    const camera: [number, number, number, number] = [FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2];
    const data = new Uint8Array(metres.buffer);
    return [
      { topic: '/cam/depth/image_raw', time, data: image({ stamp, ...shape, encoding: '32FC1', data }) },
      { topic: '/cam/color/image_raw', time, data: image({ stamp, ...shape, encoding: 'rgb8', data: color }) },
      { topic: '/cam/depth/camera_info', time, data: cameraInfo(stamp, WIDTH, HEIGHT, camera) },
      { topic: '/ground_truth', time, data: poseStamped(stamp, 'world', truth) },
      { topic: '/wheels', time, data: poseStamped(stamp, 'world', [i, 0, 0, 0, 0, 0, 1]) },
      { topic: '/scan', time, data: laserScan(stamp, -1, 0.1, [0.1, 9], [1, 2, 3]) },
      { topic: '/chatter', time, data: Uint8Array.of(0, 1, 0, 0, 1, 0, 0, 0, 0) },
    ];
  });
}

test('a bag of ROS 1 packed by bzip2 is the same as one that is not', async ({ spatial }) => {
  const results = [];
  for (const packing of ['none', 'bz2']) {
    const content = readFileSync(join(import.meta.dirname, `../data/bags/ros1_${packing}.bag`));
    await spatial.drop([{ name: 'drive.bag', content }]);
    const { frames } = (await spatial.stitched()).result;
    expect(frames).toHaveLength(12);
    results.push(frames.map(({ name, status, T_world_sensor }) => ({ name, status, T_world_sensor })));
  }
  expect(results[1]).toEqual(results[0]);
});

for (const [name, bytes] of [
  ['room.mcap', mcapBytes],
  ['room.db3', db3Bytes],
] as const) {
  test(`a bag is dropped, listed and mapped: ${name}`, async ({ spatial, page }) => {
    await spatial.drop([{ name, content: Buffer.from(bytes(TOPICS, messages(6))) }]);
    const { result } = await spatial.stitched();
    expect(result.frames.map(({ status }) => status)).toEqual(Array(6).fill('good'));
    expect(result.camera).toMatchObject({ width: WIDTH, height: HEIGHT, fx: FOCAL });
    expect(result.comparison?.num_matched).toBe(6);
    expect(result.comparison?.mean).toBeLessThan(0.02);
    const panel = page.getByRole('region', { name: 'Topics of the bag' });
    await expect(panel).toContainText('depth images /cam/depth/image_raw');
    await expect(panel).toContainText('colours /cam/color/image_raw');
    await expect(panel).toContainText('ground truth /ground_truth');
    await panel.getByRole('button', { name: '7 topics' }).click();
    const chatter = panel.getByRole('row', { name: /\/chatter/ });
    await expect(chatter).toContainText('Messages of this type are not used');
    await expect(panel.getByRole('row', { name: /\/cam\/depth\/image_raw/ })).toContainText('160 x 120, 32FC1');
    // The picture in the panel is the bag's colour image.
    await expect(spatial.panel.getByRole('img').first()).toBeVisible();
  });
}

/** From when the panel of the topics is there, files of the disk do not answer; returns what lets them. */
async function holdReading(page: Page): Promise<() => Promise<void>> {
  await page.evaluate(() => {
    const read = Blob.prototype.arrayBuffer;
    const gate = new Promise<void>((resolve) => Object.assign(window, { let_read: resolve }));
    Blob.prototype.arrayBuffer = async function (this: Blob) {
      const app = document.querySelector('scanstitch-app');
      if (app?.shadowRoot?.querySelector('scanstitch-topics')) await gate;
      return read.call(this);
    };
  });
  return () => page.evaluate(() => (window as unknown as { let_read: () => void }).let_read());
}

for (const [what, isCut, words] of [
  ['whose messages are inspected', false, /^Inspecting /],
  ['that was cut off', true, /^The bag has no index: reading all of it, \d+ %/],
] as const) {
  test(`a bag ${what} can be cancelled, and what was open stays`, async ({ spatial, page }) => {
    const bag = Buffer.from(mcapBytes(TOPICS, messages(6), { chunkBytes: 2 ** 17 }));
    const content = isCut ? bag.subarray(0, Math.floor(0.9 * bag.length)) : bag;
    const panel = page.getByRole('region', { name: 'Topics of the bag' });
    const let_read = await holdReading(page);
    await spatial.drop([{ name: 'room.mcap', content }]);
    await expect(panel.getByRole('status')).toHaveText(words);
    await panel.getByRole('button', { name: 'Cancel' }).click();
    await expect(panel).toBeHidden();
    await let_read();
    // The bag is opened from its beginning where it is wanted again; the cancelled one brings nothing, not even a message.
    await spatial.drop([{ name: 'room.mcap', content }]);
    const { result } = await spatial.stitched();
    expect(result.frames.length).toBeGreaterThanOrEqual(5);
    await expect(panel).toContainText('depth images /cam/depth/image_raw');
    await expect(panel.getByRole('button', { name: 'Cancel' })).toBeHidden();
    await expect(spatial.messages.filter({ hasText: 'no longer wanted' })).toBeHidden();
  });
}

test('other topics: another reference trajectory keeps the map, other depth makes a new one', async ({
  spatial,
  page,
}) => {
  await spatial.drop([{ name: 'room.mcap', content: Buffer.from(mcapBytes(TOPICS, messages(5))) }]);
  const first = await spatial.stitched();
  const panel = page.getByRole('region', { name: 'Topics of the bag' });
  await panel.getByRole('button', { name: '7 topics' }).click();
  await panel.getByLabel('Use /wheels as').selectOption('ground truth');
  const second = await spatial.stitched();
  expect(second.result.frames[4]?.T_world_sensor).toEqual(first.result.frames[4]?.T_world_sensor);
  expect(second.result.comparison?.mean).toBeGreaterThan(0.5);
  await expect(panel.getByLabel('Use /ground_truth as')).toHaveValue('');
  await panel.getByLabel('Use /cam/color/image_raw as').selectOption('nothing');
  const third = await spatial.stitched();
  expect(third.result.frames).toHaveLength(5);
  await expect(panel.locator('.summary')).not.toContainText('colours');
  // What is dropped beside the bag and is no recording leaves its topics open.
  await spatial.drop([{ name: 'README.md', content: 'words' }]);
  await expect(spatial.messages).toContainText('The file cannot be used');
  await expect(panel).toBeVisible();
});

test('what is wrong with a bag is told beside what was made of it', async ({ spatial }) => {
  const bytes = mcapBytes(
    TOPICS.slice(0, 1),
    messages(6).filter(({ topic }) => topic === TOPICS[0]?.name),
    {
      chunkBytes: 1,
    },
  );
  await spatial.drop([{ name: 'cut.mcap', content: Buffer.from(bytes.subarray(0, Math.floor(0.75 * bytes.length))) }]);
  const { result } = await spatial.stitched();
  expect(result.frames).toHaveLength(4);
  await expect(spatial.messages).toContainText(/cut off or damaged at byte \d+/i);
  await expect(spatial.messages).toContainText('No CameraInfo gives the focal length');
});

test('a bag with nothing to use says what is in it', async ({ spatial, page }) => {
  await spatial.drop([
    {
      name: 'talk.mcap',
      content: Buffer.from(
        mcapBytes(
          TOPICS.slice(6),
          messages(2).filter(({ topic }) => topic === '/chatter'),
        ),
      ),
    },
  ]);
  await expect(spatial.messages).toContainText('/chatter (std_msgs/msg/String)');
  await expect(page.getByRole('region', { name: 'Topics of the bag' })).toContainText(
    'No topic of this bag can be used',
  );
  await spatial.drop([{ name: 'old.bag', content: '#ROSBAG V1.2\n'.padEnd(99) }]);
  await expect(spatial.messages).toContainText('This bag is of the version V1.2');
});

test('the first load fetches neither three.js nor the view in space, and nothing of bags', async ({ page }) => {
  const spatial = new SpatialPage(page);
  await spatial.app.open();
  const scripts = () => page.evaluate(() => performance.getEntriesByType('resource').map(({ name }) => name));
  const later = /scene-|spatial-view-|space-renderer-|bag_recordings|mcap|db3|topics-panel/;
  expect((await scripts()).filter((name) => later.test(name))).toEqual([]);
  await spatial.drop([{ name: 'room.mcap', content: Buffer.from(mcapBytes(TOPICS, messages(2))) }]);
  await spatial.stitched();
  for (const part of [/spatial-view-/, /bag_recordings/])
    expect((await scripts()).some((name) => part.test(name))).toBe(true);
  expect(spatial.app.faults).toEqual([]);
});

test('the list of topics at the width of a phone, named and legible, dark and light', async ({ spatial, page }) => {
  await page.setViewportSize({ width: 360, height: 740 });
  await spatial.drop([{ name: 'room.mcap', content: Buffer.from(mcapBytes(TOPICS, messages(3))) }]);
  await spatial.stitched();
  const panel = page.getByRole('region', { name: 'Topics of the bag' });
  await panel.getByRole('button', { name: '7 topics' }).click();
  for (const colorScheme of ['light', 'dark'] as const) {
    await page.emulateMedia({ colorScheme, reducedMotion: 'reduce' });
    // Of the element: what is too wide for it is hidden, and the page keeps its width.
    const width = (): Promise<number> => page.locator('scanstitch-app').evaluate(({ scrollWidth }) => scrollWidth);
    await expect.poll(width).toBeLessThanOrEqual(360);
    await expectNamedControls(page);
    expect(await page.evaluate(findWeakContrast)).toEqual([]);
  }
});

test('a recorded bag', async ({ spatial }) => {
  test.skip(!existsSync(BAGS), '../shared/data is absent');
  const folder = join(BAGS, 'derived_depth_pointcloud/depth_16UC1_db3');
  const files = ['depth_16UC1_db3.db3', 'metadata.yaml'];
  await spatial.drop(files.map((name) => ({ name, content: readFileSync(join(folder, name)) })));
  const { result } = await spatial.stitched();
  expect(result.frames).toHaveLength(10);
  expect(result.frames.every(({ status }) => status === 'good')).toBe(true);
});
