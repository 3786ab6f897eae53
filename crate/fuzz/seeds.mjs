// Writes the seed corpora: small files of every encoding and of many layouts, and the project's own test files.
import { copyFileSync, mkdirSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

const here = import.meta.dirname ?? new URL('.', import.meta.url).pathname;
const corpus = (target) => {
  const folder = join(here, 'corpus', target);
  mkdirSync(folder, { recursive: true });
  return folder;
};

/** How a value of each type is written, most significant byte first or last. */
const WRITERS = {
  char: (view, value) => (view.setInt8(0, value), 1),
  uchar: (view, value) => (view.setUint8(0, value), 1),
  int16: (view, value, little) => (view.setInt16(0, value, little), 2),
  ushort: (view, value, little) => (view.setUint16(0, value, little), 2),
  int32: (view, value, little) => (view.setInt32(0, value, little), 4),
  uint: (view, value, little) => (view.setUint32(0, value, little), 4),
  float: (view, value, little) => (view.setFloat32(0, value, little), 4),
  double: (view, value, little) => (view.setFloat64(0, value, little), 8),
};

const xyz = (type) => ['x', 'y', 'z'].map((name) => [name, type]);
const normals = ['nx', 'ny', 'nz'].map((name) => [name, 'float']);
const colors = (type) => ['red', 'green', 'blue'].map((name) => [name, type]);
const list = ['list uchar int neighbours', 'list'];

/** Elements of properties: the vertices, with others around them. */
const LAYOUTS = {
  float: { vertex: xyz('float') },
  double: { vertex: xyz('double') },
  planar: { vertex: xyz('float').slice(0, 2) },
  reversed: { vertex: [...xyz('float')].reverse() },
  mixed: { vertex: [['x', 'char'], ['i', 'uint'], ['y', 'int16'], ['z', 'ushort']] },
  integer: { vertex: xyz('int32') },
  full: { vertex: [...xyz('float'), ...normals, ...colors('uchar')] },
  wide_colors: { vertex: [...xyz('float'), ...colors('ushort')] },
  float_colors: { vertex: [...xyz('double'), ...colors('float')] },
  lists: { vertex: [['x', 'float'], list, ['y', 'float'], ['z', 'float']] },
  around: { range: [['r', 'uchar']], face: [list], vertex: xyz('float'), edge: [list] },
};

for (const [name, elements] of Object.entries(LAYOUTS)) {
  for (const format of ['ascii', 'binary_little_endian', 'binary_big_endian']) {
    let header = `ply\nformat ${format} 1.0\ncomment seed\nobj_info seed\n`;
    const body = [];
    const write = (type, value) => {
      if (format === 'ascii') {
        body.push(Buffer.from(`${value} `));
        return;
      }
      const buffer = Buffer.alloc(8);
      const size = WRITERS[type](new DataView(buffer.buffer, buffer.byteOffset), value, format.includes('little'));
      body.push(buffer.subarray(0, size));
    };
    for (const [element, properties] of Object.entries(elements)) {
      header += `element ${element} 3\n`;
      for (const [property, type] of properties) {
        header += `property ${type === 'list' ? property : `${type} ${property}`}\n`;
      }
      for (let instance = 0; instance < 3; instance++) {
        for (const [, type] of properties) {
          if (type === 'list') {
            write('uchar', instance);
            for (let item = 0; item < instance; item++) write('int32', item);
          } else {
            write(type, 40 * instance + 1);
          }
        }
        if (format === 'ascii') body.push(Buffer.from('\n'));
      }
    }
    const file = Buffer.concat([Buffer.from(`${header}end_header\n`), ...body]);
    writeFileSync(join(corpus('ply'), `${name}_${format}.ply`), file);
  }
}

/** Two points with a normal, a colour and a number, in the three ways of PCD; the packed one is LZF of literals alone. */
const pcd = (encoding, body) => {
  const header =
    '# seed\nVERSION 0.7\nFIELDS x y z rgb normal_x normal_y normal_z i\nSIZE 4 4 4 4 4 4 4 2\nTYPE F F F F F F F U\n' +
    `COUNT 1 1 1 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ${encoding}\n`;
  writeFileSync(join(corpus('pcd'), `${encoding}.pcd`), Buffer.concat([Buffer.from(header), body]));
};
const numbers = [[1.5, -2, 3.25, 1e-40, 0, 0, 1, 7], [0.5, 4, -1, 2e-40, 1, 0, 0, 8]];
pcd('ascii', Buffer.from(numbers.map((row) => `${row.join(' ')}\n`).join('')));
const column = (index, row) => {
  const view = new DataView(new ArrayBuffer(index === 7 ? 2 : 4));
  if (index === 7) view.setUint16(0, row[index], true);
  else view.setFloat32(0, row[index], true);
  return Buffer.from(view.buffer);
};
pcd('binary', Buffer.concat(numbers.flatMap((row) => row.map((_, index) => column(index, row)))));
const columns = Buffer.concat(numbers[0].flatMap((_, index) => numbers.map((row) => column(index, row))));
const sizes = Buffer.alloc(8);
const literals = [];
for (let at = 0; at < columns.length; at += 32) {
  const chunk = columns.subarray(at, at + 32);
  literals.push(Buffer.from([chunk.length - 1]), chunk);
}
const packed = Buffer.concat(literals);
sizes.writeUInt32LE(packed.length, 0);
sizes.writeUInt32LE(columns.length, 4);
pcd('binary_compressed', Buffer.concat([sizes, packed]));

/** 16 x 16 pixels: one after the other, and progressively. */
const JPEGS = {
  sequential:
    '/9j/2wBDABsSFBcUERsXFhceHBsgKEIrKCUlKFE6PTBCYFVlZF9VXVtqeJmBanGQc1tdhbWGkJ6jq62rZ4C8ybqmx5moq6T/2wBDARweHigjKE4rK06k' +
    'bl1upKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKT/wAARCAAQABADASIAAhEBAxEB/8QAFgABAQEAAAAAAAAA' +
    'AAAAAAAABAMF/8QAGBAAAgMAAAAAAAAAAAAAAAAAAAMEEUH/xAAUAQEAAAAAAAAAAAAAAAAAAAAA/8QAGxEAAgEFAAAAAAAAAAAAAAAAAAQCAxETMfD/' +
    '2gAMAwEAAhEDEQA/AMpUasHqjVgtUasLqjVgnWwdoKsXP//Z',
  progressive:
    '/9j/2wBDABsSFBcUERsXFhceHBsgKEIrKCUlKFE6PTBCYFVlZF9VXVtqeJmBanGQc1tdhbWGkJ6jq62rZ4C8ybqmx5moq6T/2wBDARweHigjKE4rK06k' +
    'bl1upKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKT/wgARCAAQABADAREAAhEBAxEB/8QAFQABAQAAAAAAAAAA' +
    'AAAAAAAAAwT/xAAYAQADAQEAAAAAAAAAAAAAAAAAAwQCBf/aAAwDAQACEAMQAAABkChz1xz0jq//xAAWEAADAAAAAAAAAAAAAAAAAAAAAQL/2gAIAQEA' +
    'AQUCUikUik//xAAVEQEBAAAAAAAAAAAAAAAAAAACAP/aAAgBAwEBPwEqKioq/8QAFhEBAQEAAAAAAAAAAAAAAAAAAQAR/9oACAECAQE/AVyXJcly/8QA' +
    'FBABAAAAAAAAAAAAAAAAAAAAIP/aAAgBAQAGPwIf/8QAFBABAAAAAAAAAAAAAAAAAAAAIP/aAAgBAQABPyEAH//aAAwDAQACAAMAAAAQhh//xAAVEQEB' +
    'AAAAAAAAAAAAAAAAAAAAEf/aAAgBAwEBPxCyyyz/xAAUEQEAAAAAAAAAAAAAAAAAAAAg/9oACAECAQE/EA23/8QAFhAAAwAAAAAAAAAAAAAAAAAAABFB' +
    '/9oACAEBAAE/EFwXBcFw/9k=',
};
for (const [name, base64] of Object.entries(JPEGS))
  writeFileSync(join(corpus('images'), `${name}.jpg`), Buffer.from(base64, 'base64'));
// Kinds of PNG: the number of the colours, and bits a channel. Checksums are not looked at while fuzzing.
const { deflateSync } = await import('node:zlib');
for (const [kind, bits, channels] of [[0, 16, 1], [0, 8, 1], [0, 1, 1], [2, 8, 3], [3, 4, 1], [4, 16, 2], [6, 8, 4]]) {
  for (const interlace of [0, 1]) {
    const part = (type, data) => {
      const length = Buffer.alloc(4);
      length.writeUInt32BE(data.length);
      return Buffer.concat([length, Buffer.from(type), data, Buffer.alloc(4)]);
    };
    const header = Buffer.from([0, 0, 0, 8, 0, 0, 0, 4, bits, kind, 0, 0, interlace]);
    // Bytes for both orders of the rows.
    const rows = deflateSync(Buffer.alloc(15 + 4 * Math.ceil((8 * bits * channels) / 8) * 2, 0));
    const palette = kind === 3 ? [part('PLTE', Buffer.alloc(48, 77))] : [];
    const parts = [part('IHDR', header), ...palette, part('IDAT', rows), part('IEND', Buffer.alloc(0))];
    const file = Buffer.concat([Buffer.from([0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10]), ...parts]);
    writeFileSync(join(corpus('images'), `png_${kind}_${bits}_${interlace}.png`), file);
  }
}
for (const [name, head, bytes] of [
  ['binary.pgm', 'P5\n3 2\n65535\n', 12],
  ['pixmap.ppm', 'P6\n# by hand\n3 2\n255\n', 18],
  ['metres.pfm', 'Pf\n3 2\n-1.0\n', 24],
])
  writeFileSync(join(corpus('images'), name), Buffer.concat([Buffer.from(head), Buffer.alloc(bytes, 63)]));
writeFileSync(join(corpus('images'), 'plain.pgm'), 'P2\n3 2\n9\n1 2 3\n4 5 9\n');

/** A log of each kind. */
const LOGS = {
  carmen: 'PARAM robot_front_laser_max 10\nFLASER 3 1.0 2.0 3.5 0.1 0 0 0 0 0 1.5 h 1\nODOM 0 0 0 0 0 0 2 h 2\n',
  robotlaser: 'ROBOTLASER1 0 -1.57 3.14 1.57 30 0.01 0 3 1 2 3 0 0 0 0 0 0 0 0 0 0 0 7.5 h 0.1\n',
  csm: '{"nrays":3,"min_theta":-1,"max_theta":1,"readings":[1,null,3],"theta":[-1,0,1],"odometry":[0,0,0]}\n',
  cmu: 'L 10 20 0.5 10 20 0.5 100 200 300 1.5\nO 10 20 0.5 1.6\n',
  rostopic:
    '%time,field.header.seq,field.header.stamp,field.angle_min,field.angle_max,field.angle_increment,field.range_min,field.range_max,field.ranges0,field.ranges1,field.ranges2\n' +
    '1,0,1500000000,-1,1,1,0.1,10,1,2,3\n2,1,1600000000,-1,1,1,0.1,10,1,inf,3\n',
};
for (const [name, text] of Object.entries(LOGS)) writeFileSync(join(corpus('laser_log'), name), text);
/** Trajectories, relations and cameras of each kind. */
const TEXTS = {
  euroc: '#timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z\n1403636580838555648,4.6,-1.8,0.8,0.6,-0.1,-0.8,0\n',
  kitti: '1 0 0 1.5 0 1 0 0 0 0 1 2\n1 0 0 1.6 0 1 0 0 0 0 1 2\n',
  table: 'time,x,y,yaw\n0.1,1,2,0.5\n0.2,1,2,0.6\n',
  relations: '0.5 1.5 1.0 0.2 0 0 0 0.1\n',
  open3d: '{"width":640,"height":480,"intrinsic_matrix":[525,0,0,0,525,0,319.5,239.5,1]}',
};
for (const [name, text] of Object.entries(TEXTS)) writeFileSync(join(corpus('trajectory'), name), text);

const own = join(here, '../../tests/data');
for (const file of readdirSync(own)) {
  if (file.endsWith('.ply')) copyFileSync(join(own, file), join(corpus('ply'), file));
  if (file.endsWith('.tum') || file.endsWith('.csv')) copyFileSync(join(own, file), join(corpus('trajectory'), file));
}
