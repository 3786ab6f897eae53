/** Monte Carlo localisation beside the exact one: what is chosen by hand, and the particles after the selected scan. */
import { LatestQuery } from '../engine/latest-query.js';
import type { ParticleOptions, ParticleState } from './protocol.js';

export interface ParticleHooks {
  compute(options: Partial<ParticleOptions>, scan: number): Promise<ParticleState>;
  changed(): void;
  failed(error: unknown): void;
}

export class Particles {
  /** Those that are not the engine's defaults. */
  options: Partial<ParticleOptions> = {};
  /** After the scan that was reached last. */
  state: ParticleState | null = null;
  /** Effective number of particles after each scan so far; none of those that were passed in another run. */
  effective: readonly (number | undefined)[] = [];
  readonly #query: LatestQuery<number, ParticleState>;

  constructor({ compute, changed, failed }: ParticleHooks) {
    this.#query = new LatestQuery<number, ParticleState>({
      compute: (scan) => compute(this.options, scan),
      answered: (scan, state, isLatest) => {
        this.state = state;
        const effective = [...this.effective];
        for (const [passed, number] of state.passed) effective[passed] = number;
        this.effective = effective;
        if (!state.isThere && isLatest) this.#query.ask(scan);
        changed();
      },
      failed: (_, error) => failed(error),
    });
  }

  /** Goes on, or back, to a scan. */
  show(scan: number): void {
    this.#query.ask(scan);
  }

  /** Starts anew; what was is shown until then. */
  choose(options: Partial<ParticleOptions>, scan: number): void {
    this.#query.drop();
    this.effective = [];
    this.options = { ...this.options, ...options };
    this.show(scan);
  }

  forget(): void {
    this.#query.drop();
    [this.state, this.effective] = [null, []];
  }
}

/** The weight of the particles within a distance (m) of a place. */
export function weightNear(values: Float32Array, { x, y }: { x: number; y: number }, distance: number): number {
  let sum = 0;
  for (let i = 0; i + 3 < values.length; i += 4) {
    const isNear = Math.hypot((values[i] ?? 0) - x, (values[i + 1] ?? 0) - y) <= distance;
    if (isNear) sum += values[i + 3] ?? 0;
  }
  return Math.min(sum, 1);
}
