// @ts-check
/** True poses in structured files, and times that are none. */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { posesOfDocument, trajectoryBytes } from '../../npm/recording/pose_file.js';
import { scanstitch, temporaryFolder, writeFiles } from './support.mjs';
import { count, DEPTH16, encode, many, RGB, understandAll } from './recording_files.mjs';

/** A quarter turn about y, at (x, 2, 3), row by row. @param {number} x */
function rows(x) {
  return [
    [0, 0, 1, x],
    [0, 1, 0, 2],
    [-1, 0, 0, 3],
    [0, 0, 0, 1],
  ];
}

/** @param {number} x */
function columns(x) {
  return rows(0).map((_, column) => rows(x).map((row) => row[column] ?? 0));
}

/** The world in that camera, column by column, as Open3D has it. */
const EXTRINSIC = [0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0, 3, -2, -1, 1];
const TEXT = [1, 2, 10].map((x) => `${rows(x).flat().join(' ')}\n`).join('');

/** @type {Record<string, string>} */
const DOCUMENTS = {
  'list.json': JSON.stringify([1, 2, 10].map(rows)),
  'flat.json': JSON.stringify({ poses: [1, 2, 10].map((x) => rows(x).flat()) }),
  'columns.json': JSON.stringify([1, 2, 10].map((x) => columns(x).flat())),
  'by_name.json': JSON.stringify(Object.fromEntries([10, 2, 1].map((x) => [`frame_${x}.png`, { pose: rows(x) }]))),
  'transforms.json': JSON.stringify({
    fl_x: 600,
    frames: [2, 1, 10].map((x) => ({ file_path: `images/${x}.png`, transform_matrix: rows(x) })),
  }),
  'upper.json': JSON.stringify([1, 2, 10].map((x) => rows(x).slice(0, 3))),
  'poses.yaml': `%YAML:1.0\n---\n${[1, 2, 10]
    .map(
      (x) =>
        `pose_${x}: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: [ ${rows(x).flat().join('., ')} ]\n`,
    )
    .join('')}`,
  'poses.xml': `<?xml version="1.0"?>\n<opencv_storage>${[1, 2, 10]
    .map(
      (x) =>
        `<pose_${x} type_id="opencv-matrix"><rows>4</rows><cols>4</cols><dt>d</dt><data>\n${rows(x).flat().join(' ')}</data></pose_${x}>`,
    )
    .join('')}</opencv_storage>`,
};

test('a matrix a frame, in lists, by name and in either order', () => {
  for (const [name, text] of Object.entries(DOCUMENTS)) {
    assert.deepEqual(posesOfDocument(encode(text)), { text: TEXT, count: 3 }, name);
  }
  const open3d = { class_name: 'PinholeCameraTrajectory', parameters: [1, 1].map(() => ({ extrinsic: EXTRINSIC })) };
  assert.equal(posesOfDocument(encode(JSON.stringify(open3d)))?.text, `${rows(1).flat().join(' ')}\n`.repeat(2));
  const record3d = { K: [1, 0, 0], poses: [1, 2].map((x) => [0, 0.6, 0, 0.8, x, 2, 3]) };
  assert.equal(posesOfDocument(encode(JSON.stringify(record3d)))?.text, '1 2 3 0.8 0 0.6 0\n2 2 3 0.8 0 0.6 0\n');
  for (const text of [
    '{}',
    '[1, 2]',
    `[${rows(1)}]`,
    'a: 1',
    '{"camera_matrix": [525, 0, 320, 0, 525, 240, 0, 0, 1]}',
    '[[1,2,3,4,5,6,7]]',
  ]) {
    assert.equal(posesOfDocument(encode(text)), null, text);
  }
});

