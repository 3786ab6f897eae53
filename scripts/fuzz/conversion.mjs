// @ts-check
/** Damaged files of the formats that are converted before the engine reads them: each is converted, or told, in little time. */
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { gzipSync } from 'fflate';
import { convertFiles } from '../../npm/formats/convert.js';
import { fileInMemory } from '../../npm/files/content.js';
import { ROOT } from '../steps.mjs';
import { mustBeTold } from './random.mjs';

/** @typedef {import('./random.mjs').Random} Random */
const BEAMS = 30;
const RANGES = Array.from({ length: BEAMS }, (_, beam) => 2 + 0.1 * beam);
const repeated = (/** @type {string} */ text) => text.repeat(3);
const ECHO = `header:\n  stamp:\n    sec: 1\n    nanosec: 0\nangle_min: -1.5\nangle_max: 1.5\nangle_increment: 0.1\nrange_min: 0.1\nrange_max: 9.0\nranges: [${RANGES.join(', ')}]\n---\n`;
const REPR = `LaserScan(header=Header(), angle_min=-1.5, angle_max=1.5, angle_increment=0.1, ranges=[${RANGES.join(', ')}])\n`;
const SICK = `sSN LMDscandata 1 1 89A27F 0 0 343 347 27477BA9 2747813B 0 0 7 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 1E ${RANGES.map((range) => Math.round(1000 * range).toString(16)).join(' ')} 0 0 0 0 0\n`;
const PLAYER = `1.1 16777343 6665 laser 00 001 001 7 -1.5 1.5 0.1 8.0 ${BEAMS} ${RANGES.map((range) => `${range} 0`).join(' ')}\n`;
const RPLIDAR = RANGES.map((range, at) => `   theta: ${at}.50 Dist: ${1000 * range} Q: 47\n`).join('');

/** Names with the text of a file. @type {Record<string, string>} */
const TEXTS = {
  'scan.yaml': repeated(ECHO),
  'scans.json': JSON.stringify([{ ranges: RANGES, angle_min: -1.5, angle_increment: 0.1 }]),
  'numbers.json': JSON.stringify([RANGES, RANGES]),
  'python.txt': repeated(REPR),
  'sick.log': repeated(SICK),
  'player.log': repeated(PLAYER),
  'dpslam.log': repeated(`Odometry 1 2 0.5\nLaser ${BEAMS} ${RANGES.join(' ')}\n`),
  'rplidar.txt': repeated(`S  theta: 0.10 Dist: 1200.00 Q: 47\n${RPLIDAR}`),
  'listener.txt': repeated(
    `[INFO]: I heard a laser scan laser[30]:\n${RANGES.map((range, at) => `[INFO]: : [${at}.5, ${range}]\n`).join('')}`,
  ),
  'neato.txt': repeated(
    `GetLDSScan\nAngleInDegrees,DistInMM,Intensity,ErrorCodeHEX\n${RANGES.map((range, at) => `${at},${1000 * range},9,0\n`).join('')}ROTATION_SPEED,5.0\n`,
  ),
  'drive.2d': `LaserOdometryLog\nsick1conf: -90 90 30\n${repeated(`time: 1.5\nrobot: 10 20 30\nsick1: ${RANGES.map((range) => 1000 * range).join(' ')}\nscan1: 1 2 3 4 5 6\n`)}`,
  'numbered.csv': `scan_id,x,y\n${RANGES.map((range) => `7,${range},${-range}\n`).join('')}`,
  'pairs.txt': repeated(`${RANGES.map((range, at) => `${range - 3} ${at - 15}`).join(' ')}\n`),
  'points.json': JSON.stringify([{ points: RANGES.map((range) => [range, -range]) }]),
  'ld06.txt': '54 2c 10 0e 00 00 '.repeat(60),
  'plane_0.pcd': `VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 30\nHEIGHT 1\nPOINTS 30\nDATA ascii\n${RANGES.map((range) => `${range} 1 0\n`).join('')}`,
  'polar.txt': RANGES.map((range, at) => `${3 * at},${range}\n`).join(''),
  'points.xyz': RANGES.map((range, at) => `${at} ${range} 1\n`).join(''),
  'scan.ptx': `2\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 2 3 0.5\n2 2 3 0.5\n3 2 3 0.5\n4 2 3 0.5\n`,
};

