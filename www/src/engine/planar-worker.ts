/** Planar scans, by the full engine. */
import * as engine from './package.js';
import { servePlanar } from './planar-thread.js';
import { isInputError } from './serve.js';

servePlanar(engine, {
  describeTable({ name, bytes }, format, scan) {
    try {
      return engine.describe_table(name, new Uint8Array(bytes), format, scan) ?? null;
    } catch (error) {
      if (isInputError(error)) return null;
      throw error;
    }
  },
});
