/** A small furnished room, seen by a depth camera that walks through it: rendered here, so that the truth is known. */
import { crc32, deflateSync } from 'node:zlib';
import type { InputFile } from './scanstitch_page.js';

type Vec3 = readonly [number, number, number];
interface Box {
  low: Vec3;
  high: Vec3;
  color: Vec3;
}

export const WIDTH = 160;
export const HEIGHT = 120;
/** 90 degrees across. */
export const FOCAL = WIDTH / 2;

/** x right, y down, z forward of the first camera, which stands 1.4 m above the floor. The room is seen from inside. */
const ROOM: Box = { low: [-3, -1.1, -2], high: [2.5, 1.4, 4], color: [205, 200, 190] };
const FURNITURE: readonly Box[] = [
  { low: [-2.9, 0.3, 2.4], high: [-1.6, 1.4, 3.9], color: [150, 90, 60] },
  { low: [0.6, 0.7, 1.6], high: [1.9, 1.4, 2.5], color: [70, 110, 160] },
  { low: [-0.5, -0.2, 3.4], high: [0.5, 1.4, 3.9], color: [90, 140, 90] },
  { low: [1.9, -0.9, -1.5], high: [2.5, 1.4, 0.2], color: [180, 160, 80] },
  { low: [-2.9, 0.6, -1.8], high: [-1.9, 1.4, 0.4], color: [170, 70, 90] },
];

export interface TruePose {
  x: number;
  z: number;
  heading: number;
}

/** So many steps lead along the arc, before the camera goes back: frames of one place are rendered once. */
const NUM_STEPS = 15;

/** An arc through the room, to and fro. */
export function walk(num_frames: number): TruePose[] {
  return Array.from({ length: num_frames }, (_, i) => {
    const step = stepOf(i);
    return { x: -0.05 * step, z: 0.03 * step, heading: -0.07 * step };
  });
}

const stepOf = (frame: number): number => Math.abs(((frame + NUM_STEPS) % (2 * NUM_STEPS)) - NUM_STEPS);

/** depth/N.png (16 bits, so many values per metre), rgb/N.png, and the camera. */
export function recording(num_frames: number, first = 0, per_metre = 1000): InputFile[] {
  const files = walk(first + num_frames)
    .slice(first)
    .flatMap((pose, i) => frameFiles(pose, first + i + 1, per_metre));
  const intrinsics = `${FOCAL} 0 ${WIDTH / 2}\n0 ${FOCAL} ${HEIGHT / 2}\n0 0 1\n`;
  return [...files, { name: 'room/camera-intrinsics.txt', content: intrinsics }];
}

/** Depth and colours that were rendered for frames before. */
const rendered = new Map<string, readonly [Buffer, Buffer]>();

function frameFiles(pose: TruePose, number: number, per_metre: number): readonly InputFile[] {
  const key = `${stepOf(number - 1)} ${per_metre}`;
  const [depth, color] = rendered.get(key) ?? imagesOf(pose, per_metre);
  rendered.set(key, [depth, color]);
  return [
    { name: `room/depth/${number}.png`, content: depth },
    { name: `room/rgb/${number}.png`, content: color },
  ];
}

function imagesOf(pose: TruePose, per_metre: number): [Buffer, Buffer] {
  const { depth, color } = render(pose);
  const values = depth.map((value) => Math.round((value * per_metre) / 1000));
  return [png(values, 16, 'grey'), png(color, 8, 'colour')];
}

/** The true path, as TUM writes it. */
export function truth(num_frames: number): InputFile {
  const lines = walk(num_frames).map(
    ({ x, z, heading }, i) => `${i} ${x} 0 ${z} 0 ${Math.sin(heading / 2)} 0 ${Math.cos(heading / 2)}`,
  );
  return { name: 'room/truth.txt', content: `${lines.join('\n')}\n` };
}

/** A depth image of this one value. */
export function evenDepth(value: number): Buffer {
  return png(new Uint16Array(WIDTH * HEIGHT).fill(value), 16, 'grey');
}

