// @ts-check
/** Chance by a seed, so that a seed is enough to see again what was found; and what may be thrown at bad input. */

export class Random {
  #state;

  /** @param {number} seed */
  constructor(seed) {
    this.#state = seed >>> 0;
  }

  /** Below `limit`; mulberry32. @param {number} limit */
  below(limit) {
    this.#state = (this.#state + 0x6d2b79f5) >>> 0;
    let value = Math.imul(this.#state ^ (this.#state >>> 15), this.#state | 1);
    value ^= value + Math.imul(value ^ (value >>> 7), value | 61);
    return ((value ^ (value >>> 14)) >>> 0) % limit;
  }

  /** @template T @param {readonly T[]} values */
  one(values) {
    return /** @type {T} */ (values[this.below(values.length)]);
  }

  /** A copy with some bytes changed, or cut off. @param {Uint8Array} bytes */
  damaged(bytes) {
    let damaged = new Uint8Array(bytes);
    for (let count = 1 + this.below(6); count > 0; count -= 1) {
      const place = this.below(damaged.length);
      const kind = this.below(5);
      if (kind === 0) damaged[place] = this.below(256);
      else if (kind === 1) damaged.fill(255, place, place + this.below(9));
      else if (kind === 2) damaged.fill(0, place, place + this.below(9));
      else if (kind === 3) damaged[place] = (damaged[place] ?? 0) ^ (1 << this.below(8));
      else if (this.below(4) === 0) damaged = damaged.slice(0, Math.max(1, place));
    }
    return damaged;
  }

  /** Words one after the other, apart by any character there is. @param {readonly string[]} words @param {number} most */
  text(words, most) {
    const apart = [
      '',
      ' ',
      '/',
      '.',
      '_',
      '-',
      '=',
      ',',
      '\n',
      '\t',
      '\u001b[',
      '\0',
      '\u202e',
      '\ud800',
      'é',
      '\\',
      '..',
    ];
    return Array.from({ length: this.below(most) + 1 }, () => this.one(words) + this.one(apart)).join('');
  }
}

/** Bad input is told as an error about the file; anything else is a defect. @param {unknown} error */
export function mustBeTold(error) {
  if (/** @type {Error} */ (error).name !== 'ScanstitchError') throw error;
}