test('objects with a position and an orientation each, and lines of COLMAP and of a pose graph', () => {
  const pose = (/** @type {number} */ x) => ({
    position: { x, y: 2, z: 3 },
    orientation: { x: 0, y: 0.6, z: 0, w: 0.8 },
  });
  const ofObjects = (/** @type {unknown} */ tree) => posesOfDocument(encode(JSON.stringify(tree)))?.text;
  assert.equal(ofObjects([pose(1), pose(2)]), '1 2 3 0.8 0 0.6 0\n2 2 3 0.8 0 0.6 0\n');
  const stamped = [7, 8].map((time) => ({ timestamp: time, pose: { pose: pose(time) } }));
  assert.equal(ofObjects({ poses: stamped }), '7 7 2 3 0 0.6 0 0.8\n8 8 2 3 0 0.6 0 0.8\n');

  const read = (/** @type {string} */ name, /** @type {string} */ text) =>
    new TextDecoder().decode(trajectoryBytes(name, encode(text)));
  // A quarter turn about z: the world's x is the camera's y, so a camera at (-2, 1, 0) has the world's origin at (1, 2, 0).
  const half = Math.SQRT1_2;
  const images = `# two lines an image\n2 ${half} 0 0 ${half} 1 2 0 1 b/10.png\n3 4 -1 5 6 7\n1 1 0 0 0 -4 0 0 1 b/9.png\n\n`;
  const poses = read('sparse/images.txt', images)
    .trim()
    .split('\n')
    .map((line) => line.split(' ').map((word) => Math.round(1e6 * Number(word)) / 1e6));
  const round = Math.round(1e6 * half) / 1e6;
  assert.deepEqual(
    poses.map((row) => row.map((value) => value + 0)),
    [
      [9, 4, 0, 0, 0, 0, 0, 1],
      [10, -2, 1, 0, 0, 0, -round, round],
    ],
  );
  const graph = 'VERTEX_SE2 4 1 2 0.5\nVERTEX_SE2 5 2 2 0.5\nEDGE_SE2 4 5 1 0 0 1 0 0 1 0 1\n';
  assert.equal(read('a.g2o', graph), '4 1 2 0.5\n5 2 2 0.5\n');
  assert.equal(read('a.g2o', 'VERTEX_SE3:QUAT 0 1 2 3 0 0 0 1\n'), '0 1 2 3 0 0 0 1\n');
  assert.equal(read('images.txt', TEXT), TEXT, 'what is neither stays');
});

test('beside the frames they are the true path, and a camera may be in the same file', async () => {
  const images = many([1, 2, 10], (i) => `depth/${i}.png`, DEPTH16);
  for (const [name, text] of Object.entries(DOCUMENTS)) {
    const { reference } = await understandAll({ ...images, [name]: text });
    assert.deepEqual(reference, [name]);
  }
  const both = {
    w: 640,
    h: 480,
    fl_x: 600,
    fl_y: 600,
    cx: 320,
    cy: 240,
    ...JSON.parse(DOCUMENTS['transforms.json'] ?? ''),
  };
  const { reference, intrinsics } = await understandAll({ ...images, 'transforms.json': JSON.stringify(both) });
  assert.deepEqual([reference, intrinsics], [['transforms.json'], 'transforms.json']);
});

test('the milliseconds of a T265 become seconds', () => {
  const head = 'frame,timestamp,tx,ty,tz,qx,qy,qz,qw,tracker_confidence';
  const text = `${head}\n1,1583251234500.5,0,0,0,0,0,0,1,3\n2,1583251234533.5,0.1,0,0,0,0,0,1,3\n`;
  const written = new TextDecoder().decode(trajectoryBytes('t265.csv', encode(text)));
  const expected = '1,1583251234.5005,0,0,0,0,0,0,1\n2,1583251234.5335,0.1,0,0,0,0,0,1\n';
  assert.equal(written, `frame,timestamp,x,y,z,qx,qy,qz,qw\n${expected}`);
  const named = trajectoryBytes('t265.csv', encode('timestamp (ms),x,y,z,qx,qy,qz,qw\n1500,0,0,0,0,0,0,1\n'));
  assert.match(new TextDecoder().decode(named), /^timestamp,x.*\n1\.5,0/);
  const seconds = encode('timestamp,x,y,z,qx,qy,qz,qw\n1500,0,0,0,0,0,0,1\n');
  assert.equal(trajectoryBytes('walk.csv', seconds), seconds);
});

