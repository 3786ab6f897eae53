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

const own = join(here, '../../tests/data');
for (const file of readdirSync(own)) {
  if (file.endsWith('.ply')) copyFileSync(join(own, file), join(corpus('ply'), file));
  if (file.endsWith('.tum') || file.endsWith('.csv')) copyFileSync(join(own, file), join(corpus('trajectory'), file));
}
