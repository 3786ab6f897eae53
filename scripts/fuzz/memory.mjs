// @ts-check
/** What reading an input takes of memory, over its size. */
import { readFileSync, writeFileSync } from 'node:fs';

const MEGABYTE = 2 ** 20;
/** An input may take so many times its bytes, and so much beyond that (bytes). */
const MOST_TIMES = 20;
const MOST_MORE = 64 * MEGABYTE;
/** Garbage is collected after so many inputs: it is none of the next one's. */
const INPUTS_A_COLLECTION = 100;

/** The largest resident set since it was forgotten last, on Linux; elsewhere since the beginning (bytes). */
function peakBytes() {
  try {
    const [, kilobytes] = readFileSync('/proc/self/status', 'latin1').match(/^VmHWM:\s*(\d+) kB/m) ?? [];
    return 1024 * Number(kilobytes);
  } catch {
    return 1024 * process.resourceUsage().maxRSS;
  }
}

function forgetPeak() {
  try {
    writeFileSync('/proc/self/clear_refs', '5');
  } catch {
    // The peak is that of all inputs then.
  }
}

/** Watches the peak of one input after the other. Node must have been started with --expose-gc. */
export class MemoryPeak {
  #inputs = 0;
  #before = 0;
  #worst = { bytes: 0, size: 0, seed: 0 };

  /** Throws where an input took too much. @param {number} size of the input that was just read @param {number} seed its own */
  check(size, seed) {
    // The first one loads the modules and the engine.
    if (this.#inputs > 0) {
      const bytes = peakBytes() - this.#before;
      if (bytes - MOST_TIMES * size > this.#worst.bytes - MOST_TIMES * this.#worst.size) {
        this.#worst = { bytes, size, seed };
      }
      if (bytes > MOST_TIMES * size + MOST_MORE) throw new Error(this.told());
    }
    if (this.#inputs % INPUTS_A_COLLECTION === 0) globalThis.gc?.();
    this.#inputs += 1;
    forgetPeak();
    this.#before = peakBytes();
  }

  told() {
    const { bytes, size, seed } = this.#worst;
    return `at most ${(bytes / MEGABYTE).toFixed(1)} MB of memory for one input, of ${size} bytes (seed ${seed})`;
  }
}