/** A colour image of 8 bits, such as is dropped in the place of depth. */
export function colorPicture(): Buffer {
  return png(render(walk(1)[0] as TruePose).color, 8, 'colour');
}

/** Depth in millimetres and colours, row by row. */
export function render({ x, z, heading }: TruePose): { depth: Uint16Array; color: Uint8Array } {
  const depth = new Uint16Array(WIDTH * HEIGHT);
  const color = new Uint8Array(3 * WIDTH * HEIGHT);
  const eye: Vec3 = [x, 0, z];
  const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
  for (let v = 0; v < HEIGHT; v++) {
    for (let u = 0; u < WIDTH; u++) {
      const [a, b] = [(u - WIDTH / 2) / FOCAL, (v - HEIGHT / 2) / FOCAL];
      // z of the ray is 1 in the camera's frame: what it hits at t lies t metres ahead.
      const ray: Vec3 = [cos * a + sin, b, cos - sin * a];
      let t = leaves(ROOM, eye, ray);
      let hit = ROOM;
      for (const box of FURNITURE) {
        const here = enters(box, eye, ray);
        if (here < t) [t, hit] = [here, box];
      }
      const at = v * WIDTH + u;
      depth[at] = Math.round(t * 1000);
      const place = [0, 1, 2].map((k) => (eye[k] ?? 0) + t * (ray[k] ?? 0));
      const checker = place.reduce((sum, p) => sum + Math.floor(p * 2.5 + 1e-3), 0) % 2 === 0 ? 1 : 0.82;
      for (let k = 0; k < 3; k++) color[3 * at + k] = (hit.color[k] ?? 0) * checker;
    }
  }
  return { depth, color };
}

function span(box: Box, eye: Vec3, ray: Vec3): [number, number] {
  let [near, far] = [Number.NEGATIVE_INFINITY, Number.POSITIVE_INFINITY];
  for (let k = 0; k < 3; k++) {
    const inverse = 1 / (ray[k] || 1e-12);
    const ends = [((box.low[k] ?? 0) - (eye[k] ?? 0)) * inverse, ((box.high[k] ?? 0) - (eye[k] ?? 0)) * inverse];
    near = Math.max(near, Math.min(...ends));
    far = Math.min(far, Math.max(...ends));
  }
  return [near, far];
}

const leaves = (box: Box, eye: Vec3, ray: Vec3): number => span(box, eye, ray)[1];

function enters(box: Box, eye: Vec3, ray: Vec3): number {
  const [near, far] = span(box, eye, ray);
  return near <= far && near > 0 ? near : Number.POSITIVE_INFINITY;
}

/** A PNG file, without filters. */
function png(values: Uint16Array | Uint8Array, bits: 8 | 16, kind: 'grey' | 'colour'): Buffer {
  const row_bytes = (WIDTH * (kind === 'colour' ? 3 : 1) * bits) / 8;
  const rows = Buffer.alloc(HEIGHT * (1 + row_bytes));
  values.forEach((value, i) => {
    const per_row = values.length / HEIGHT;
    const at = Math.floor(i / per_row) * (1 + row_bytes) + 1 + ((i % per_row) * bits) / 8;
    if (bits === 16) rows.writeUInt16BE(value, at);
    else rows.writeUInt8(value, at);
  });
  const header = Buffer.alloc(13);
  header.writeUInt32BE(WIDTH, 0);
  header.writeUInt32BE(HEIGHT, 4);
  header.set([bits, kind === 'colour' ? 2 : 0, 0, 0, 0], 8);
  const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
  return Buffer.concat([
    signature,
    chunk('IHDR', header),
    chunk('IDAT', deflateSync(rows, { level: 1 })),
    chunk('IEND', Buffer.alloc(0)),
  ]);
}

function chunk(type: string, data: Buffer): Buffer {
  const body = Buffer.concat([Buffer.from(type, 'latin1'), data]);
  const [length, checksum] = [Buffer.alloc(4), Buffer.alloc(4)];
  length.writeUInt32BE(data.length);
  checksum.writeUInt32BE(crc32(body));
  return Buffer.concat([length, body, checksum]);
}
