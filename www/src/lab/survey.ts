/** Landscapes and basins while they grow: coarse at first, then as fine as a few seconds allow. */
import { EngineProblem, WorkerDied } from '../engine/remote.js';
import type { LabClient } from './client.js';
import { finest, numRows, parts } from './grids.js';
import type { Landscape } from './landscape.js';
import type { BasinEnds, BasinLabels, Grid, GridPart, Pose } from './protocol.js';

/** Largest computing time of the fine grid, the sum of both workers (ms). */
const LANDSCAPE_MS = 6000;
const BASIN_MS = 16_000;
const FINE_LANDSCAPE = 201;
const COARSE_LANDSCAPE = 25;
const FINE_BASIN: Record<2 | 3, readonly number[]> = { 2: [61, 61], 3: [41, 41, 9] };
const COARSE_BASIN: Record<2 | 3, readonly number[]> = { 2: [9, 9], 3: [9, 9, 3] };
/** Parts of a grid: enough to see it grow. */
const NUM_PARTS = 24;
/** Smallest interval at which results are grouped again while they arrive (ms). */
const LABEL_MS = 250;

export interface Basin {
  grid: Grid;
  /** Index in `ends` of each node; -1 where it is not known yet. */
  index: Int32Array;
  ends: BasinEnds;
  labels: BasinLabels;
  progress: number;
  milliseconds: number;
}

/** Of what a survey is made; another object is another survey. */
export interface SurveyOf {
  client: LabClient;
  method: number;
  grid: Omit<Grid, 'size'>;
  /** The pose of the right minimum. */
  reference: Pose;
}

/** One at a time: a new one ends the one before it. */
abstract class Survey<Result> {
  result: Result | null = null;
  #running: AbortController | null = null;
  readonly #onChange: () => void;

  constructor(onChange: () => void) {
    this.#onChange = onChange;
  }

  stop(): void {
    this.#running?.abort();
    this.#running = null;
  }

  async run(of: SurveyOf): Promise<void> {
    this.stop();
    const running = new AbortController();
    this.#running = running;
    try {
      await of.client.prepareWorkers(of.method);
      const ofNode = running.signal.aborted ? 0 : await this.coarse(of, running.signal);
      if (!running.signal.aborted) await this.fine(of, ofNode, running.signal);
    } catch (error) {
      // The run reports input errors; the crash of a worker is reported by its host.
      const isTold = error instanceof WorkerDied || error instanceof EngineProblem;
      if (!isTold && !running.signal.aborted) throw error;
    }
  }

  protected show(result: Result): void {
    this.result = result;
    this.#onChange();
  }

  /** Computes the coarse grid; ms that a node took. */
  protected abstract coarse(of: SurveyOf, signal: AbortSignal): Promise<number>;
  protected abstract fine(of: SurveyOf, ofNode: number, signal: AbortSignal): Promise<void>;
}

export class LandscapeSurvey extends Survey<Landscape> {
  protected override async coarse(of: SurveyOf, signal: AbortSignal): Promise<number> {
    const grid = { ...of.grid, size: [COARSE_LANDSCAPE, COARSE_LANDSCAPE] };
    const milliseconds = await this.#compute(of, grid, 2, signal);
    return (2 * milliseconds) / COARSE_LANDSCAPE ** 2;
  }

  protected override async fine(of: SurveyOf, ofNode: number, signal: AbortSignal): Promise<void> {
    const size = finest([FINE_LANDSCAPE, FINE_LANDSCAPE], ofNode, LANDSCAPE_MS);
    if ((size[0] ?? 0) > COARSE_LANDSCAPE) await this.#compute(of, { ...of.grid, size }, NUM_PARTS, signal);
  }

  async #compute({ client, method }: SurveyOf, grid: Grid, num_parts: number, signal: AbortSignal): Promise<number> {
    const [width = 1, height = 1] = grid.size;
    const costs = new Float64Array(width * height).fill(Number.NaN);
    const coarse = this.result?.progress === 1 ? this.result : null;
    const start = performance.now();
    let done = 0;
    await client.share(
      method,
      'landscape',
      parts(grid, num_parts),
      ({ rows: [from, to] }: GridPart, answer: Float64Array) => {
        costs.set(answer, from * width);
        done += to - from;
        const milliseconds = performance.now() - start;
        // The coarse one is better to look at than half of the fine one, until that is whole.
        if (done === height || !coarse) this.show({ grid, costs, minima: [], progress: done / height, milliseconds });
      },
      signal,
    );
    const milliseconds = performance.now() - start;
    if (signal.aborted) return milliseconds;
    const minima = await client.minima(costs, width);
    if (!signal.aborted) this.show({ grid, costs, minima, progress: 1, milliseconds });
    return milliseconds;
  }
}

