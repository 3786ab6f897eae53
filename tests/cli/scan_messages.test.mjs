// @ts-check
/** Scans as programs print them: what a robot's tools leave behind is read as the scans that were measured. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import * as engine from '../../npm/index.js';
import { convertFiles } from '../../npm/formats/convert.js';
import { scanReader } from '../../npm/formats/scan_messages.js';
import { fileInMemory } from '../../npm/files/content.js';

const BEAMS = 61;
const STEP = Math.PI / 180;
const START = -30 * STEP;
/** Two scans; nothing came back for the beam at 7. */
const SCANS = [0, 1].map((scan) =>
  Array.from({ length: BEAMS }, (_, beam) => (beam === 7 ? Number.NaN : 2 + 0.1 * scan + 0.01 * beam)),
);
const text = (/** @type {number} */ range) => (Number.isNaN(range) ? '.inf' : range.toFixed(3));
const millimetres = (/** @type {number} */ range) => (Number.isNaN(range) ? 0 : Math.round(1000 * range));
const angles = `angle_min: ${START}\nangle_max: ${-START}\n`;
const limits = 'range_min: 0.1\nrange_max: 12.0\n';
const message = (/** @type {number[]} */ ranges, /** @type {number} */ scan) => ({
  header: { stamp: { sec: 100 + scan, nanosec: 500_000_000 }, frame_id: 'laser' },
  angle_increment: STEP,
  angle_max: -START,
  angle_min: START,
  intensities: [],
  range_max: 12,
  range_min: 0.1,
  ranges: ranges.map((range) => (Number.isNaN(range) ? null : range)),
});
const hex = (/** @type {number} */ value) => (value >>> 0).toString(16).toUpperCase();

