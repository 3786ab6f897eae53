/** Where the map is viewed from, and the flight to another viewpoint. */
import { between, type Orbit, STRAIGHT_DOWN } from '../views/orbit.js';

const FIRST_VIEW: Orbit = {
  target: [0, 0, -2],
  azimuth: 0,
  elevation: STRAIGHT_DOWN,
  distance: 10,
  projection: 'perspective',
};
const FLIGHT_MS = 350;

export class Viewpoint {
  #orbit = FIRST_VIEW;
  #flight: { from: Orbit; to: Orbit; start: number } | null = null;
  /** The user moved the view: auto-fit is off. */
  isMoved = false;

  get orbit(): Orbit {
    return this.#orbit;
  }

  /** Where it will be when it has arrived. */
  get goal(): Orbit {
    return this.#flight?.to ?? this.#orbit;
  }

  get isFlying(): boolean {
    return this.#flight !== null;
  }

  reset(): void {
    this.jump(FIRST_VIEW);
    this.isMoved = false;
  }

  jump(to: Orbit): void {
    this.#flight = null;
    this.#orbit = to;
  }

  /** Sets out for another view; from the very first one, and where motion is unwelcome, it is there at once. */
  fly(to: Orbit): void {
    if (this.#orbit === FIRST_VIEW || matchMedia('(prefers-reduced-motion: reduce)').matches) this.jump(to);
    else this.#flight = { from: this.#orbit, to, start: performance.now() };
  }

  /** Goes on with the flight, as far as the time has come. */
  advance(): void {
    if (!this.#flight) return;
    const { from, to, start } = this.#flight;
    const t = Math.min((performance.now() - start) / FLIGHT_MS, 1);
    this.#orbit = between(from, to, t);
    if (t >= 1) this.#flight = null;
  }
}