test('tables in other conventions become poses in seconds and metres', () => {
  const rows = (/** @type {string} */ text) => {
    const [head = '', ...lines] = new TextDecoder()
      .decode(trajectoryBytes('a.csv', encode(text)))
      .trim()
      .split('\n');
    return { head, rows: lines.map((line) => line.split(',').map(Number)) };
  };
  const pose = 'timestamp,x,y,z,qx,qy,qz,qw';
  const turned = [0, 0, Math.SQRT1_2, Math.SQRT1_2];
  const close = (/** @type {number[] | undefined} */ row, /** @type {number[]} */ expected, error = 1e-9) =>
    expected.forEach((value, at) =>
      assert.ok(Math.abs((row?.[at] ?? NaN) - value) < error, `${row} is not ${expected}`),
    );
  // Decimal commas, units, and angles in degrees.
  const german = rows('Zeit;PosX [mm];PosY [mm];PosZ [mm];Roll [deg];Pitch [deg];Yaw [deg]\n0,5;1000,5;2;0;0;0;90,0\n');
  assert.equal(german.head, pose);
  close(german.rows[0], [0.5, 1.0005, 0.002, 0, ...turned]);
  // All three angles, as scipy's Rotation.from_euler('ZYX', ...) has them.
  const [all] = rows('t,x,y,z,roll,pitch,yaw\n1,0,0,0,0.3,-0.2,1.1\n').rows;
  close(all, [1, 0, 0, 0, 0.17835891, -0.00643556, 0.52695482, 0.83094242], 1e-8);
  // A heading in degrees; radians stay with the engine.
  close(rows('x,y,yaw_deg\n1,2,90\n').rows[0], [1, 2, ...turned]);
  assert.equal(rows('x,y,yaw\n1,2,1.5\n').head, 'x,y,yaw');
  // A message's fields, of a turn in the plane; all times in nanoseconds, since whenever.
  const fields =
    'field.header.stamp,field.pose.pose.position.x,field.pose.pose.position.y,field.pose.pose.orientation.z,field.pose.pose.orientation.w';
  const flat = rows(`${fields}\n1211520329000,1,2,${Math.SQRT1_2},${Math.SQRT1_2}\n`);
  close(flat.rows[0], [1211.520329, 1, 2, ...turned]);
  // Dates, with and without an offset.
  const dated = rows('time,x,y,z\n2014-06-24T21:03:00.25+02:00,1,2,3\n2014-06-24 19:03:01Z,1,2,3\n').rows;
  close(dated[0], [1403636580.25, 1, 2, 3]);
  close(dated[1], [1403636581]);
  // A second of latitude and of longitude at 48 degrees, by the radii of curvature of WGS 84.
  const [, globe] = rows('timestamp,lat,lon,alt\n0,48,11,500\n1,48.000277778,11.000277778,501\n').rows;
  close(globe, [1, 20.722, 30.887, 1], 0.01);
  // `ros2 topic echo --csv`, its last line cut off.
  const echo = rows(
    '12,500000000,odom,base_link,1,2,3,0,0,0,1,0.1,0\n13,0,odom,base_link,1,2,3,0,0,0,1,0.1,0\n14,0,od',
  );
  assert.equal(echo.head, pose);
  assert.deepEqual(echo.rows, [
    [12.5, 1, 2, 3, 0, 0, 0, 1],
    [13, 1, 2, 3, 0, 0, 0, 1],
  ]);
  // Seconds beside nanoseconds; angles in degrees without names; UTF-16.
  const stamps = rows('sec,nsec,x,y,z,qx,qy,qz,qw\n12,500000000,1,2,3,0,0,0,1\n12,600000000,1,2,3,0,0,0,1\n');
  assert.deepEqual(
    stamps.rows.map(([time]) => time),
    [12.5, 12.6],
  );
  close(rows('1,0,0,0,0,0,90\n2,1,2,3,0,0,90\n').rows[1], [2, 1, 2, 3, ...turned]);
  const utf16 = Uint8Array.of(
    0xff,
    0xfe,
    ...new Uint8Array(Uint16Array.from('Zeit;x;y;z\n1,5;2,5;3;4\n', (c) => c.charCodeAt(0)).buffer),
  );
  assert.equal(new TextDecoder().decode(trajectoryBytes('a.csv', utf16)), 'timestamp,x,y,z\n1.5,2.5,3,4\n');
  // NCLT: microseconds, x y z roll pitch heading.
  const nclt = rows(
    `1326030975726043, 1, 2, 3, 0, 0, ${Math.PI / 2}\n1326030975926043, nan, nan, nan, nan, nan, nan\n`,
  );
  close(nclt.rows[0], [1326030975.726043, 1, 2, 3, ...turned], 1e-6);
  // Motion capture: Vicon's positions, OptiTrack's first rigid body.
  const vicon = 'Trajectories\n100\n,,robot,,,,,\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\n,,rad,rad,rad,mm,mm,mm\n';
  assert.deepEqual(rows(`${vicon}1,0,0,0,0,1000,2000,500\n2,0,,,,,,\n`).rows, [[0.01, 1, 2, 0.5]]);
  const tracked = [
    'Format Version,1.23,Take Name,a,Rotation Type,Quaternion,Length Units,Millimeters',
    ',,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body Marker',
    ',,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Position',
    'Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,X',
    '0,0.5,0,0,0,1,100,200,300,9\n1,0.6,,,,,,,,\n',
  ];
  assert.deepEqual(rows(tracked.join('\n')).rows, [[0.5, 0.1, 0.2, 0.3, 0, 0, 0, 1]]);
  const commas = '# walk\n1,5;2;3,25;4;0;0;0;1\n1,75;2;3,5;4;0;0;0;1\n';
  const points = '1.5;2;3.25;4;0;0;0;1\n1.75;2;3.5;4;0;0;0;1\n';
  assert.equal(new TextDecoder().decode(trajectoryBytes('a.txt', encode(commas))), points);
  // What the engine reads stays, and so does a table with a line that is cut off in its middle.
  for (const text of [
    't,x,y,z\n1,2,3,4\n',
    '1 2 3 4 0 0 0 1\n2 2 3 4 0 0 0 1\n',
    't,x [mm],y\n1,2,3\n1,2\n1,2,3\n',
    '1 2 3 4 5 6 7\n',
  ])
    assert.equal(new TextDecoder().decode(trajectoryBytes('a.txt', encode(text))), text);
});

