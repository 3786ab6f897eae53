/** What pixels were before frames were painted on them: the last frames are taken off at the cost of their own points. */

/** Room at first, and at most: 8 bytes each. */
const [ROOM, MOST] = [2 ** 18, 2 ** 23];

export class Journal {
  /** Where in the lists each frame ends. */
  readonly #ends: number[] = [];
  #places = new Uint32Array(ROOM);
  #before = new Uint32Array(ROOM);
  #size = 0;

  constructor(readonly pixels: Uint32Array) {}

  get num_frames(): number {
    return this.#ends.length;
  }

  /** There is no room for more: it is of no use any longer. */
  get isFull(): boolean {
    return this.#size === MOST;
  }

  write(at: number, color: number): void {
    const { pixels } = this;
    const before = pixels[at] as number;
    if (before === color) return;
    pixels[at] = color;
    if (this.#size === this.#places.length) this.#grow();
    if (this.isFull) return;
    this.#places[this.#size] = at;
    this.#before[this.#size++] = before;
  }

  endFrame(): void {
    this.#ends.push(this.#size);
  }

  /** Takes the last frames off until so many are left. */
  takeOff(num_frames: number): void {
    const to = this.#ends[num_frames - 1] ?? 0;
    const [pixels, places, before] = [this.pixels, this.#places, this.#before];
    for (let i = this.#size - 1; i >= to; i--) pixels[places[i] as number] = before[i] as number;
    this.#size = to;
    this.#ends.length = num_frames;
  }

  #grow(): void {
    if (this.isFull) return;
    const grown = (list: Uint32Array): Uint32Array<ArrayBuffer> => {
      const longer = new Uint32Array(2 * list.length);
      longer.set(list);
      return longer;
    };
    [this.#places, this.#before] = [grown(this.#places), grown(this.#before)];
  }
}
