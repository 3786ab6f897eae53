/** A map as GeoTIFF: its greys, and where they lie in the world of the map (OGC 19-008r4; TIFF 6.0, baseline). */
import { type Grid, inWorld } from './wall_lines.js';

/** Types of values in a directory of TIFF, with the bytes of one. */
const [ASCII, SHORT, LONG, DOUBLE] = [2, 3, 4, 12] as const;
const BYTES = { [ASCII]: 1, [SHORT]: 2, [LONG]: 4, [DOUBLE]: 8 } as const;
type Entry = readonly [tag: number, type: keyof typeof BYTES, values: readonly number[]];

const HEADER_BYTES = 8;
const ENTRY_BYTES = 12;
/** The name of the coordinates: metres of the map, which lies nowhere on the earth. */
const NAME = 'Map (m)|';
/** The grey of unknown cells, as text. */
const NO_DATA = '205';

type Placed = Omit<Grid, 'grey_values'>;

/** One strip of greys without compression, the row of the largest y first. */
export function geoTiff(grid: Placed, greys: Uint8Array): Uint8Array<ArrayBuffer> {
  const pixels = HEADER_BYTES;
  const directory = pixels + greys.length + (greys.length % 2);
  const entries = entriesOf(grid, pixels, greys.length);
  const overflows = entries.map(([, type, values]) => overflowBytes(BYTES[type] * values.length));
  const first = directory + 2 + ENTRY_BYTES * entries.length + 4;
  const file = new Uint8Array(overflows.reduce((sum, bytes) => sum + bytes, first));
  const view = new DataView(file.buffer);
  // Little-endian; 42 names the format.
  file.set([0x49, 0x49, 42, 0]);
  view.setUint32(4, directory, true);
  file.set(greys, pixels);
  view.setUint16(directory, entries.length, true);
  let overflow = first;
  entries.forEach(([tag, type, values], index) => {
    const at = directory + 2 + ENTRY_BYTES * index;
    view.setUint16(at, tag, true);
    view.setUint16(at + 2, type, true);
    view.setUint32(at + 4, values.length, true);
    const bytes = overflows[index] ?? 0;
    if (bytes > 0) view.setUint32(at + 8, overflow, true);
    write(view, bytes > 0 ? overflow : at + 8, type, values);
    overflow += bytes;
  });
  return file;
}

/** In the order of their tags, as the format asks for it. */
function entriesOf(grid: Placed, pixels: number, numBytes: number): Entry[] {
  const { width, height } = grid;
  return [
    [256, LONG, [width]],
    [257, LONG, [height]],
    [258, SHORT, [8]], // bits per sample
    [259, SHORT, [1]], // no compression
    [262, SHORT, [1]], // 0 is black
    [273, LONG, [pixels]], // the strip's offset, ...
    [277, SHORT, [1]], // samples per pixel
    [278, LONG, [height]], // ... rows ...
    [279, LONG, [numBytes]], // ... and bytes
    [34264, DOUBLE, transformation(grid)],
    [34735, SHORT, GEO_KEYS.flat()],
    [34737, ASCII, codes(`${NAME}\0`)],
    [42113, ASCII, codes(`${NO_DATA}\0`)], // GDAL's value of no data
  ];
}

/** GeoKeyDirectoryTag: version 1.1.0 and the number of keys; then each key, where its values are, how many, and the value or the offset. */
const GEO_KEYS: readonly (readonly [number, number, number, number])[] = [
  [1, 1, 0, 4],
  [1024, 0, 1, 32767], // GTModelType: user-defined, neither projected nor geographic
  [1025, 0, 1, 1], // GTRasterType: a pixel is an area
  [1026, 34737, NAME.length, 0], // GTCitation
  [3076, 0, 1, 9001], // ProjLinearUnits: metre
];

/** ModelTransformationTag: from columns and rows, counted from the upper left corner, to x and y. It holds the turn of the map, too. */
function transformation(grid: Placed): number[] {
  const [along, up] = [grid.resolution * Math.cos(grid.yaw), grid.resolution * Math.sin(grid.yaw)];
  const [x, y] = inWorld(grid, [0, grid.height]);
  return [along, up, 0, x, up, -along, 0, y, 0, 0, 0, 0, 0, 0, 0, 1];
}

function codes(text: string): number[] {
  return [...text].map((letter) => letter.charCodeAt(0));
}

/** Bytes beside the directory, where a value does not fit into its entry; an even number. */
function overflowBytes(bytes: number): number {
  return bytes > 4 ? bytes + (bytes % 2) : 0;
}

function write(view: DataView, at: number, type: keyof typeof BYTES, values: readonly number[]): void {
  values.forEach((value, index) => {
    const place = at + BYTES[type] * index;
    if (type === ASCII) view.setUint8(place, value);
    else if (type === SHORT) view.setUint16(place, value, true);
    else if (type === LONG) view.setUint32(place, value, true);
    else view.setFloat64(place, value, true);
  });
}