/** A telegram as it comes from a socket: four bytes 02, its length, its content, the checksum. */
function sickBinary() {
  const body = new Uint8Array(83 + 2 * BEAMS);
  const view = new DataView(body.buffer);
  body.set(new TextEncoder().encode('sSN LMDscandata '));
  view.setUint16(54, 1);
  body.set(new TextEncoder().encode('DIST1'), 56);
  view.setFloat32(61, 1);
  view.setInt32(69, -50_000);
  view.setUint16(73, 5000);
  view.setUint16(75, BEAMS);
  RANGES.forEach((range, at) => view.setUint16(77 + 2 * at, 1000 * range));
  const head = new Uint8Array(8).fill(2, 0, 4);
  new DataView(head.buffer).setUint32(4, body.length);
  return [...head, ...body, body.reduce((sum, byte) => sum ^ byte, 0)];
}

/** Logs of the tests, by a reader of another's. */
const EXPECTED = JSON.parse(readFileSync(join(ROOT, 'tests', 'cli', 'laser_expectations.json'), 'utf8'));
const LASERS = ['scip_gs', 'scip_gd', 'sick_binary'].map((name) => {
  const bytes = new Uint8Array(Buffer.from(EXPECTED[name].file, 'base64'));
  return /** @type {[string, Uint8Array]} */ ([`${name}.dat`, bytes]);
});
const PACKET = Uint8Array.from([
  ...[0x54, 0x2c, 0x68, 0x08, 0xab, 0x7e, 0xe0, 0x00, 0xe4, 0xdc, 0x00, 0xe2, 0xd9, 0x00, 0xe5, 0xd5, 0x00, 0xe3, 0xd3],
  ...[0x00, 0xe4, 0xd0, 0x00, 0xe9, 0xcd, 0x00, 0xe4, 0xca, 0x00, 0xe2, 0xc7, 0x00, 0xe9, 0xc5, 0x00, 0xe5, 0xc2, 0x00],
  ...[0xe5, 0xc0, 0x00, 0xe5, 0xbe, 0x82, 0x3a, 0x1a, 0x50],
]);

/** @type {[name: string, bytes: Uint8Array][]} */
const FILES = [
  ...Object.entries(TEXTS).map(
    ([name, text]) => /** @type {[string, Uint8Array]} */ ([name, new TextEncoder().encode(text)]),
  ),
  ...LASERS,
  ['sick.bin', Uint8Array.from([...sickBinary(), ...sickBinary()])],
  ['ld19.bin', Uint8Array.from([...PACKET, ...PACKET, ...PACKET])],
  ['scan.yaml.gz', gzipSync(new TextEncoder().encode(ECHO))],
  ['000000.bin', new Uint8Array(Float32Array.from(RANGES.slice(0, 28)).buffer)],
  ...['npy', 'mat'].flatMap((folder) => {
    const path = join(ROOT, 'tests', 'data', folder);
    const names = readdirSync(path).filter((name) => !name.endsWith('.py'));
    return names.map(
      (name) => /** @type {[string, Uint8Array]} */ ([name, new Uint8Array(readFileSync(join(path, name)))]),
    );
  }),
];

/** Milliseconds in which a few small files must be converted, also on a busy machine. */
const MOST_MILLISECONDS = 5000;

/** @param {Random} random */
export async function conversion(random) {
  const chosen = Array.from({ length: 1 + random.below(3) }, () => random.one(FILES));
  const damaged = chosen.map(([name, bytes]) => fileInMemory(name, random.damaged(bytes)));
  const start = performance.now();
  try {
    const { files } = await convertFiles(damaged, (made) => made);
    for (const file of files) {
      await file.readHead(100).catch(mustBeTold);
      await file.read().catch(mustBeTold);
    }
  } catch (error) {
    mustBeTold(error);
  }
  const milliseconds = performance.now() - start;
  if (milliseconds > MOST_MILLISECONDS) throw new Error(`converted after ${milliseconds} ms`);
  return (await damaged[0]?.read()) ?? new Uint8Array();
}
