/** A map as pictures, each half as large as the one before: at any zoom one of about the screen's size is drawn. */
import type { GridPicture } from './protocol.js';

export interface MapLevels {
  grid: GridPicture;
  /** `cells`: side of a pixel in cells of the map. */
  levels: readonly { image: HTMLCanvasElement; cells: number }[];
}

interface Codes {
  width: number;
  height: number;
  values: Uint8Array;
}

/** Browsers draw no larger canvas everywhere: pixels, and pixels a side. */
const MOST_PIXELS = 2 ** 24;
const MOST_SIDE = 8192;
/** No smaller picture is needed, pixels a side. */
const LEAST_SIDE = 256;

/** Red, green and blue of each kind of cell, on a light page and on a dark one. */
const SHADES = {
  light: { free: [255, 255, 255], occupied: [28, 38, 51], unknown: [221, 226, 233] },
  dark: { free: [45, 54, 66], occupied: [228, 234, 242], unknown: [18, 23, 30] },
} as const;
const [OCCUPIED, FREE] = [0, 254];

export function mapLevels(grid: GridPicture, dark: boolean): MapLevels {
  return levelsOf(grid, grid.grey_values, colorTable(dark));
}

/** The likelihood field of a map, 0 to 255 a cell: what is likely is drawn as walls are, what is not as free space. */
export function fieldLevels(grid: GridPicture, likelihoods: Uint8Array, dark: boolean): MapLevels {
  // As a small code counts more where cells are joined.
  const codes = likelihoods.map((likelihood) => 255 - likelihood);
  return levelsOf(grid, codes, shadeTable(dark));
}

function levelsOf(grid: GridPicture, values: Uint8Array, colors: Uint32Array): MapLevels {
  const levels: { image: HTMLCanvasElement; cells: number }[] = [];
  let codes: Codes = { width: grid.width, height: grid.height, values };
  for (let cells = 1; ; cells *= 2) {
    const { width, height } = codes;
    const side = Math.max(width, height);
    if (side <= MOST_SIDE && width * height <= MOST_PIXELS) levels.push({ image: picture(codes, colors), cells });
    if (side <= LEAST_SIDE) return { grid, levels };
    codes = halved(codes);
  }
}

/** A cell is occupied where one of its four is, and free where all are: no wall is lost. */
function halved({ width, height, values }: Codes): Codes {
  const [halfWidth, halfHeight] = [(width + 1) >> 1, (height + 1) >> 1];
  const half = new Uint8Array(halfWidth * halfHeight);
  for (let row = 0, k = 0; row < halfHeight; row++) {
    const above = 2 * row * width;
    const below = 2 * row + 1 < height ? above + width : above;
    for (let column = 0; column < halfWidth; column++, k++) {
      const left = 2 * column;
      const right = left + 1 < width ? left + 1 : left;
      half[k] = Math.min(
        values[above + left] ?? FREE,
        values[above + right] ?? FREE,
        values[below + left] ?? FREE,
        values[below + right] ?? FREE,
      );
    }
  }
  return { width: halfWidth, height: halfHeight, values: half };
}

/** Pixels as 32-bit numbers by their code; every platform with WebAssembly is little-endian here. */
function colorTable(dark: boolean): Uint32Array {
  const { free, occupied, unknown } = dark ? SHADES.dark : SHADES.light;
  return Uint32Array.from({ length: 256 }, (_, code) => {
    const [red, green, blue] = code === FREE ? free : code === OCCUPIED ? occupied : unknown;
    return packed(red, green, blue);
  });
}

/** From the colour of walls to that of free space. */
function shadeTable(dark: boolean): Uint32Array {
  const { free, occupied } = dark ? SHADES.dark : SHADES.light;
  return Uint32Array.from({ length: 256 }, (_, code) => {
    const [red = 0, green = 0, blue = 0] = occupied.map((wall, i) => wall + ((free[i] ?? 0) - wall) * (code / 255));
    return packed(red, green, blue);
  });
}

const packed = (red: number, green: number, blue: number): number => (255 << 24) | (blue << 16) | (green << 8) | red;

function picture({ width, height, values }: Codes, colors: Uint32Array): HTMLCanvasElement {
  const image = Object.assign(document.createElement('canvas'), { width, height });
  const pixels = new ImageData(width, height);
  const words = new Uint32Array(pixels.data.buffer);
  for (let i = 0; i < words.length; i++) words[i] = colors[values[i] ?? FREE] ?? 0;
  image.getContext('2d')?.putImageData(pixels, 0, 0);
  return image;
}

/** The picture of the fewest pixels that has one for each of the screen's. `scale`: pixels of the screen a cell. */
export function levelFor({ levels }: MapLevels, scale: number): MapLevels['levels'][number] | null {
  return levels.findLast(({ cells }) => cells * scale <= 1) ?? levels[0] ?? null;
}
