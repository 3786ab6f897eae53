/** A thread that decodes and prepares frames, ahead of their registration. */
import * as engine from '../../../pkg/scanstitch.js';
import { serve } from './serve.js';
import type { PreparerApi } from './spatial-protocol.js';

type Async<T> = { [K in keyof T]: T[K] extends (...args: infer A) => infer R ? (...args: A) => R | Promise<R> : never };

const api: Async<PreparerApi> = {
  async start(module) {
    await engine.default({ module_or_path: module });
  },

  prepareFrame: (preparation, name, index, time, depth, color) =>
    engine.prepare_frame(preparation, name, index, time ?? undefined, depth, color ?? undefined),

  prepareCloud: (preparation, name, index, time, cloud) =>
    engine.prepare_cloud(preparation, name, index, time ?? undefined, cloud),

  decodeDepth(name, bytes) {
    const pixels = engine.decode_depth(name, bytes);
    const { width, height, bits } = pixels;
    const values = pixels.values();
    pixels.free();
    return { width, height, bits, values };
  },
};

serve(api);
