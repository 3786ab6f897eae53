/** The page's side of a surface: one worker that makes it from what a run keeps of its frames, and holds it for its exports. */
import type { MeshFormat } from '../../../package/mesh/files.js';
import { MEMORY_MB, numbersAndPoses, type PlacedFrame } from '../../../package/mesh/frames.js';
import type { SurfaceApi, SurfaceMesh } from './surface-protocol.js';
import surfaceUrl from './surface-worker.ts?worker&url';
import { WorkerHost } from './worker-host.js';

/** What it needs of the run. */
export interface SurfaceSource {
  /** What the run keeps of a frame. */
  points(frame: number): Promise<Uint8Array | undefined>;
  /** `done` of `total` frames have been put. */
  progress(done: number, total: number): unknown;
}

export class SurfaceClient {
  #hasDied = false;
  #host = new WorkerHost<SurfaceApi>(surfaceUrl, {
    crashed: () => this.end(),
    unavailable: () => this.end(), // the call that waits is told
  });

  /** Whether the surface that it made is gone. */
  get hasDied(): boolean {
    return this.#hasDied;
  }

  /** An empty surface with voxels of this side (m). Every call rejects with `WorkerDied` where the worker dies, or is ended. */
  begin(decode_config: string, voxelSize: number): Promise<void> {
    return this.#host.call('begin', decode_config, voxelSize, MEMORY_MB);
  }

  /** Brings it to these frames at their poses. While the run goes on (`isFinal` is false), small motions are left for later. */
  async follow(frames: readonly PlacedFrame[], isFinal: boolean, source: SurfaceSource): Promise<void> {
    const [numbers, poses] = numbersAndPoses(frames);
    // Where a frame has been thinned out since it was put, the first round finds that, and the second puts all anew.
    for (let round = 0; round < 2; round++) {
      const wanted = await this.#host.call('follow', numbers, poses, isFinal);
      if (wanted.length === 0) return;
      await this.#put(wanted, source);
    }
  }

  async #put(wanted: Uint32Array, source: SurfaceSource): Promise<void> {
    const read = (at: number): Promise<Uint8Array | undefined> | undefined => {
      const frame = wanted[at];
      const points = frame === undefined ? undefined : source.points(frame);
      points?.catch(() => undefined); // told where it is awaited
      return points;
    };
    let next = read(0);
    for (const [at, frame] of wanted.entries()) {
      source.progress(at, wanted.length);
      const points = await next;
      next = read(at + 1);
      if (points) await this.#host.give('put', [points.buffer as ArrayBuffer], frame, points);
    }
    source.progress(wanted.length, wanted.length);
  }

  /** With at most about `maxTriangles`, null: all; its holes filled up to this extent (m), 0: none. */
  mesh(maxTriangles: number | null, maxHoleSize: number): Promise<SurfaceMesh> {
    return this.#host.call('mesh', maxTriangles, maxHoleSize);
  }

  file(format: MeshFormat): Promise<Uint8Array> {
    return this.#host.call('file', format);
  }

  end(): void {
    this.#hasDied = true;
    this.#host.dispose();
  }
}