/** Name, text, and whether it tells times. @type {readonly [string, string, boolean][]} */
const FILES = [
  [
    'ros2_topic_echo.yaml',
    SCANS.map(
      (ranges, scan) =>
        `header:\n  stamp:\n    sec: ${100 + scan}\n    nanosec: 500000000\n  frame_id: laser\n${angles}angle_increment: ${STEP}\n${limits}ranges:\n${ranges.map((range) => `- ${text(range)}\n`).join('')}intensities: []\n---\n`,
    ).join(''),
    true,
  ],
  [
    'rostopic_echo.txt',
    SCANS.map(
      (ranges, scan) =>
        `header: \n  seq: ${scan}\n  stamp: \n    secs: ${100 + scan}\n    nsecs: 500000000\n  frame_id: "laser"\n${angles}angle_increment: ${STEP}\n${limits}ranges: [${ranges.map((range) => text(range).replace('.inf', 'inf')).join(', ')}]\nintensities: []\n---\n`,
    ).join(''),
    true,
  ],
  [
    'gz_topic.txt',
    SCANS.map(
      (ranges, scan) =>
        `header {\n  stamp {\n    sec: ${100 + scan}\n    nsec: 500000000\n  }\n}\nframe: "laser"\n${angles}angle_step: ${STEP}\n${limits}count: ${BEAMS}\n${ranges.map((range) => `ranges: ${text(range).replace('.inf', 'inf')}\n`).join('')}\n`,
    ).join(''),
    true,
  ],
  ['list.json', JSON.stringify(SCANS.map(message), null, 1), true],
  ['lines.jsonl', SCANS.map((ranges, scan) => `${JSON.stringify(message(ranges, scan))}\n`).join(''), true],
  [
    'rosbridge.json',
    SCANS.map(
      (ranges, scan) => `${JSON.stringify({ op: 'publish', topic: '/scan', msg: message(ranges, scan) })}\n`,
    ).join(''),
    true,
  ],
  [
    'points.json',
    JSON.stringify(
      SCANS.map((ranges, scan) => ({
        timestamp: 100.5 + scan,
        points: ranges.map((range, beam) => ({ angle: beam - 30, distance: millimetres(range) })),
      })),
    ),
    true,
  ],
  [
    'sick.log',
    SCANS.map(
      (ranges, scan) =>
        `\x02sSN LMDscandata 1 1 89A27F 0 0 ${hex(scan)} ${hex(scan)} ${hex(100_500_000 + 1_000_000 * scan)} 0 0 0 7 0 0 1388 168 0 1 DIST1 3F800000 00000000 ${hex(600_000)} ${hex(10_000)} ${hex(BEAMS)} ${ranges.map((range) => hex(millimetres(range))).join(' ')} 0 0 0 0 0 0\x03\n`,
    ).join(''),
    true,
  ],
  [
    'urg.ubh',
    `[startStep]\n0\n[endStep]\n${BEAMS - 1}\n[frontStep]\n30\n[areaTotal]\n360\n${SCANS.map((ranges, scan) => `[timestamp]\n${100_500 + 1000 * scan}\n[scan]\n${ranges.map(millimetres).join(';')}\n`).join('')}`,
    true,
  ],
  [
    'rplidar.txt',
    SCANS.map(
      (ranges) => `[${ranges.map((range, beam) => `(15, ${30 - beam + 0.0}, ${millimetres(range)})`).join(', ')}]\n`,
    )
      .join('')
      // The laser turns clockwise from ahead: negative angles are those beyond 180 degrees.
      .replaceAll(/\(15, -(\d+),/g, (_, angle) => `(15, ${360 - Number(angle)},`),
    false,
  ],
];

await engine.load();

/** @param {string} path @param {string} content */
const fileOf = (path, content) => fileInMemory(path, new TextEncoder().encode(content));

for (const [name, content, hasTimes] of FILES) {
  test(`${name}: its scans, their angles and times`, async () => {
    const { files, notes } = await convertFiles([fileOf(name, content)], (made) => made);
    assert.deepEqual(notes, []);
    const bytes = (await files[0]?.read()) ?? new Uint8Array();
    assert.ok(engine.is_laser_log(bytes.subarray(0, 4096)), new TextDecoder().decode(bytes.subarray(0, 200)));
    const scans = new TextDecoder()
      .decode(bytes)
      .trim()
      .split('\n')
      .map((line) => JSON.parse(line));
    assert.equal(scans.length, SCANS.length);
    for (const [scan, { readings, theta, min_theta, max_theta, timestamp }] of scans.entries()) {
      assert.equal(readings.length, BEAMS);
      for (const [beam, range] of (SCANS[scan] ?? []).entries()) {
        if (Number.isNaN(range)) assert.equal(readings[beam], null);
        else assert.ok(Math.abs(readings[beam] - range) < 1e-9, `${beam}: ${readings[beam]} ${range}`);
        const angle = theta ? theta[beam] : min_theta + ((max_theta - min_theta) * beam) / (BEAMS - 1);
        const apart = Math.sin((angle - START - STEP * beam) / 2);
        assert.ok(Math.abs(apart) < 1e-9, `${beam}: ${angle}`);
      }
      if (hasTimes) assert.ok(Math.abs(timestamp - (100.5 + scan)) < 1e-6, `${timestamp}`);
    }
    const reconstruction = new engine.Reconstruction();
    assert.equal(reconstruction.add_log(name, bytes).num_scans, 2);
    reconstruction.free();
  });
}

test('ranges without angles become a table, whose angles are asked', async () => {
  const lines = SCANS.map((ranges, scan) => JSON.stringify({ t: scan / 10, ranges: ranges.map((r) => r || null) }));
  const { files } = await convertFiles([fileOf('scans.jsonl', lines.join('\n'))], (made) => made);
  const table = new TextDecoder().decode(await files[0]?.read());
  assert.match(table, /^time,range_0,range_1,.*\n0,2,2\.01,/);
  assert.match(table, /\n0\.1,2\.1,/);
});

test('arrays that NumPy printed are scans, unless it left numbers out', async () => {
  const row = (/** @type {number} */ scan) =>
    Array.from({ length: 30 }, (_, at) => (at === 4 ? ' inf' : at === 5 ? '4.  ' : (2 + at / 100 + scan).toFixed(2)));
  const printed = [0, 1].map((scan) => `[${row(scan).slice(0, 16).join(' ')}\n ${row(scan).slice(16).join('  ')}]`);
  const { files } = await convertFiles([fileOf('scans.txt', `${printed.join('\n')}\n`)], (made) => made);
  const [, first, second] = new TextDecoder().decode(await files[0]?.read()).split('\n');
  assert.match(first ?? '', /^2,2\.01,2\.02,2\.03,nan,4,2\.06,.*,2\.29$/);
  assert.match(second ?? '', /^3,3\.01,.*,3\.29$/);
  const short = await convertFiles([fileOf('scans.txt', '[1.2 1.3 1.4 ... 2.1 2.2 2.3]\n'.repeat(5))], (made) => made);
  assert.deepEqual(short.files, []);
  assert.match(short.notes[0]?.reason ?? '', /most numbers.*when NumPy printed them.*numpy\.savetxt/);
});

test('lists that ros2 topic echo has shortened are told, with the command', async () => {
  const short = `${angles}angle_increment: ${STEP}\nranges:\n- 1.0\n- 1.1\n- '...'\n---\n`;
  const { files, notes } = await convertFiles([fileOf('scan.yaml', short)], (made) => made);
  assert.deepEqual(files, []);
  assert.match(notes[0]?.reason ?? '', /shortened.*ros2 topic echo --full-length/);
});

const [, ECHO] = FILES[0] ?? [];
const changed = (/** @type {[RegExp, string][]} */ ...changes) =>
  changes.reduce((made, [what, by]) => made.replaceAll(what, by), ECHO ?? '');
const inMillimetres = (ECHO ?? '').replaceAll(/^- ([\d.]+)$/gm, (_, range) => `- ${1000 * Number(range)}`);

/** What is odd, the text, and what is told of it; true: the scans come out as they are. @type {readonly [string, string, RegExp | null, boolean][]} */
const ODD = [
  ['ranges in millimetres', inMillimetres, /cannot be metres and are read as millimetres/, true],
  ['... and their limits', inMillimetres.replaceAll('12.0', '12000'), /cannot be metres/, true],
  [
    'angles in degrees',
    changed([/(angle_\w+): (.*)/g, '$1: $2e0']).replaceAll(
      /(angle_\w+): (.*)e0/g,
      (_, key, angle) => `${key}: ${Number(angle) / STEP}`,
    ),
    /cannot be in radians/,
    true,
  ],
  ['no step', changed([/angle_increment: .*/g, 'angle_increment: 0.0']), null, true],
  ['no limit', changed([/range_max: .*/g, 'range_max: 0.0']), /range_max is not above range_min/, true],
  [
    'another step',
    changed([/angle_increment: .*/g, `angle_increment: ${1.5 * STEP}`]),
    /angle_max says .* 60 degrees, angle_increment 90/,
    false,
  ],
];

for (const [what, text, told, isRight] of ODD) {
  test(`${what}: put right, or told`, async () => {
    const { files, notes } = await convertFiles([fileOf('scan.yaml', text)], (made) => made);
    if (told) assert.match(notes.map(({ reason }) => reason).join('\n'), told);
    else assert.deepEqual(notes, []);
    if (!isRight) return;
    const read = async (/** @type {typeof files} */ [file]) =>
      new TextDecoder()
        .decode(await file?.read())
        .trim()
        .split('\n')
        .map((line) => JSON.parse(line));
    const expected = await convertFiles([fileOf('scan.yaml', ECHO ?? '')], (made) => made);
    const [scans, whole] = [await read(files), await read(expected.files)];
    assert.equal(scans.length, 2);
    scans.forEach((scan, at) => {
      assert.ok(Math.abs(scan.min_theta - START) < 1e-9 && Math.abs(scan.max_theta + START) < 1e-9);
      const apart = scan.readings.map((/** @type {number} */ range, /** @type {number} */ i) =>
        Math.abs(range - whole[at].readings[i]),
      );
      assert.ok(Math.max(...apart) < 1e-9);
    });
  });
}

test('a scan of which little comes back, as outdoors, is in metres all the same', async () => {
  const readings = SCANS[0]?.map((range, beam) => (beam < 3 ? range : 81.91)) ?? [];
  const far = { ...message(readings, 0), range_max: 81.92 };
  const { files, notes } = await convertFiles([fileOf('scan.json', JSON.stringify([far, far]))], (made) => made);
  assert.deepEqual(notes, []);
  const [scan = ''] = new TextDecoder().decode(await files[0]?.read()).split('\n');
  assert.deepEqual(JSON.parse(scan).readings, readings);
});

test('what a recorder that was stopped leaves of its last scan is told', async () => {
  const echo = ECHO ?? '';
  const lines = (FILES.find(([name]) => name === 'lines.jsonl') ?? [])[1] ?? '';
  for (const [name, text, told] of /** @type {const} */ ([
    ['scan.yaml', `${echo}${echo}`.slice(0, -200), /1 of 4 scans have fewer or more readings/],
    ['scan.yaml', `${echo}header:\n  stamp:\n    sec: 9\n`, /1 of its messages have no ranges/],
    ['scans.jsonl', lines.slice(0, -50), /one of its lines is not JSON/],
  ])) {
    const { files, notes } = await convertFiles([fileOf(name, text)], (made) => made);
    assert.equal(files.length, 1);
    assert.match(notes[0]?.reason ?? '', told);
    assert.equal(notes[0]?.is_loss, true);
  }
  const broken = await convertFiles([fileOf('scans.jsonl', `${lines}{"ranges":[1,\n{"ranges":[2,\n`)], (made) => made);
  assert.deepEqual(broken.files, []);
  assert.equal(broken.notes.length, 1, 'that it is not used, and not that a line is left out');
  assert.match(broken.notes[0]?.reason ?? '', /neither one JSON document nor one a line/);
});

test('angles that no unit explains are refused', async () => {
  const text = changed([/angle_increment: .*/g, `angle_increment: ${50 * STEP}`]);
  const { files, notes } = await convertFiles([fileOf('scan.yaml', text)], (made) => made);
  assert.deepEqual(files, []);
  assert.match(notes[0]?.reason ?? '', /cover 3000 degrees.*in radians/);
});

test('texts in UTF-16 are read', async () => {
  const swapped = Buffer.from(`\ufeff${ECHO}`, 'utf16le');
  const utf16 = { LE: Buffer.from(swapped), BE: swapped.swap16() };
  for (const bytes of Object.values(utf16)) {
    const { files } = await convertFiles([fileInMemory('scan.yaml', bytes)], (made) => made);
    const expected = await convertFiles([fileOf('scan.yaml', ECHO ?? '')], (made) => made);
    assert.deepEqual(await files[0]?.read(), await expected.files[0]?.read());
  }
});

test('cameras, poses and other texts stay what they are', async () => {
  for (const [name, content] of /** @type {const} */ ([
    ['camera.yaml', 'camera_matrix:\n  rows: 3\n  cols: 3\n  data: [525, 0, 320, 0, 525, 240, 0, 0, 1]\n'],
    ['poses.json', '[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]'],
    ['points.json', '[[1,2,3],[4,5,6],[7,8,9]]'],
    ['csm.json', '{"readings": [1, 2, 3], "theta": [0, 0.1, 0.2]}'],
    ['poses.txt', '1 0 0 0 0 1 0 0 0 0 1 0\n'.repeat(30)],
  ])) {
    const file = fileOf(name, content);
    const { files, notes } = await convertFiles([file], (made) => made);
    assert.deepEqual([files, notes], [[file], []], name);
  }
});

test('an angle and a distance at a time: dictionaries, colons, the radar of the Arduino tutorials, letters', async () => {
  const beams = Array.from({ length: 61 }, (_, beam) => beam);
  const range = (/** @type {number} */ scan, /** @type {number} */ beam) => 100 + 10 * scan + beam;
  const forth = (/** @type {number} */ scan) => (scan % 2 === 0 ? beams : beams.toReversed());
  const inAll = (/** @type {(scan: number) => string} */ text) => [0, 1, 2].map(text).join('');
  const files = {
    'pylidar.txt': inAll((scan) => `{${beams.map((beam) => `${beam}: ${range(scan, beam)}`).join(', ')}}\n`),
    'quoted.json': inAll((scan) => `{${beams.map((beam) => `"${beam}": ${range(scan, beam)}`).join(',')}}\n`),
    'colons.txt': inAll((scan) => beams.map((beam) => `${beam}:${range(scan, beam)}\r\n`).join('')),
    'COM3.txt': inAll((scan) =>
      forth(scan)
        .map((beam) => `${beam},${range(scan, beam)}.`)
        .join(''),
    ),
    'letters.log': inAll(
      (scan) => `scan ${scan}\n${beams.map((beam) => `a:${beam}.0 r:${range(scan, beam)}\n`).join('')}`,
    ),
  };
  for (const [name, text] of Object.entries(files)) {
    const { files: made } = await convertFiles([fileOf(name, text)], (content) => content);
    const table = new TextDecoder().decode(await made[0]?.read());
    const sweep = name === 'COM3.txt' ? forth : () => beams;
    const rows = [0, 1, 2].flatMap((scan) => sweep(scan).map((beam) => [beam, range(scan, beam)]));
    const read = table.trim().split('\n').slice(1).map((line) => line.split(',').map(Number)); // prettier-ignore
    assert.deepEqual(read, rows, name);
    const reconstruction = new engine.Reconstruction();
    assert.equal(reconstruction.add_log(name, new TextEncoder().encode(table)).num_scans, 3, name);
    reconstruction.free();
  }
  // What has colons and braces and is none of it.
  const minutes = beams.map((beam) => `${beam % 60}:${(7 * beam) % 60}\n`).join('');
  const times = beams.map((minute) => `${10 + (minute % 3)}:${(7 * minute) % 60}\n`).join('');
  for (const [name, text] of Object.entries({
    'times.txt': times,
    'minutes.txt': minutes,
    'table.txt': '1,90.1\n2,90.2\n'.repeat(30),
  })) {
    assert.equal(scanReader(text), null, name);
  }
});

test("dictionaries of Python and a message's field alone", async () => {
  const scan = (/** @type {number} */ at) =>
    `{'stamp': ${100 + at}.5, 'angle_min': ${START}, 'angle_increment': ${STEP}, 'ok': True, 'note': None, 'ranges': [${Array(BEAMS).fill('2.5').join(', ')}]}\n`;
  const { files } = await convertFiles([fileOf('scans.txt', scan(0) + scan(1))], (made) => made);
  const lines = new TextDecoder().decode(await files[0]?.read()).trim().split('\n'); // prettier-ignore
  assert.deepEqual(lines.map((line) => JSON.parse(line).timestamp), [100.5, 101.5]); // prettier-ignore
  const field = `array('f', [${Array(360).fill('1.5').join(', ')}])\n---\n`.repeat(3);
  const made = await convertFiles([fileOf('ranges.txt', field)], (content) => content);
  const table = new TextDecoder().decode(await made.files[0]?.read()).trim().split('\n'); // prettier-ignore
  assert.deepEqual([table.length, table[1]?.split(',').length], [4, 360]);
});
