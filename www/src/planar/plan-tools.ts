/** Lays a building plan behind the map: its picture, and the points that are known in the picture and in the map. */
import { imageSize, IMAGE_HEAD_BYTES, latin1 } from '../../../package/files/heads.js';
import { LastRequest } from '../engine/last-request.js';
import { messageOf } from '../engine/message-of.js';
import type { Edit, PlacedPlan } from '../engine/protocol.js';
import type { Place } from './grid-tools.js';
import { type Sheet, sheetOf } from './plan-sheet.js';
import type { PlanarSession } from './session.js';

/** A point of the picture (pixels) and its place in the map (m), as far as they are given. */
export interface PlanPair {
  picture: Place | null;
  map: readonly [x: number | null, y: number | null];
}

/** A picture that is larger makes files of steps that no program opens quickly (bytes). */
const MAX_BYTES = 2 ** 25;
/** Of a picture that a canvas writes again. */
const JPEG_QUALITY = 0.92;
/** Places are rounded to this many parts of a pixel or a metre. */
const [PER_PIXEL, PER_METRE] = [10, 1000];

export class PlanTools {
  name = '';
  sheet: Sheet | null = null;
  pairs: readonly PlanPair[] = [];
  /** Standard deviation of a coordinate (m); null: as the engine has it. */
  accuracy: number | null = null;
  /** Of the plan over what is behind it, 0 to 1. */
  opacity = 0.5;
  /** Where the points lay it; null while they do not. */
  placed: PlacedPlan | null = null;
  /** What is wrong with the picture or the points, in words. */
  problem = '';
  /** The middle of the map (m). */
  cross: Place = [0, 0];
  /** The plan that lies behind the map, as text, to tell one from another. */
  #laid = 'null';
  #drag: { at: number; x: number; y: number } | null = null;
  readonly #previews = new LastRequest();

  constructor(
    readonly session: PlanarSession,
    readonly onChange: () => void,
  ) {}

  /** Takes a picture; points of one before it go. */
  async choose(file: File): Promise<void> {
    try {
      if (file.size > MAX_BYTES)
        throw new Error(`It has more than ${MAX_BYTES / 2 ** 20} MB: save it with fewer pixels`);
      const bytes = await withoutExif(new Uint8Array(await file.arrayBuffer()));
      const sheet = await sheetOf(bytes).catch(() => {
        throw new Error('The browser reads no picture from it: save it as PNG or JPEG');
      });
      this.name = this.#keep(file.name, bytes);
      [this.sheet, this.pairs, this.placed, this.problem] = [sheet, [], null, ''];
    } catch (error) {
      this.problem = `${file.name}: ${messageOf(error)}.`;
    }
    this.onChange();
  }