export class BasinSurvey extends Survey<Basin> {
  protected override async coarse(of: SurveyOf, signal: AbortSignal): Promise<number> {
    const size = [...COARSE_BASIN[of.grid.axes.length === 3 ? 3 : 2]];
    const milliseconds = await this.#compute(of, { ...of.grid, size }, 4, signal);
    return (2 * milliseconds) / size.reduce((product, count) => product * count, 1);
  }

  protected override async fine(of: SurveyOf, ofNode: number, signal: AbortSignal): Promise<void> {
    const size = finest(FINE_BASIN[of.grid.axes.length === 3 ? 3 : 2], ofNode, BASIN_MS);
    await this.#compute(of, { ...of.grid, size }, 2 * NUM_PARTS, signal);
  }

  async #compute(of: SurveyOf, grid: Grid, num_parts: number, signal: AbortSignal): Promise<number> {
    const { client, method } = of;
    const reference = await settled(of);
    const [width = 1] = grid.size;
    const index = new Int32Array(width * numRows(grid)).fill(-1);
    const known: BasinEnds[] = [];
    const start = performance.now();
    let [done, nextLabel] = [0, start + LABEL_MS];
    const tell = async (): Promise<void> => {
      const [ends, at, share] = [joinedEnds(known), index.slice(), done / index.length];
      const labels = await client.ask('label', method, ends, reference);
      if (!signal.aborted)
        this.show({ grid, index: at, ends, labels, progress: share, milliseconds: performance.now() - start });
    };
    await client.share(
      method,
      'basin',
      parts(grid, num_parts),
      ({ rows: [from, to] }: GridPart, ends: BasinEnds) => {
        known.push(ends);
        for (let node = from * width; node < to * width; node++) index[node] = done++;
        if (performance.now() < nextLabel) return;
        nextLabel = performance.now() + LABEL_MS;
        tell().catch(() => undefined); // a worker that died has been told
      },
      signal,
    );
    const milliseconds = performance.now() - start;
    if (!signal.aborted) await tell();
    return milliseconds;
  }
}

/** The pose to which the points of a survey converge from the reference: a sample of the points ends slightly beside it. */
async function settled({ client, method, grid, reference }: SurveyOf): Promise<Pose> {
  if (grid.stride === 1) return reference;
  const one = { ...grid, T_center: reference, size: grid.axes.map(() => 1) };
  let end: Pose = reference;
  const take = (_: GridPart, { T_target_source }: BasinEnds): void => void (end = T_target_source);
  await client.share(method, 'basin', parts(one, 1), take, new AbortController().signal);
  return end;
}

/** Share of the starts on a grid that end at the reference, or where `first`, another method, leads from it. */
export async function shareHome(client: LabClient, method: number, grid: Grid, first: number): Promise<number> {
  const reference = await settled({ client, method: first, grid, reference: grid.T_center });
  const known: BasinEnds[] = [];
  const add = (_: GridPart, ends: BasinEnds): void => void known.push(ends);
  await client.share(method, 'basin', parts(grid, 8), add, new AbortController().signal);
  return (await client.ask('label', method, joinedEnds(known), reference)).share_home;
}

function joinedEnds(all: readonly BasinEnds[]): BasinEnds {
  const joined = <T extends Float64Array | Uint8Array | Uint16Array>(
    make: (length: number) => T,
    of: (ends: BasinEnds) => T,
  ): T => {
    const result = make(all.reduce((sum, ends) => sum + of(ends).length, 0));
    let at = 0;
    for (const ends of all) {
      result.set(of(ends), at);
      at += of(ends).length;
    }
    return result;
  };
  return {
    T_target_source: joined(
      (n) => new Float64Array(n),
      (ends) => ends.T_target_source,
    ),
    end_reason: joined(
      (n) => new Uint8Array(n),
      (ends) => ends.end_reason,
    ),
    iterations: joined(
      (n) => new Uint16Array(n),
      (ends) => ends.iterations,
    ),
    cost: joined(
      (n) => new Float64Array(n),
      (ends) => ends.cost,
    ),
  };
}
