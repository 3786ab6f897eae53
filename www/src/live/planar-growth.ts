/**
 * The growing map of laser scans: all scans so far are registered again whenever the last time is over, so loops are closed while the
 * robot drives. Where they become too many for that, every second one is left out.
 */
import { logLineOf, type Message } from '../../../package/live/frames.js';
import { PlanarClient } from '../engine/planar-client.js';
import type { RunState, Settings, Snapshot } from '../engine/protocol.js';
import { lookDirection } from '../views/look-direction.js';
import type { Growth, GrowthHooks, PlanarShown } from './growth.js';

/** Scans on the map at most: 577 of 450 readings take 1.7 s in a tab on two cores, so the map is at most about 3 s old. */
const MOST_SCANS = 1000;
const LOG = 'live.log';

export class PlanarGrowth implements Growth {
  shown: PlanarShown | null = null;
  numDropped = 0;
  #hooks;
  #client;
  #settings: Settings | null = null;
  /** One for each scan that is on the map or is to be. */
  #lines: string[] = [];
  #numSeen = 0;
  /** Every so many scans one is taken. */
  #stride = 1;
  #numInPass = 0;
  #isBusy = false;
  #hasMap = false;

  constructor(hooks: GrowthHooks) {
    this.#hooks = hooks;
    this.#client = new PlanarClient({
      ready: ({ presets }) => {
        this.#settings = presets[0]?.settings ?? null;
        this.#begin();
      },
      reading: () => undefined,
      progress: () => undefined,
      loaded: (_, { accepted }) => {
        if (accepted.length === 0) this.#end();
      },
      snapshot: (state, snapshot) => this.#onSnapshot(state, snapshot),
      rejected: ({ problem }) => hooks.problem(problem),
      refused: () => undefined,
      crashed: (message) => {
        hooks.problem(`the engine of the growing map crashed (${message})`);
        this.#thin();
        this.#end();
      },
      slow: () => undefined,
      unavailable: (message) => hooks.problem(message.replace(/\.$/, '')),
    });
  }

  get numPlaced(): number {
    return this.shown?.frames.length ?? 0;
  }

  take(message: Message): void {
    const isTaken = this.#numSeen % this.#stride === 0;
    this.#numSeen++;
    if (!isTaken) {
      this.numDropped++;
      return;
    }
    try {
      this.#lines.push(logLineOf(message));
    } catch (error) {
      this.numDropped++;
      throw error;
    }
    if (this.#lines.length > MOST_SCANS) this.#thin();
    this.#begin();
  }

  dispose(): void {
    this.#client.dispose();
  }

  #begin(): void {
    if (this.#isBusy || !this.#settings || this.#lines.length === this.#numInPass) return;
    this.#isBusy = true;
    this.#numInPass = this.#lines.length;
    const { buffer } = new TextEncoder().encode(`${this.#lines.join('\n')}\n`);
    const scans = [{ name: LOG, bytes: buffer, isLog: true }];
    this.#client.load({ scans, reference: null, odometry: null }, this.#settings);
  }

  #onSnapshot(state: RunState, { result: { frames }, map_points, mapOffsets }: Snapshot): void {
    const isWhole = state === 'done';
    // The map of the last pass stays until that of this one is whole.
    if (isWhole || !this.#hasMap) {
      const points = { points: map_points, offsets: mapOffsets };
      const looks = lookDirection(
        points,
        frames.map(({ T_world_sensor }) => T_world_sensor),
      );
      this.shown = { kind: 'planar', frames, points, lookDirection: looks };
      this.#hooks.changed();
    }
    if (!isWhole) return;
    this.#hasMap = true;
    this.#end();
  }

  #end(): void {
    this.#isBusy = false;
    this.#begin();
  }

  /** Leaves out every second scan, of those there are and of those to come. */
  #thin(): void {
    const numBefore = this.#lines.length;
    this.#lines = this.#lines.filter((_, index) => index % 2 === 0);
    this.#stride *= 2;
    this.#numInPass = this.#lines.length;
    this.numDropped += numBefore - this.#lines.length;
  }
}
