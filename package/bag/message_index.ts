/**
 * When the messages of a topic were recorded and where they lie, in little memory: a bag has millions of them.
 */

const FIRST_CAPACITY = 64;

export class MessageIndex {
  #times: BigInt64Array<ArrayBuffer> = new BigInt64Array(FIRST_CAPACITY);
  #places: Float64Array<ArrayBuffer> = new Float64Array(2 * FIRST_CAPACITY);
  #length = 0;
  #isOrdered = true;

  get length() {
    return this.#length;
  }

  /**
   * @param time when it was recorded, ns
   * @param first where it lies, in two numbers whose meaning is the container's
   */
  push(time: bigint, first: number, second: number) {
    if (this.#length === this.#times.length) {
      const times = new BigInt64Array(2 * this.#length);
      const places = new Float64Array(4 * this.#length);
      times.set(this.#times);
      places.set(this.#places);
      this.#times = times;
      this.#places = places;
    }
    if (this.#length > 0 && time < this.time(this.#length - 1)) this.#isOrdered = false;
    this.#times[this.#length] = time;
    this.#places[2 * this.#length] = first;
    this.#places[2 * this.#length + 1] = second;
    this.#length += 1;
  }

  time(index: number) {
    return this.#times[index] ?? 0n;
  }

  place(index: number): [number, number] {
    return [this.#places[2 * index] ?? 0, this.#places[2 * index + 1] ?? 0];
  }

  /** First and last time, ns; null without messages. */
  span() {
    if (this.#length === 0) return null;
    let [first, last] = [this.time(0), this.time(0)];
    for (let index = 1; index < this.#length; index += 1) {
      const time = this.time(index);
      if (time < first) first = time;
      if (time > last) last = time;
    }
    return { first, last };
  }

  /** In the order of their times; those of one time stay as they lay. */
  sort() {
    if (this.#isOrdered) return;
    const order = Array.from({ length: this.#length }, (_, index) => index);
    const sorted = new MessageIndex();
    order.sort((a, b) => {
      const difference = this.time(a) - this.time(b);
      return difference < 0n ? -1 : difference > 0n ? 1 : a - b;
    });
    for (const index of order) sorted.push(this.time(index), ...this.place(index));
    this.#times = sorted.#times;
    this.#places = sorted.#places;
    this.#isOrdered = true;
  }
}
