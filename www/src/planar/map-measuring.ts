/** What is measured on a map: the way along points that are clicked, the angle at them, the area within, and the scans that saw a place. */
import { LastRequest } from '../engine/last-request.js';
import { messageOf } from '../engine/message-of.js';
import type { ScanAt } from '../engine/protocol.js';
import { GridTools, type Place } from './grid-tools.js';
import type { PlanarSession } from './session.js';

/** Side of a cell whose scans are looked for (m): that of the grid. */
const CELL = 0.05;

/** The cross is told where it has rested for so long. */
const REST_MS = 120;

/** A place of the map (m), as exact as a pixel shows it. */
interface ZoomedPlace {
  x: number;
  y: number;
  /** Digits after the point. */
  decimals: number;
}

export type MeasuringMode = 'points' | 'scans';

export class MapMeasuring {
  mode: MeasuringMode = 'points';
  /** Points in their order, drawn as the corners of a polygon are. */
  readonly points: GridTools;
  /** Where the cross is, in the middle of the map; null before the first picture. */
  cross: ZoomedPlace | null = null;
  /** The place whose scans are told. */
  place: Place | null = null;
  side = CELL;
  /** Null while they are not known. */
  scans: readonly ScanAt[] | null = null;
  problem = '';
  #resting: ReturnType<typeof setTimeout> | undefined;
  readonly #requests = new LastRequest();

  constructor(
    readonly session: PlanarSession,
    readonly onChange: () => void,
  ) {
    this.points = new GridTools(onChange);
    this.points.tool = 'polygon';
  }

  choose(mode: MeasuringMode): void {
    this.mode = mode;
    this.onChange();
  }

  /** Takes a place: as the next point, or to tell its scans. */
  take(place: Place): void {
    if (this.mode === 'points') this.points.addCorner(place);
    else this.look(place);
  }

  /** The map has moved under the cross. */
  crossMoved(): void {
    clearTimeout(this.#resting);
    this.#resting = setTimeout(() => this.onChange(), REST_MS);
  }

  /** Takes the place under the cross. */
  takeCross(): void {
    if (this.cross) this.take([this.cross.x, this.cross.y]);
  }

  /** Asks for the scans of a place; null: of none. */
  look(place: Place | null): void {
    [this.place, this.scans, this.problem] = [place, null, ''];
    this.onChange();
    void this.#ask();
  }

  /** With cells of another side. */
  widen(side: number): void {
    if (!(side > 0)) return;
    this.side = side;
    this.look(this.place);
  }

  back(): void {
    if (this.mode === 'points') this.points.removeCorner();
    else this.look(null);
  }

  get isEmpty(): boolean {
    return this.mode === 'points' ? this.points.corners.length === 0 : this.place === null;
  }

  clear(): void {
    this.points.clear();
    this.look(null);
  }

  async #ask(): Promise<void> {
    const { place, side, session } = this;
    const signal = this.#requests.begin();
    if (!place || !session.client) return;
    try {
      const scans = await session.client.scansAt(place[0], place[1], side);
      if (signal.aborted) return;
      this.scans = scans;
      session.announce(`${scans.length} scans saw this place.`);
    } catch (error) {
      if (signal.aborted) return;
      this.problem = messageOf(error);
    }
    this.onChange();
  }
}

/** Length of the way along places (m). */
export function lengthOf(places: readonly Place[]): number {
  return places.slice(1).reduce((sum, place, before) => sum + distance(places[before] ?? place, place), 0);
}

const distance = ([x0, y0]: Place, [x1, y1]: Place): number => Math.hypot(x1 - x0, y1 - y0);

/** From the x axis to the way from one place to another, counter-clockwise (rad). */
export const directionOf = ([x0, y0]: Place, [x1, y1]: Place): number => Math.atan2(y1 - y0, x1 - x0);

/** The angle at the middle of three places, 0 to pi (rad). */
export function angleAt(before: Place, [x, y]: Place, after: Place): number {
  const [ax, ay, bx, by] = [before[0] - x, before[1] - y, after[0] - x, after[1] - y];
  return Math.abs(Math.atan2(ax * by - ay * bx, ax * bx + ay * by));
}

/** Area within a closed way (m²): half of the sum of its cross products, which of a way that crosses itself is no area. */
export function areaOf(places: readonly Place[]): number {
  const [[x0, y0] = [0, 0]] = places;
  const doubled = places.reduce((sum, [x, y], at) => {
    const [nextX, nextY] = places[(at + 1) % places.length] ?? [x0, y0];
    return sum + (x - x0) * (nextY - y0) - (y - y0) * (nextX - x0);
  }, 0);
  return Math.abs(doubled) / 2;
}

/** Whether two edges of the closed way cross: it encloses no one area. */
export function crossesItself(places: readonly Place[]): boolean {
  const edges = places.map((place, at) => [place, places[(at + 1) % places.length] ?? place] as const);
  const side = ([a, b]: readonly [Place, Place], [x, y]: Place): number =>
    Math.sign((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]));
  return edges.some((one, i) =>
    edges
      .slice(i + 1)
      .some((other) => side(one, other[0]) * side(one, other[1]) < 0 && side(other, one[0]) * side(other, one[1]) < 0),
  );
}
