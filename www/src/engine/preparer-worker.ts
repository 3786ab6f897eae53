/** A thread that decodes and prepares frames, ahead of their registration. */
import * as engine from './package.js';
import { serve, type Served } from './serve.js';
import type { PreparerApi } from './spatial-protocol.js';

const api: Served<PreparerApi> = {
  async start(module) {
    await engine.init({ module_or_path: module });
  },

  prepareFrame(decodeConfig, name, index, time, depth, color, spare) {
    const { bytes, path, problem } = color ?? {};
    const at = time ?? undefined;
    const prepared = engine.prepare_frame(decodeConfig, name, index, at, depth, bytes, path, problem, whole(spare));
    return { prepared, spent: depth, spent_color: bytes ?? null };
  },

  prepareCloud(decodeConfig, name, index, time, cloud, spare) {
    const prepared = engine.prepare_cloud(decodeConfig, name, index, time ?? undefined, cloud, whole(spare));
    return { prepared, spent: cloud, spent_color: null };
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
};

/** All of the buffer that these bytes lie in. */
function whole(bytes: Uint8Array | null): Uint8Array | undefined {
  return bytes ? new Uint8Array(bytes.buffer) : undefined;
}

serve<PreparerApi>(api);
