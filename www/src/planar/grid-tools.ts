/** What edits a map's grid: the tool in hand, and the shape that it has drawn. */
import type { Cell, Edit } from '../engine/protocol.js';

export type GridTool = 'line' | 'rectangle' | 'polygon' | 'crop' | 'anchor';
export type Place = readonly [x: number, y: number];
/** x and y of both ends of a line, or of two opposite corners (m); null where they are not given yet. */
type Numbers = readonly [number | null, number | null, number | null, number | null];

/** A place of the map, and its known coordinates as far as they are given (m). */
export interface Known {
  map: Place;
  world: readonly [x: number | null, y: number | null];
}

const NONE: Numbers = [null, null, null, null];
/** Width of a line at first (m): a wall of two cells. */
const WIDTH = 0.1;
/** Standard deviation of a known coordinate at first (m): a cell, as in the engine. */
const ACCURACY = 0.05;
/** Drawn numbers are rounded to this many parts of a metre: a fifth of a cell. */
const PER_METRE = 100;

export class GridTools {
  tool: GridTool = 'line';
  cells: Cell = 'occupied';
  /** Of a line (m). */
  width = WIDTH;
  numbers: Numbers = NONE;
  /** Of a polygon. */
  corners: readonly Place[] = [];
  /** Of an anchor. */
  known: readonly Known[] = [];
  /** Of its coordinates (m). */
  accuracy = ACCURACY;
  /** Which of the places a drag moves, where it began and how far it has come (m), and all of them before; null while there is no drag. */
  #drag: { at: number; x: number; y: number; before: readonly Place[] } | null = null;

  constructor(readonly onChange: () => void) {}

  /** Takes this tool; what was drawn stays, for a rectangle may become a crop. */
  choose(tool: GridTool): void {
    this.tool = tool;
    this.onChange();
  }

  /** Paints so from now on. */
  paintAs(cells: Cell): void {
    this.cells = cells;
    this.onChange();
  }

  widen(width: number): void {
    this.width = width;
    this.onChange();
  }

  /** Gives one of the numbers; NaN takes it back. */
  type(at: number, value: number): void {
    this.#set(this.numbers.map((number, i) => (i !== at ? number : Number.isNaN(value) ? null : value)));
  }

  /** Gives a polygon one more corner, or an anchor one more place. */
  addCorner(corner: Place): void {
    this.#put([...this.places, corner]);
  }

  removeCorner(): void {
    this.#put(this.places.slice(0, -1));
  }

  /** Gives a known coordinate of a place; NaN takes it back. */
  typeKnown(at: number, axis: number, value: number): void {
    const given = Number.isNaN(value) ? null : value;
    const world = ([x, y]: Known['world']): Known['world'] => (axis === 0 ? [given, y] : [x, given]);
    this.known = this.known.map((known, i) => (i === at ? { ...known, world: world(known.world) } : known));
    this.onChange();
  }

  trust(accuracy: number): void {
    this.accuracy = accuracy;
    this.onChange();
  }

