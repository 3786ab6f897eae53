/** What edits a map's grid: the tool in hand, and the shape that it has drawn. */
import type { Cell, Edit } from '../engine/protocol.js';

export type GridTool = 'line' | 'rectangle' | 'crop';
export type Place = readonly [x: number, y: number];
/** x and y of both ends of a line, or of two opposite corners (m); null where they are not given yet. */
type Numbers = readonly [number | null, number | null, number | null, number | null];

const NONE: Numbers = [null, null, null, null];
/** Width of a line at first (m): a wall of two cells. */
const WIDTH = 0.1;
/** Drawn numbers are rounded to this many parts of a metre: a fifth of a cell. */
const PER_METRE = 100;

export class GridTools {
  tool: GridTool = 'line';
  cells: Cell = 'occupied';
  /** Of a line (m). */
  width = WIDTH;
  numbers: Numbers = NONE;
  /** The end that a drag moves, where it began and how far it has come (m); null while there is no drag. */
  #drag: { end: 0 | 1; x: number; y: number; before: Numbers } | null = null;

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

  clear(): void {
    this.#set(NONE);
  }

  /** The ends or corners that are given. */
  get places(): Place[] {
    const [x0, y0, x1, y1] = this.numbers;
    const first: Place[] = x0 === null || y0 === null ? [] : [[x0, y0]];
    return x1 === null || y1 === null ? first : [...first, [x1, y1]];
  }

  get isWhole(): boolean {
    return this.numbers.every((number) => number !== null);
  }

  /** Why what is drawn cannot be taken, in words; empty where it can. */
  get problem(): string {
    const [from, to] = this.places;
    if (!from || !to || !this.isWhole) return '';
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
    const both: [[number, number], [number, number]] = [
      [from[0], from[1]],
      [to[0], to[1]],
    ];
    const { tool, cells, width } = this;
    if (tool === 'crop') return { action: 'crop', corners: both };
    if (tool === 'rectangle') return { action: 'paint_rectangle', cells, corners: both };
    return { action: 'paint_line', cells, ends: both, width };
  }

  // On the map.

  /** A tap gives the first end, then the second; after both the next shape begins. */
  tap([x, y]: Place): void {
    const [first] = this.places;
    const isSecond = first !== undefined && !this.isWhole;
    this.#set(isSecond ? [first[0], first[1], rounded(x), rounded(y)] : [rounded(x), rounded(y), null, null]);
  }

  /** A finger or button goes down; `reach` (m): how near it must be to an end to move it. */
  press([x, y]: Place, reach: number): void {
    const distances = this.places.map(([endX, endY]) => Math.hypot(endX - x, endY - y));
    const near = distances.indexOf(Math.min(...distances));
    const { numbers: before, isWhole } = this;
    if (near >= 0 && (distances[near] ?? Infinity) <= reach) {
      const [endX, endY] = this.places[near] ?? [x, y];
      this.#drag = { end: near === 0 ? 0 : 1, x: endX, y: endY, before };
    } else this.#drag = isWhole ? null : { end: 1, x, y, before };
  }

  /** Whether the drag (m) draws; the map is moved otherwise. */
  drag(right: number, up: number): boolean {
    const drag = this.#drag;
    if (!drag) return false;
    if (drag.end === 1 && !this.isWhole) this.numbers = [rounded(drag.x), rounded(drag.y), null, null];
    [drag.x, drag.y] = [drag.x + right, drag.y + up];
    const moved = [rounded(drag.x), rounded(drag.y)];
    this.#set(drag.end === 0 ? [...moved, ...this.numbers.slice(2)] : [...this.numbers.slice(0, 2), ...moved]);
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
    this.#set(before);
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
