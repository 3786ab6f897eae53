/** The page's side of a surface: one worker that makes it from the images that a run keeps, and holds it for its exports. */
import type { MeshFormat } from '../../../package/mesh/files.js';
import { MEMORY_MB, type PlacedFrame } from '../../../package/mesh/frames.js';
import type { SurfaceApi, SurfaceMesh } from './surface-protocol.js';
import surfaceUrl from './surface-worker.ts?worker&url';
import { WorkerHost } from './worker-host.js';

/** What it needs of the run. */
export interface SurfaceSource {
  /** The image that the run keeps of a frame. */
  image(frame: number): Promise<Uint8Array | undefined>;
  /** `done` of `total` images have been put. */
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
    const numbers = Uint32Array.from(frames, ({ index }) => index);
    const poses = Float64Array.from(frames.flatMap(({ pose }) => [...pose]));
    // Where an image has been thinned out since it was put, the first round finds that, and the second puts all anew.
    for (let round = 0; round < 2; round++) {
      const wanted = await this.#host.call('follow', numbers, poses, isFinal);
      if (wanted.length === 0) return;
      await this.#put(wanted, source);
    }
  }

  async #put(wanted: Uint32Array, source: SurfaceSource): Promise<void> {
    const read = (at: number): Promise<Uint8Array | undefined> | undefined => {
      const frame = wanted[at];
      const image = frame === undefined ? undefined : source.image(frame);
      image?.catch(() => undefined); // told where it is awaited
      return image;
    };
    let next = read(0);
    for (const [at, frame] of wanted.entries()) {
      source.progress(at, wanted.length);
      const image = await next;
      next = read(at + 1);
      if (image) await this.#host.give('put', [image.buffer as ArrayBuffer], frame, image);
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
