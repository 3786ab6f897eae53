// @ts-check
/** Logs of SICK, Hokuyo and DP-SLAM and a message of Livox: our numbers against those of another reader (laser_expectations.py). */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { decodeLivoxCloud } from '../../npm/bag/messages.js';
import { scanReader } from '../../npm/formats/scan_messages.js';
import { isLdrobot, readLdrobot } from '../../npm/formats/ldrobot.js';
import { readScip } from '../../npm/formats/scip.js';
import { readSickBinary } from '../../npm/formats/sick.js';

/** @typedef {import('../../npm/formats/scan.js').Scan} Scan */
/** @typedef {{ start: number, step: number, ranges: (number | null)[], time: number | null, odometry?: number[] }} Expected */
const EXPECTED = JSON.parse(readFileSync(join(import.meta.dirname, 'laser_expectations.json'), 'utf8'));
const DEGREE = Math.PI / 180;

/** @param {string} name @returns {{ bytes: Buffer, text: string, scans: Expected[] }} */
function expected(name) {
  const { file, scans } = EXPECTED[name];
  const bytes = Buffer.from(file, 'base64');
  return { bytes, text: bytes.toString('latin1'), scans };
}

/** @param {number | undefined} value @param {number} wanted @param {string} what */
function near(value, wanted, what) {
  const off = Math.abs((value ?? Number.NaN) - wanted);
  assert.ok(off <= 1e-9 * Math.max(1, Math.abs(wanted)), `${what}: ${value} in place of ${wanted}`);
}

/** @param {readonly Scan[]} scans @param {readonly Expected[]} wanted @param {string} name */
function assertSame(scans, wanted, name) {
  assert.equal(scans.length, wanted.length, name);
  for (const [at, scan] of scans.entries()) {
    const want = /** @type {Expected} */ (wanted[at]);
    near(scan.start, DEGREE * want.start, `${name} start`);
    near(scan.step, DEGREE * want.step, `${name} step`);
    assert.equal(scan.ranges.length, want.ranges.length);
    for (const [beam, range] of scan.ranges.entries()) {
      const wantedRange = want.ranges[beam] ?? null;
      if (wantedRange === null) assert.equal(range, null, `${name} beam ${beam}`);
      else near(range ?? Number.NaN, wantedRange, `${name} beam ${beam}`);
    }
    if (want.time !== null) near(scan.time, want.time, `${name} time`);
    if (want.odometry) assert.deepEqual(scan.odometry, want.odometry);
  }
}

/** What the engine is given of a text, as scans. @param {string} text @returns {Scan[]} */
function read(text) {
  const lines = scanReader(text)?.(text, 'log', () => undefined) ?? '';
  return lines
    .trim()
    .split('\n')
    .map((line) => JSON.parse(line))
    .map(({ readings, min_theta, max_theta, timestamp, odometry }) => {
      const step = (max_theta - min_theta) / (readings.length - 1);
      return { ranges: readings, start: min_theta, step, time: timestamp, odometry };
    });
}

test('SICK, binary and text', () => {
  const { bytes, scans } = expected('sick_binary');
  assertSame(readSickBinary(new Uint8Array(bytes)).scans, scans, 'binary');
  const printed = expected('sick_text');
  assertSame(read(printed.text), printed.scans, 'text');
});

test('Hokuyo: two and three characters a range, groups of steps, with and without parameters', () => {
  for (const name of ['scip_gs', 'scip_md', 'scip_gd']) {
    const { text, scans } = expected(name);
    assertSame(readScip(text).scans, scans, name);
    assertSame(read(text.replaceAll('\n', '\r\n')), scans, name);
  }
  // A damaged answer and one that is cut off cost nothing else.
  const { text, scans } = expected('scip_gs');
  const [first = '', second = ''] = text.split(/(?=^GS)/m);
  const block = first.split('\n')[4] ?? '';
  const broken = first.replace(block, `${block.slice(0, 10)}~${block.slice(11)}`);
  assert.notEqual(broken, first);
  const { scans: left, numBroken } = readScip(`${broken}${second}${first.slice(0, 300)}`);
  assert.equal(numBroken, 2);
  assertSame(left, scans.slice(1), 'the whole one');
});

test("DP-SLAM's log", () => {
  const { text, scans } = expected('dp_slam');
  assertSame(read(text), scans, 'DP-SLAM');
});

test("Livox' message", () => {
  const { file, stamp, positions } = EXPECTED.livox;
  const cloud = decodeLivoxCloud(new Uint8Array(Buffer.from(file, 'base64')));
  assert.deepEqual([cloud.stamp.sec, cloud.stamp.nsec], stamp);
  const { buffer, byteOffset, byteLength } = cloud.data;
  const values = [...new Float32Array(buffer, byteOffset, byteLength / 4)];
  assert.deepEqual(
    values.filter((_, at) => at % 4 < 3),
    positions,
  );
});

test("the packet that LDROBOT's manual explains", () => {
  const packet = Buffer.from(
    '542c6808ab7ee000e4dc00e2d900e5d500e3d300e4d000e9cd00e4ca00e2c700e9c500e5c200e5c000e5be823a1a50',
    'hex',
  );
  const bytes = new Uint8Array(Buffer.concat([Buffer.of(0x54, 0x2c, 7), packet, packet]));
  assert.ok(isLdrobot(bytes));
  const [scan] = readLdrobot(bytes).scans;
  // 324.27 degrees, clockwise; 224 mm and so on to 192 mm at 334.7 degrees; 6714 ms.
  assert.deepEqual(scan?.ranges.slice(0, 12), [224, 220, 217, 213, 211, 208, 205, 202, 199, 197, 194, 192].map((mm) => 1e-3 * mm)); // prettier-ignore
  near(scan?.angles?.[0], -324.27 * DEGREE, 'first');
  near(scan?.angles?.[11], -334.7 * DEGREE, 'last');
  near(scan?.time, 6.714, 'time');
  // A sum that does not fit is no packet.
  assert.ok(!isLdrobot(new Uint8Array(Buffer.concat([packet, packet]).fill(1, 20, 21))));
});