  /** Keeps it under a name that no other picture has. */
  #keep(name: string, bytes: Uint8Array<ArrayBuffer>): string {
    const { session } = this;
    const isOther = (taken: Uint8Array | undefined): boolean =>
      taken !== undefined && (taken.length !== bytes.length || taken.some((byte, at) => byte !== bytes[at]));
    let kept = name;
    for (let number = 2; isOther(session.pictures[kept]); number++) kept = `${number} ${name}`;
    session.pictures = { ...session.pictures, [kept]: bytes };
    return kept;
  }

  /** Takes the plan that lies behind the map now, unless it is the one that did. */
  async adopt(laid: PlacedPlan | null): Promise<void> {
    const text = JSON.stringify(laid);
    if (text === this.#laid) return;
    this.#laid = text;
    const bytes = laid && this.session.pictures[laid.picture];
    this.name = laid?.picture ?? '';
    this.pairs = laid?.points ?? [];
    this.placed = laid;
    this.sheet = null;
    this.problem = laid && !bytes ? `The steps do not keep the picture ${laid.picture}: choose it again.` : '';
    this.onChange();
    if (!bytes) return;
    this.sheet = await sheetOf(bytes).catch(() => null);
    if (!this.sheet) this.problem = `${this.name} is no picture.`;
    this.onChange();
  }

  get isLaid(): boolean {
    return this.#laid !== 'null';
  }

  /** Whether the points lay it otherwise than it lies. */
  get isNew(): boolean {
    return this.step !== null && this.placed !== null && JSON.stringify(this.placed) !== this.#laid;
  }

  // Points.

  /** Number of the point that the next tap gives: of the first pair that wants it in this frame, or of a new one. */
  next(frame: keyof PlanPair): number {
    const at = this.pairs.findIndex((pair) => (frame === 'picture' ? pair.picture === null : pair.map.includes(null)));
    return at < 0 ? this.pairs.length : at;
  }

  tapPicture(place: Place): void {
    if (this.sheet) this.#put(this.next('picture'), { picture: rounded(place, PER_PIXEL) });
  }

  tapMap(place: Place): void {
    this.#put(this.next('map'), { map: rounded(place, PER_METRE) });
  }

  movePicture(at: number, place: Place): void {
    this.#put(at, { picture: rounded(place, PER_PIXEL) });
  }

  /** Gives a coordinate of a point in the map; NaN takes it back. */
  type(at: number, axis: number, value: number): void {
    const given = Number.isNaN(value) ? null : value;
    const [x = null, y = null] = this.pairs[at]?.map ?? [];
    this.#put(at, { map: axis === 0 ? [given, y] : [x, given] });
  }

  remove(at: number): void {
    this.#take(this.pairs.filter((_, other) => other !== at));
  }

  trust(accuracy: number): void {
    this.accuracy = accuracy > 0 ? accuracy : null;
    this.#take(this.pairs);
  }

  /** How much of it is seen. */
  show(opacity: number): void {
    this.opacity = opacity;
    this.onChange();
  }

  press([x, y]: Place, reach: number): void {
    const distances = this.pairs.map(({ map: [atX, atY] }) => Math.hypot((atX ?? NaN) - x, (atY ?? NaN) - y));
    const at = distances.findIndex((distance) => distance <= reach);
    const [atX = null, atY = null] = this.pairs[at]?.map ?? [];
    this.#drag = atX === null || atY === null ? null : { at, x: atX, y: atY };
  }

  /** Whether the drag (m) moves a point. */
  drag(right: number, up: number): boolean {
    const drag = this.#drag;
    if (!drag) return false;
    [drag.x, drag.y] = [drag.x + right, drag.y + up];
    this.#put(drag.at, { map: rounded([drag.x, drag.y], PER_METRE) });
    return true;
  }

  release(): void {
    this.#drag = null;
  }

  /** The step that would be taken; null while there are too few points. */
  get step(): Edit | null {
    const points = this.pairs.flatMap(({ picture, map: [x, y] }) =>
      picture && x !== null && y !== null ? [{ picture: pair(picture), map: pair([x, y]) }] : [],
    );
    const { name, accuracy } = this;
    if (points.length < 3 || points.length < this.pairs.length || !this.sheet) return null;
    return { action: 'lay_plan', picture: name, points, ...(accuracy !== null && { accuracy }) };
  }

  #put(at: number, given: Partial<PlanPair>): void {
    const pairs = [...this.pairs];
    pairs[at] = { picture: null, map: [null, null], ...pairs[at], ...given };
    this.#take(pairs);
  }

  #take(pairs: readonly PlanPair[]): void {
    this.pairs = pairs;
    this.onChange();
    void this.#preview();
  }

  async #preview(): Promise<void> {
    const { step, session } = this;
    const signal = this.#previews.begin();
    let [placed, problem]: [PlacedPlan | null, string] = [null, ''];
    try {
      placed = (step && (await session.client?.previewPlan(step))) ?? null;
    } catch (error) {
      problem = messageOf(error);
    }
    if (signal.aborted) return;
    [this.placed, this.problem] = [placed, problem];
    this.onChange();
  }
}

const pair = ([x, y]: Place): [number, number] => [x, y];

const rounded = ([x, y]: Place, parts: number): Place => [Math.round(x * parts) / parts, Math.round(y * parts) / parts];

/** A photograph may be turned by a line of its EXIF data that other programs leave out: it is written again as it is seen. */
async function withoutExif(bytes: Uint8Array<ArrayBuffer>): Promise<Uint8Array<ArrayBuffer>> {
  const head = bytes.subarray(0, IMAGE_HEAD_BYTES);
  const isPhotograph = head[0] === 0xff && head[1] === 0xd8 && latin1(head).includes('Exif\0');
  if (!isPhotograph || !imageSize(head)) return bytes;
  const bitmap = await createImageBitmap(new Blob([bytes]));
  const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
  canvas.getContext('2d')?.drawImage(bitmap, 0, 0);
  const blob = await canvas.convertToBlob({ type: 'image/jpeg', quality: JPEG_QUALITY });
  return new Uint8Array(await blob.arrayBuffer());
}