  /** Whether the shape has as many places as are tapped. */
  get #isOpen(): boolean {
    return this.tool === 'polygon' || this.tool === 'anchor';
  }

  clear(): void {
    this.#put([]);
  }

  /** The ends or corners that are given. */
  get places(): readonly Place[] {
    if (this.tool === 'polygon') return this.corners;
    if (this.tool === 'anchor') return this.known.map(({ map }) => map);
    const [x0, y0, x1, y1] = this.numbers;
    const first: Place[] = x0 === null || y0 === null ? [] : [[x0, y0]];
    return x1 === null || y1 === null ? first : [...first, [x1, y1]];
  }

  get isWhole(): boolean {
    if (this.tool === 'anchor') return this.known.length > 1 && this.known.every(({ world }) => !world.includes(null));
    return this.tool === 'polygon' ? this.corners.length > 2 : this.numbers.every((number) => number !== null);
  }

  /** Why what is drawn cannot be taken, in words; empty where it can. */
  get problem(): string {
    const [from, to] = this.places;
    if (!from || !to || !this.isWhole) return '';
    if (this.tool === 'anchor') return this.accuracy > 0 ? '' : 'The standard deviation is more than 0 m.';
    if (this.tool === 'polygon')
      return areOnLine(this.corners) ? 'The polygon has no area: its corners lie on a line.' : '';
    const [wide, high] = [from[0] !== to[0], from[1] !== to[1]];
    if (this.tool === 'line') {
      if (!(wide || high)) return 'The line has no length: its ends are at one place.';
      return this.width > 0 ? '' : 'The line needs a width of more than 0 m.';
    }
    return wide && high ? '' : 'The rectangle has no size: give two opposite corners.';
  }

  /** The step that would be taken; null while the shape is not whole. */
  get step(): Edit | null {
    const [from, to] = this.places;
    if (!from || !to || !this.isWhole || this.problem !== '') return null;
    const pair = ([x, y]: Place): [number, number] => [x, y];
    const both: [[number, number], [number, number]] = [pair(from), pair(to)];
    const { tool, cells, width, accuracy } = this;
    if (tool === 'anchor') {
      const pairs = this.known.map(({ map, world: [x, y] }) => ({ map: pair(map), world: pair([x ?? 0, y ?? 0]) }));
      return { action: 'anchor', pairs, accuracy };
    }
    if (tool === 'polygon') return { action: 'paint_polygon', cells, corners: this.corners.map(pair) };
    if (tool === 'crop') return { action: 'crop', corners: both };
    if (tool === 'rectangle') return { action: 'paint_rectangle', cells, corners: both };
    return { action: 'paint_line', cells, ends: both, width };
  }

  // On the map.

  /** A tap gives a polygon its next corner; of others the first end, then the second; after both the next shape begins. */
  tap(place: Place): void {
    if (this.#isOpen) this.addCorner(place);
    else this.#put([...(this.isWhole ? [] : this.places), place]);
  }

  /** A finger or button goes down; `reach` (m): how near it must be to an end or corner to move it. */
  press([x, y]: Place, reach: number): void {
    const { places: before } = this;
    const distances = before.map(([endX, endY]) => Math.hypot(endX - x, endY - y));
    const near = distances.indexOf(Math.min(...distances));
    const grasped = (distances[near] ?? Infinity) <= reach ? before[near] : undefined;
    if (grasped) this.#drag = { at: near, x: grasped[0], y: grasped[1], before };
    else this.#drag = this.isWhole || this.#isOpen ? null : { at: 1, x, y, before };
  }

  /** Whether the drag (m) draws; the map is moved otherwise. */
  drag(right: number, up: number): boolean {
    const drag = this.#drag;
    if (!drag) return false;
    // Of a shape with two ends that is not whole, the drag begins where the button went down.
    const places = drag.at < this.places.length ? this.places : [[drag.x, drag.y] as const];
    [drag.x, drag.y] = [drag.x + right, drag.y + up];
    const moved: Place = [drag.x, drag.y];
    this.#put([...places.slice(0, drag.at), moved, ...places.slice(drag.at + 1)]);
    return true;
  }

  release(): void {
    this.#drag = null;
  }

  /** Two fingers zoom: what one of them has begun to draw goes. */
  cancel(): void {
    if (!this.#drag) return;
    const { before } = this.#drag;
    this.#drag = null;
    this.#put(before);
  }

  /** Takes these ends or corners. */
  #put(places: readonly Place[]): void {
    const whole = places.map(([x, y]): Place => [rounded(x), rounded(y)]);
    if (this.tool === 'polygon') {
      this.corners = whole;
      this.onChange();
    } else if (this.tool === 'anchor') {
      this.known = whole.map((map, at) => ({ map, world: this.known[at]?.world ?? [null, null] }));
      this.onChange();
    } else this.#set(whole.flat());
  }

  #set(numbers: readonly (number | null)[]): void {
    const [x0 = null, y0 = null, x1 = null, y1 = null] = numbers;
    this.numbers = [x0, y0, x1, y1];
    this.onChange();
  }
}

function rounded(metres: number): number {
  return Math.round(metres * PER_METRE) / PER_METRE;
}

/** Whether all corners lie on one line, within what is rounded. */
function areOnLine([[x0, y0] = [0, 0], ...others]: readonly Place[]): boolean {
  const areas = others.map(([x, y], index) => {
    const [nextX, nextY] = others[index + 1] ?? [x0, y0];
    return (x - x0) * (nextY - y0) - (y - y0) * (nextX - x0);
  });
  return areas.every((area) => Math.abs(area) < PER_METRE ** -2);
}
