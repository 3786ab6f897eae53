// @ts-check
/** How depth images are read: what files say, what is assumed, and input that does not belong together. */
import assert from 'node:assert/strict';
import { existsSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { test } from 'node:test';
import { colourPng, greyPng, see, VIEWS, WALK, walkFiles } from './depth_room.mjs';
import { readReport, scanstitch, temporaryFolder } from './support.mjs';

const FILES = walkFiles();
const DEPTHS = VIEWS.map(({ depth }) => depth);

/**
 * The result of a run on these files, and what it said.
 * @param {import('node:test').TestContext} t
 * @param {Record<string, Uint8Array | string>} files
 * @param {string[]} options
 */
async function reconstruct(t, files, options = []) {
  const folder = temporaryFolder(t);
  for (const [path, contents] of Object.entries(files)) {
    mkdirSync(dirname(join(folder, 'walk', path)), { recursive: true });
    writeFileSync(join(folder, 'walk', path), contents);
  }
  const out = join(folder, 'out');
  const run = await scanstitch(['reconstruct', join(folder, 'walk'), '--out', out, '--workers', '0', ...options]);
  /** @type {import('../../npm/index.js').SpatialResult | null} */
  const result = run.status === 1 ? null : readReport(out);
  const report = join(out, 'report.html');
  return { ...run, result, html: existsSync(report) ? readFileSync(report, 'utf8') : '' };
}

/** The frames without colours, their depth changed. @param {(depth: Uint16Array, index: number) => Uint8Array} change */
function depthFiles(change) {
  const images = DEPTHS.map((depth, index) => [`depth/${index + 1}.png`, change(depth, index)]);
  return { ...Object.fromEntries(images), 'groundtruth.txt': FILES['groundtruth.txt'] ?? '' };
}

test('the depth scale of a camera file is used, and nothing but what it leaves out is assumed', async (t) => {
  const files = depthFiles((depth) => greyPng(depth.map((value) => 5 * value)));
  const camera = { fx: 96, fy: 96, ppx: 96, ppy: 96, width: 192, height: 192, depth_scale: 0.0002 };
  const told = await reconstruct(t, { ...files, 'realsense.json': JSON.stringify(camera) });
  assert.equal(told.status, 0, told.stderr);
  assert.equal(told.result?.depth_scale, 5000);
  assert.deepEqual(told.result?.assumptions, []);
  assert.match(told.html, /<th scope="row">field_of_view<\/th><td>[\d.]{1,9}°<\/td>/);
  assert.ok((told.result?.comparison?.max ?? 9) < 0.01);
  const { result } = await reconstruct(
    t,
    depthFiles((depth) => greyPng(depth)),
  );
  assert.deepEqual(
    result?.assumptions.map(({ setting, value }) => [setting, Math.round(value)]),
    [
      ['depth_scale', 1000],
      ['fx', 96],
    ],
  );
});

test('what is set of a camera leaves the rest to the camera file, or to what is assumed', async (t) => {
  const camera = async (/** @type {Record<string, string>} */ file, /** @type {string[]} */ options) => {
    const { result } = await reconstruct(t, { ...imagesOf(depthFiles((depth) => greyPng(depth))), ...file }, options);
    const { fx, fy, cx, cy } = result?.camera ?? assert.fail('no camera');
    return [fx, fy, cx, cy].map((value) => Number(value.toFixed(6)));
  };
  const file = { 'camera.txt': '97 98 96 94' };
  assert.deepEqual(await camera({}, ['--set', 'fx=96']), [96, 96, 95.5, 95.5]);
  assert.deepEqual(
    await camera({}, ['--set', 'fx=96', '--set', 'fy=95', '--set', 'cx=94', '--set', 'cy=93']),
    [96, 95, 94, 93],
  );
  assert.deepEqual(await camera({}, ['--set', 'cy=93']), [96, 96, 96, 93]);
  assert.deepEqual(await camera(file, []), [97, 98, 96, 94]);
  assert.deepEqual(await camera(file, ['--set', 'fx=96']), [96, 96, 96, 94]);
  assert.deepEqual(await camera(file, ['--set', 'cy=95']), [97, 98, 96, 95]);
});

/** The frames with steps of depth like a Kinect's, which tell its scale. @param {Uint16Array} depth */
const inKinectSteps = (depth) =>
  greyPng(depth.map((value) => (value > 0 ? Math.round((348 * 1000) / Math.round((348 * 1000) / value)) : 0)));

/** The images alone: no ground truth confirms what is assumed. @param {Record<string, Uint8Array | string>} files */
const imagesOf = (files) => Object.fromEntries(Object.entries(files).filter(([path]) => path.startsWith('depth/')));

test('what is assumed and unconfirmed stands beside the number of good frames, with the options that change it', async (t) => {
  const { status, stdout, stderr, result, html } = await reconstruct(
    t,
    imagesOf(depthFiles((depth) => greyPng(depth))),
  );
  assert.equal(status, 0, stderr);
  assert.deepEqual(
    result?.assumptions.map(({ confirmed_by }) => confirmed_by),
    [null, null],
  );
  assert.match(
    stderr,
    /^note: No file says what the depth scale is: a scale of 1000 raw values per metre is assumed, .*--set depth_scale=NUMBER\.$/m,
  );
  assert.match(
    stderr,
    /^note: No file says what the camera is like: a focal length of 96 pixels is assumed, .*--intrinsics FILE/m,
  );
  assert.match(stdout, /^Camera: .* \(assumed\)$/m);
  assert.match(stdout, /^Depth: 1000 raw values per metre \(assumed\)/m);
  const condition =
    '6 good if the depth scale is 1000 raw values per metre and the focal length is 96 pixels, which nothing in the recording confirms';
  assert.match(
    stdout,
    new RegExp(`^${condition} \\(--set depth_scale=NUMBER, --set fx=PIXELS\\); 0 doubtful, 0 lost$`, 'm'),
  );
  assert.ok(html.includes(`${condition}; 0 doubtful, 0 lost`));
});

test('a scale that the steps of a known sensor confirm is no condition; the focal length remains one', async (t) => {
  const { stdout, stderr, result } = await reconstruct(t, imagesOf(depthFiles(inKinectSteps)), ['--set', 'fx=96']);
  assert.match(
    result?.assumptions[0]?.confirmed_by ?? '',
    /^the disparity steps of a Kinect, which fit no other scale in use$/,
  );
  assert.match(
    stderr,
    /1000 raw values per metre is assumed, told from the spacing .*\. Confirmed by the disparity steps of a Kinect/,
  );
  assert.match(stdout, /^Depth: 1000 raw values per metre \(assumed; supported by the disparity steps of a Kinect\)/m);
  assert.match(stdout, /^\d good, \d doubtful, \d lost$/m);
  const open = await reconstruct(t, imagesOf(depthFiles(inKinectSteps)));
  assert.match(
    open.stdout,
    /^\d good if the focal length is \d+ pixels, which nothing in the recording confirms \(--set fx=PIXELS\); \d doubtful/m,
  );
});

test('a scale that the steps of a known sensor contradict is a condition of the good frames', async (t) => {
  const set = ['--set', 'fx=96', '--set', 'depth_scale=5000'];
  const wrong = await reconstruct(t, imagesOf(depthFiles(inKinectSteps)), set);
  assert.match(
    wrong.stderr,
    /^note: depth_scale = 5000 is set, but the spacing of the raw values is that of a depth camera with 1000/m,
  );
  assert.match(
    wrong.stdout,
    /^\d good if the depth scale is 5000 raw values per metre, which the depth images contradict \(--set depth_scale=NUMBER\); \d doubtful/m,
  );
  const right = await reconstruct(t, imagesOf(depthFiles(inKinectSteps)), [
    '--set',
    'fx=96',
    '--set',
    'depth_scale=1000',
  ]);
  assert.match(right.stdout, /^\d good, \d doubtful, \d lost$/m);
});

test('a ground truth of the same size confirms what is assumed, and one of another size does not', async (t) => {
  const right = await reconstruct(
    t,
    depthFiles((depth) => greyPng(depth)),
  );
  const confirmations = right.result?.assumptions.map(({ confirmed_by }) => confirmed_by ?? '');
  assert.match(confirmations?.[0] ?? '', /^the ground truth, whose distances are the same within 5 %$/);
  assert.match(right.stdout, /^6 good( if the focal length|,)/m);
  const small = await reconstruct(
    t,
    depthFiles((depth) => greyPng(depth.map((value) => value / 2))),
  );
  assert.equal(small.result?.assumptions[0]?.confirmed_by, null);
  assert.match(small.stdout, /^\d good if the depth scale is 1000 raw values per metre/m);
});

test('ScanNet: frames without a pose (-inf) cost nothing but their comparison', async (t) => {
  const poses = WALK.map(([x, y, z, yaw], index) => {
    const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
    const rows = [[c, 0, s, x], [0, 1, 0, y], [-s, 0, c, z], [0, 0, 0, 1]]; // prettier-ignore
    const text = rows.map((row) => `${row.join(' ')}\n`).join('');
    return [`pose/${index + 1}.txt`, index === 0 || index === 3 ? '-inf -inf -inf -inf\n'.repeat(4) : text];
  });
  const images = Object.entries(depthFiles((depth) => greyPng(depth))).filter(([path]) => path.startsWith('depth/'));
  const { status, stderr, result } = await reconstruct(t, Object.fromEntries([...images, ...poses]));
  assert.equal(status, 0, stderr);
  assert.match(
    stderr,
    /^note: pose: 2 of its 6 poses have nan or inf in place of numbers \(first pose 0, counted from 0\)/m,
  );
  const { num_matched, errors, max } = result?.comparison ?? { num_matched: 0, errors: [], max: 9 };
  assert.deepEqual([num_matched, errors.map((error) => error === null)], [4, [true, false, false, true, false, false]]);
  assert.ok(max < 0.01, `${max}`);
});

test('colours of another size in every frame are one note', async (t) => {
  const small = colourPng(see([0, 0, 0, 0], 96, 96).colours, 96);
  const colours = Object.fromEntries(WALK.map((_, index) => [`rgb/${index + 1}.png`, small]));
  const { stderr } = await reconstruct(t, { ...FILES, ...colours });
  assert.equal(stderr.match(/its colours are left out/g)?.length, 1, stderr);
  assert.match(
    stderr,
    /^note: depth\/1\.png: its colours are left out: .*rgb\/1\.png \(and 5 other frames\): The colour image has 96 x 96/m,
  );
});

test('colours of more pixels of the same view, as phones have them, are reduced to the depth', async (t) => {
  const files = { ...FILES };
  for (const [index, view] of WALK.entries())
    files[`rgb/${index + 1}.png`] = colourPng(see(view, 384, 384).colours, 384);
  const { status, stderr, result } = await reconstruct(t, files);
  const note =
    /^note: depth\/1\.png: .*rgb\/1\.png \(and 5 other frames\): it has more pixels than the depth image and is reduced to its 192 x 192/m;
  assert.match(stderr, note);
  assert.doesNotMatch(stderr, /left out|not registered/);
  const own = await reconstruct(t, FILES);
  assert.equal(status, own.status);
  const placesOf = (/** @type {typeof result} */ one) =>
    one?.frames.map(({ T_world_sensor: { x, y, z } }) => [x, y, z]).flat() ?? [];
  const [places, expected] = [placesOf(result), placesOf(own.result)];
  assert.deepEqual([places.length, expected.length], [3 * WALK.length, 3 * WALK.length]);
  for (const [at, value] of places.entries())
    assert.ok(Math.abs(value - (expected[at] ?? 9)) < 0.002, `${at}: ${value}`);
});

test('a wrong scale by hand: what would make it fit the ground truth is offered, and the estimate stays', async (t) => {
  const files = depthFiles((depth) => greyPng(depth));
  const { stdout, result } = await reconstruct(t, files, ['--set', 'depth_scale=200', '--set', 'max_range=50']);
  assert.match(
    stdout,
    /The path is 5\.0\d times as long as the ground truth's: depth_scale 1000 would make them equal \(--set depth_scale=1000\)/,
  );
  assert.equal(result?.depth_scale, 200);
  assert.deepEqual([result?.suggestion?.setting, result?.suggestion?.value], ['depth_scale', 1000]);
  const right = await reconstruct(t, files);
  assert.equal(right.result?.suggestion, null);
  const tiny = await reconstruct(t, files, ['--set', 'depth_scale=1']);
  assert.match(
    tiny.stderr,
    /depth_scale = 1 puts the median depth of the first image at \d{4}\.\d+ m: is it in raw values per metre\?|No frame/,
  );
});

test('the camera of other images is refused in plain words, and a typical one taken', async (t) => {
  const camera =
    '%YAML:1.0\n---\nimage_width: 1280\nimage_height: 720\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 900., 0., 640., 0., 900., 360., 0., 0., 1. ]\n';
  const { status, stderr, result } = await reconstruct(t, { ...FILES, 'camera.yaml': camera });
  assert.match(
    stderr,
    /camera\.yaml: not used: This camera is for 1280 x 720 pixels, the depth images have 192 x 192\. Give the camera of the depth images/,
  );
  assert.equal(status, 2);
  assert.equal(Math.round(result?.camera?.fx ?? 0), 96);
  const folder = temporaryFolder(t);
  writeFileSync(join(folder, 'camera.yaml'), camera);
  const named = await reconstruct(t, FILES, ['--intrinsics', join(folder, 'camera.yaml')]);
  assert.equal(named.status, 1);
  assert.match(named.stderr, /camera\.yaml: This camera is for 1280 x 720 pixels/);
});

test('depth and colours of other sizes, and frames of other sizes and kinds, are each told', async (t) => {
  const small = see([0, 0, 0, 0], 96, 96);
  const colours = await reconstruct(t, { ...FILES, 'rgb/2.png': colourPng(small.colours, 96) });
  assert.match(
    colours.stderr,
    /2\.png: its colours are left out: .*The colour image has 96 x 96 pixels, the depth image 192 x 192/,
  );
  assert.equal(colours.result?.frames.length, WALK.length);
  const sizes = await reconstruct(t, { ...FILES, 'depth/3.png': greyPng(small.depth, 96) });
  assert.match(
    sizes.stderr,
    /3\.png: The depth image has 96 x 96 pixels, the first one has 192 x 192\. Give images of one camera/,
  );
  assert.deepEqual([sizes.status, sizes.result?.frames.length], [2, WALK.length - 1]);
  const pgm = Buffer.concat([
    Buffer.from('P5 192 192 255\n'),
    Buffer.from(DEPTHS[2]?.map((value) => value / 40) ?? []),
  ]);
  const bits = await reconstruct(
    t,
    depthFiles((depth, index) => (index === 2 ? pgm : greyPng(depth))),
  );
  assert.match(
    bits.stderr,
    /3\.png: The depth image has 8 bits a value, the first one 16 bits\. Give images of one camera/,
  );
});

test('frames of two cameras among each other are told by the spacing of their values', async (t) => {
  /** @param {Uint16Array} depth @param {number} scale */
  const ofKinect = (depth, scale) =>
    greyPng(depth.map((value) => (value > 0 ? Math.round((scale * 348) / Math.round((348 * 1000) / value)) : 0)));
  const { stderr } = await reconstruct(
    t,
    depthFiles((depth, index) => ofKinect(depth, index === 4 ? 5000 : 1000)),
  );
  const told = stderr.split('\n').filter((line) => line.includes('another camera'));
  assert.equal(told.length, 1, stderr);
  assert.match(told[0] ?? '', /5\.png: the spacing of its raw values is 0\.20 times that of the first frame/);
});
