/** A thread that decodes and prepares frames, ahead of their registration. */
import * as engine from './package.js';
import { serve, type Served } from './serve.js';
import type { PreparerApi, TopView } from './spatial-protocol.js';

const api: Served<PreparerApi> = {
  async start(module) {
    await engine.init({ module_or_path: module });
  },

  prepareFrame(decodeConfig, name, index, time, depth, color, spare) {
    const { bytes, path, problem } = color ?? {};
    const at = time ?? undefined;
    const prepared = engine.prepare_frame(decodeConfig, name, index, at, depth, bytes, path, problem, whole(spare));
    return { prepared, spent: depth, spentColor: bytes ?? null };
  },

  prepareCloud(decodeConfig, name, index, time, cloud, spare) {
    const prepared = engine.prepare_cloud(decodeConfig, name, index, time ?? undefined, cloud, whole(spare));
    return { prepared, spent: cloud, spentColor: null };
  },

  depthPicture(name, bytes, colors) {
    const image = engine.decode_depth(name, bytes);
    const picture = image.picture(colors);
    const { width, height } = image;
    const { near, far, num_invalid } = picture;
    const pixels = picture.pixels();
    picture.free();
    image.free();
    return { width, height, pixels, near, far, num_invalid };
  },

  topView(name, bytes, fx) {
    const image = engine.decode_depth(name, bytes);
    const [values, width] = [image.values(), image.width];
    image.free();
    return topView(values, width, fx);
  },
};

/** Cells of a view from above. */
const [COLUMNS, ROWS] = [120, 90];
/** The farthest fiftieth of the pixels may lie outside. */
const SHOWN_SHARE = 0.98;

function topView(values: Uint16Array, width: number, fx: number): TopView {
  const depths = values.filter((value) => value > 0 && value < 65535).sort();
  const far = depths[Math.floor(SHOWN_SHARE * (depths.length - 1))] ?? 1;
  // As wide as the camera sees at the far end, or as deep.
  const cell = Math.max(far / ROWS, (far * width) / fx / COLUMNS);
  const counts = new Float32Array(COLUMNS * ROWS);
  values.forEach((z, i) => {
    const x = (((i % width) - width / 2) / fx) * z;
    const [column, row] = [Math.floor(COLUMNS / 2 + x / cell), ROWS - 1 - Math.floor(z / cell)];
    if (z > 0 && row >= 0 && column >= 0 && column < COLUMNS) counts[row * COLUMNS + column]! += 1;
  });
  // A pixel far away covers more ground than a near one; shades are logarithmic.
  const most = counts.reduce((a, b) => Math.max(a, b), 1);
  const density = Uint8Array.from(counts, (count) => (255 * Math.log1p(count)) / Math.log1p(most));
  return { columns: COLUMNS, rows: ROWS, cell, far, density };
}

/** All of the buffer that these bytes lie in. */
function whole(bytes: Uint8Array | null): Uint8Array | undefined {
  return bytes ? new Uint8Array(bytes.buffer) : undefined;
}

serve<PreparerApi>(api);
