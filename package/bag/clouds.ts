/**
 * Clouds of ROS as PCD files with the same fields, in binary.
 *
 * Source: sensor_msgs/PointField; "The PCD (Point Cloud Data) file format", version 0.7.
 */
import { MessageError } from './cdr.js';
import { BYTES_OF_TYPE, type CloudMessage } from './messages.js';

/** The letter of a type in a PCD file: that of PointField's number of the type. */
const LETTERS = ' IUIUIUFF';

type Column = { name: string; offset: number; count: number; bytes: number; letter: string };

export function cloudFile(cloud: CloudMessage) {
  const { width, height, pointStep, data, bigEndian } = cloud;
  const columns = columnsOf(cloud);
  const rowStep = cloud.rowStep === 0 || height <= 1 ? width * pointStep : cloud.rowStep;
  const numPoints = width * height;
  if (numPoints === 0) throw new MessageError('The cloud has no points', 'Leave it out');
  const needed = rowStep * (height - 1) + width * pointStep;
  if (rowStep < width * pointStep || data.length < needed) {
    const said = `${width} x ${height} points of ${pointStep} bytes, rows of ${rowStep}`;
    throw new MessageError(`The cloud is shorter than its header says: ${said}, and it has ${data.length} bytes`);
  }
  const size = columns.reduce((sum, { bytes, count }) => sum + bytes * count, 0);
  const header = headerOf(columns, width, height);
  const file = new Uint8Array(header.length + numPoints * size);
  file.set(header);
  const isPacked = !bigEndian && size === pointStep && columns.every(({ offset }, i) => offset === startOf(columns, i));
  let out = header.length;
  for (let row = 0; row < height; row += 1) {
    const start = row * rowStep;
    if (isPacked) {
      file.set(data.subarray(start, start + width * pointStep), out);
      out += width * pointStep;
    } else {
      for (let point = 0; point < width; point += 1) {
        copyPoint(file, out, data, start + point * pointStep, columns, bigEndian);
        out += size;
      }
    }
  }
  return file;
}

/** @returns the header of a PCD file */
function headerOf(columns: readonly Column[], width: number, height: number): Uint8Array {
  const line = (value: (column: Column) => string | number) => columns.map(value).join(' ');
  return new TextEncoder().encode(
    [
      'VERSION 0.7',
      `FIELDS ${line(({ name }) => name)}`,
      `SIZE ${line(({ bytes }) => bytes)}`,
      `TYPE ${line(({ letter }) => letter)}`,
      `COUNT ${line(({ count }) => count)}`,
      `WIDTH ${width}`,
      `HEIGHT ${height}`,
      'VIEWPOINT 0 0 0 1 0 0 0',
      `POINTS ${width * height}`,
      'DATA binary\n',
    ].join('\n'),
  );
}

/** The fields in the order in which they lie in a point, without gaps. */
function columnsOf({ fields, pointStep }: CloudMessage) {
  const columns = fields.map(({ name, offset, datatype, count }) => {
    const bytes = BYTES_OF_TYPE[datatype];
    if (bytes === undefined) throw new MessageError(`The cloud's field ${name} has the unknown data type ${datatype}`);
    // A count of zero means one, as older recorders write it.
    const letter = LETTERS[datatype] ?? '';
    const column = { name: name.replaceAll(/\s+/g, '_') || '_', offset, count: Math.max(1, count), bytes, letter };
    if (offset + column.count * column.bytes > pointStep) {
      throw new MessageError(`The cloud's field ${name} lies outside its points of ${pointStep} bytes`);
    }
    return column;
  });
  for (const axis of ['x', 'y', 'z']) {
    if (!columns.some(({ name }) => name === axis)) {
      throw new MessageError(`The cloud's points have no ${axis}`, 'Choose a topic with points in space');
    }
  }
  return columns.sort((a, b) => a.offset - b.offset);
}

function startOf(columns: Column[], index: number) {
  return columns.slice(0, index).reduce((sum, { bytes, count }) => sum + bytes * count, 0);
}

function copyPoint(
  file: Uint8Array,
  out: number,
  data: Uint8Array,
  point: number,
  columns: Column[],
  bigEndian: boolean,
) {
  let place = out;
  for (const { offset, count, bytes } of columns) {
    for (let value = 0; value < count; value += 1) {
      const start = point + offset + value * bytes;
      for (let byte = 0; byte < bytes; byte += 1) {
        file[place + byte] = data[start + (bigEndian ? bytes - 1 - byte : byte)] ?? 0;
      }
      place += bytes;
    }
  }
}
