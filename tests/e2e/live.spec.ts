/** A robot's topics on the page: the map grows, and what a stream leaves is what a dropped recording gives. */
import { readFileSync } from 'node:fs';
import type { Locator, Page } from '@playwright/test';
import { WALK } from '../cli/depth_room.mjs';
import { cloudWalk, depthWalk, laserDrive } from '../cli/live_recordings.mjs';
import { listen, playRosbridge, serveFoxglove } from '../cli/live_servers.mjs';
import { expectNamedControls, findWeakContrast } from './access.js';
import { expect, test as base } from './scanstitch_page.js';
import { drawNothing } from './spatial_page.js';

/** `robots`: closes its servers when the test is over. */
const test = base.extend<{ robots: { after: (close: () => void) => void } }>({
  robots: async ({ page, context }, use) => {
    // The page counts as one of a public host, which Chromium lets connect to this machine once somebody allows it.
    await context.grantPermissions(['local-network-access']);
    await drawNothing(page);
    const closing: (() => void)[] = [];
    await use({ after: (close) => closing.push(close) });
    for (const close of closing) close();
  },
});

const live = (page: Page): Locator => page.locator('scanstitch-live');
const stream = (page: Page): Locator => live(page).getByRole('region', { name: 'Stream' });

/** Opens the card by the menu and connects. */
async function connect(page: Page, address: string): Promise<void> {
  await page.getByRole('button', { name: 'Open', exact: true }).click();
  await page.getByRole('menuitem', { name: /^A robot, live/ }).click();
  await page.getByLabel('Address of the bridge').fill(address);
  await live(page).getByRole('button', { name: 'Connect' }).click();
}

/** Saves the recording by the menu of exports. */
async function savedRecording(page: Page): Promise<Buffer> {
  await page.getByRole('button', { name: 'Export' }).click();
  const downloading = page.waitForEvent('download');
  await page.getByRole('menuitem', { name: /^Recording/ }).click();
  const download = await downloading;
  expect(download.suggestedFilename()).toBe('stream.mcap');
  return readFileSync(await download.path());
}

test('laser scans: topics are chosen, the map grows, and the end is the map of the recording', async ({
  empty,
  page,
  robots,
}) => {
  const { topics, messages } = laserDrive();
  const chatter = { name: '/chatter', type: 'std_msgs/msg/String' };
  const robot = await serveFoxglove(robots, [...topics, chatter], topics.length);
  await connect(page, robot.url);
  const row = live(page).getByRole('row', { name: /\/chatter/ });
  await expect(row).toContainText('not read');
  await expect(row.getByRole('checkbox')).toBeDisabled();
  await expect(live(page).getByRole('row', { name: /\/scan/ })).toContainText('laser scans');
  await expectNamedControls(page);
  expect(await page.evaluate(findWeakContrast)).toEqual([]);
  await live(page).getByRole('button', { name: 'Start' }).click();
  const connection = await robot.subscribed;
  robot.send(messages.slice(0, 4));
  await expect(stream(page)).toContainText('4 messages kept');
  await expect(stream(page)).toContainText('2 on the map');
  const picture = (): Promise<string> =>
    live(page)
      .locator('scanstitch-map canvas')
      .evaluate((canvas: HTMLCanvasElement) => canvas.toDataURL());
  const first = await picture();
  robot.send(messages.slice(4));
  await expect(stream(page)).toContainText(`${messages.length / 2} on the map`);
  await expect.poll(picture).not.toBe(first);
  connection.close(1000);
  const { result } = await empty.stitched();
  expect(result.frames).toHaveLength(messages.length / 2);
  await expect(page.getByRole('region', { name: 'Topics of the bag' })).toContainText('odometry /odom');

  const content = await savedRecording(page);
  await empty.drop([{ name: 'other.mcap', content }]);
  const dropped = await empty.stitched();
  const poses = ({ frames }: typeof result): unknown => frames.map(({ T_world_sensor }) => T_world_sensor);
  expect(poses(dropped.result)).toEqual(poses(result));
});

for (const [what, { topics, messages }] of [
  ['clouds', cloudWalk()],
  ['depth images with their camera', depthWalk()],
] as const) {
  test(`${what} by the attribute: each is on the map or counted, and Stop keeps what has come`, async ({
    empty,
    page,
    robots,
  }) => {
    const robot = await serveFoxglove(robots, topics);
    await page.locator('scanstitch-app').evaluate((app, url) => app.setAttribute('live', url), robot.url);
    await robot.subscribed;
    robot.send(messages);
    await expect(stream(page)).toContainText(new RegExp(`${messages.length} messages kept.* [1-9] on the map`));
    await expect
      .poll(async () => {
        const text = await stream(page).innerText();
        return Number(/(\d+) on the map/.exec(text)?.[1]) + Number(/(\d+) left out/.exec(text)?.[1] ?? 0);
      })
      .toBe(WALK.length);
    await expect(live(page).locator('scanstitch-map3d')).toBeVisible();
    await stream(page).getByRole('button', { name: 'Stop' }).click();
    const { result } = await empty.stitched();
    expect(result.frames).toHaveLength(WALK.length);
  });
}

test('half a message, a topic whose type changes and a server that is killed: told, and nothing is lost', async ({
  empty,
  page,
  robots,
}) => {
  const { topics, messages } = laserDrive();
  const robot = await serveFoxglove(robots, topics);
  await connect(page, robot.url);
  await live(page).getByRole('button', { name: 'Start' }).click();
  const connection = await robot.subscribed;
  robot.send(messages);
  connection.send(Buffer.of(1, 1, 0, 0));
  robot.server.removeChannel(1);
  robot.server.addChannel({ topic: '/scan', schemaName: 'sensor_msgs/msg/PointCloud2', encoding: 'cdr', schema: '' });
  const problems = live(page).getByRole('list', { name: 'Problems' });
  await expect(problems).toContainText('it ends after 4 bytes');
  await expect(problems).toContainText('kept as two topics');
  connection.terminate();
  expect((await empty.stitched()).result.frames).toHaveLength(messages.length / 2);
  // What became of the stream stands where it was shown.
  await page.goBack();
  await expect(live(page)).toContainText('the connection broke. stream.mcap keeps what came');
});

test('rosbridge is mapped as well, and what is no robot is told', async ({ empty, page, robots }) => {
  const echo = await listen(robots, { handleProtocols: () => false }, (connection) => {
    connection.send('hello');
    connection.close(1000);
  });
  const messages = live(page).getByRole('region', { name: 'Messages' });
  const again = async (address: string, told: RegExp): Promise<void> => {
    await page.getByLabel('Address of the bridge').fill(address);
    await live(page).getByRole('button', { name: 'Connect' }).click();
    await expect(messages).toContainText(told);
  };
  await connect(page, echo);
  await expect(messages).toContainText('neither the protocol of Foxglove nor that of rosbridge');
  await again(echo.replace(/:\d+$/, ':9'), /nobody answers there.*Is the bridge running/s);
  await again('ws://robot.example:9090', /policy of this page forbids.*ssh -N -L 8765/s);
  await again('ftp://robot', /no address of a WebSocket/);
  const { topics, messages: sent } = laserDrive();
  await page.getByLabel('Address of the bridge').fill(await playRosbridge(robots, topics, sent));
  await live(page).getByRole('button', { name: 'Connect' }).click();
  await expect(live(page)).toContainText('rosbridge at ');
  await live(page).getByRole('button', { name: 'Start' }).click();
  expect((await empty.stitched()).result.frames).toHaveLength(sent.length / 2);
});