test('durations beside the numbers of frames do not order them, and that is told', async () => {
  const durations = [
    '0.0154',
    '0.0058',
    '0.0071',
    '0.0121',
    '0.0049',
    '0.0066',
    '0.0158',
    '0.0052',
    '0.0044',
    '0.0061',
  ];
  const name = (/** @type {string} */ kind) => (/** @type {number} */ i) =>
    `${kind}/frame_${i}_${durations[i - 1]}.png`;
  const inNames = await understandAll(many(count(1, 10), name('depth'), DEPTH16));
  assert.deepEqual(
    inNames.depth_frames.map(({ depth, time }) => [depth, time]),
    count(1, 10).map((i) => [name('depth')(i), null]),
  );
  assert.match(
    inNames.notes[0]?.reason ?? '',
    /^its time stamps do not ascend \(0\.0154 s, then 0\.0058 s\); the frames/,
  );

  const images = {
    ...many(count(1, 10), (i) => `depth/${i}.png`, DEPTH16),
    ...many(count(1, 10), (i) => `rgb/${i}.png`, RGB),
  };
  const line = (/** @type {number} */ i) => `${durations[i - 1]} depth/${i}.png ${durations[10 - i]} rgb/${i}.png\n`;
  const listed = await understandAll({ ...images, 'associations.txt': count(1, 10).map(line).join('') });
  assert.deepEqual(
    listed.depth_frames.map(({ depth, color, time }) => [depth, color, time]),
    count(1, 10).map((i) => [`depth/${i}.png`, `rgb/${i}.png`, null]),
  );
  assert.match(listed.notes[0]?.reason ?? '', /do not ascend/);

  const alone = await understandAll(many(count(0, 9), (i) => `depth/${durations[i]}.png`, DEPTH16));
  assert.equal(alone.depth_frames[0]?.time, null);
  assert.match(alone.notes[0]?.reason ?? '', /lie between 0\.0044 s and 0\.0158 s for 10 images/);
});

test('stamps in the order of the frames, of a network, and fractions of any length are times', async () => {
  const cases = [
    count(1, 12).map((i) => `frame_${i}_${(100 + i / 30).toFixed(4)}.png`),
    count(1, 12).map((i) => `frame_${i}_${(100 + (i === 5 ? 3.9 : i) / 30).toFixed(4)}.png`),
    count(1, 12)
      .map((i) => `${9 + i / 20}.png`)
      .filter((name) => name.split('.').length === 3),
  ];
  for (const names of cases) {
    const { depth_frames, notes } = await understandAll(Object.fromEntries(names.map((name) => [name, DEPTH16])));
    const times = depth_frames.map(({ time }) => time ?? Number.NaN);
    assert.deepEqual(
      times,
      times.toSorted((a, b) => a - b),
    );
    assert.deepEqual(notes, []);
  }
});

test('they are trajectories to every command', async (t) => {
  const folder = temporaryFolder(t);
  const [path = ''] = writeFiles(folder, { 'transforms.json': DOCUMENTS['transforms.json'] ?? '' });
  const { status, stderr } = await scanstitch(['convert', path, join(folder, 'walk.tum')]);
  assert.equal(status, 0, stderr);
  const lines = readFileSync(join(folder, 'walk.tum'), 'utf8').trim().split('\n');
  assert.match(lines.at(-1) ?? '', /^2(\.0)? 10(\.0)? 2(\.0)? 3(\.0)? /);
  assert.match((await scanstitch(['evaluate', path, join(folder, 'walk.tum')])).stdout, /walk\.tum/);
});
