/** Page and command line write the same files of the same recording, byte for byte. */
import { cpSync, existsSync, mkdirSync, readdirSync, readFileSync, statSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { unzipSync } from 'fflate';
import { DATA, scanstitch } from '../cli/support.mjs';
import { type InputFile, SAMPLE_FOLDER, ScanstitchPage } from './scanstitch_page.js';
import { drawNothing, expect, test } from './spatial_page.js';
import { recording } from './spatial_recording.js';

/** What is a picture of the screen, or holds one. */
const OF_THE_SCREEN = new Set(['map.png', 'report.html']);

/** Recordings of others, small ones of each kind. */
const RECORDINGS: readonly (readonly [name: string, path: string])[] = [
  ['scans as PLY', 'laser/zju10'],
  ['a log of CARMEN', 'laser/csm'],
  ['a bag of ROS 1', 'laser/ros1_bag/mylaserdata3.bag'],
  ['a bag of ROS 2', 'laser/ros2_scan_bag/data_1'],
  ['a bag with a wrong index', 'reports/bag_wrong_index'],
  ['scans as text of rostopic', 'reports/rostopic_echo'],
  ['a scanner upside down', 'reports/laser_upside_down'],
  ['poses of a phone', 'reports/stray_scanner'],
  ['clouds with a pose file each', 'reports/missing_frame'],
  ['clouds in map coordinates', 'reports/utm_csv'],
  ['a table of ranges', 'reports/rplidar_polar/lidar_data.txt'],
  ['clouds as PCD', 'lidar/pcl_room'],
  ['clouds of a car', 'lidar/kitti_pair'],
  ['depth images', 'rgbd/redwood5'],
];

/** The files of a folder, or the one file, named as a drop names them. */
function filesOf(path: string, name = path.replace(/^.*\//, '')): InputFile[] {
  if (!statSync(path).isDirectory()) return [{ name, content: readFileSync(path) }];
  return readdirSync(path).flatMap((child) => filesOf(join(path, child), `${name}/${child}`));
}

async function expectSameFiles(app: ScanstitchPage, files: readonly InputFile[], folder: string): Promise<void> {
  const given = join(folder, 'given');
  for (const { name, content } of files) {
    mkdirSync(dirname(join(given, name)), { recursive: true });
    writeFileSync(join(given, name), content);
  }
  const [only] = readdirSync(given);
  const out = join(folder, 'out');
  const { status, stderr } = await scanstitch(['reconstruct', join(given, only ?? ''), '--out', out]);
  expect([0, 2], stderr).toContain(status);

  await app.openEmpty();
  await app.page.getByRole('heading', { name: /^(Drop|Open) laser scans/ }).waitFor();
  await app.drop(files);
  await app.stitched();
  await app.page.getByRole('button', { name: 'Export' }).click();
  const download = app.page.waitForEvent('download');
  await app.page.getByRole('menuitem', { name: /^Everything/ }).click();
  const exported = unzipSync(readFileSync(await (await download).path()));

  const written = Object.fromEntries(filesOf(out, '').map(({ name, content }) => [name.slice(1), content]));
  const both = Object.keys(exported).filter((name) => name in written && !OF_THE_SCREEN.has(name));
  expect(both).toEqual(expect.arrayContaining(['trajectory.tum', 'map.ply', 'report.json']));
  // The page names files by their path in what was dropped, for several recordings may be open; the command line by their own names.
  const plain = (bytes: Uint8Array, name: string): Buffer => {
    if (name !== 'report.json') return Buffer.from(bytes);
    return Buffer.from(
      Buffer.from(bytes)
        .toString()
        .replace(/"(?:[^" /]+\/)+/g, '"'),
    );
  };
  const different = both.filter(
    (name) => !plain(exported[name] ?? new Uint8Array(), name).equals(plain(written[name] as Buffer, name)),
  );
  for (const name of different) {
    cpSync(join(out, name), join(folder, 'different', 'command_line', name));
    const path = join(folder, 'different', 'page', name);
    mkdirSync(dirname(path), { recursive: true });
    writeFileSync(path, exported[name] ?? '');
  }
  expect(different).toEqual([]);
}

test.use({ viewport: { width: 900, height: 600 } });

test('of the sample, and of a rendered room', async ({ page }, info) => {
  await drawNothing(page);
  const names = readdirSync(SAMPLE_FOLDER);
  const scans = names.map((name) => ({ name: `lab/${name}`, content: readFileSync(join(SAMPLE_FOLDER, name)) }));
  await expectSameFiles(new ScanstitchPage(page), scans, info.outputPath('corridor'));
  await expectSameFiles(new ScanstitchPage(page), recording(4), info.outputPath('room'));
});

for (const [name, path] of RECORDINGS) {
  test(`of ${name} (${path})`, async ({ page }, info) => {
    test.skip(!existsSync(join(DATA, path)), `../shared/data/${path} is absent`);
    await drawNothing(page);
    await expectSameFiles(new ScanstitchPage(page), filesOf(join(DATA, path)), info.outputPath());
  });
}
