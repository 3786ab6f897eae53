/** The page's side of a surface: one worker that makes it from the files of a run, and holds it for its exports. */
import { owned } from '../../../package/base/buffers.js';
import type { MeshFormat } from '../../../package/mesh/files.js';
import { addFrames, MEMORY_MB, type PlacedFrame } from '../../../package/mesh/frames.js';
import { problemOf, type SpatialJob } from './preparer.js';
import type { Problem } from './protocol.js';
import { WorkerDied } from './remote.js';
import type { SurfaceApi, SurfaceMesh } from './surface-protocol.js';
import surfaceUrl from './surface-worker.ts?worker&url';
import { WorkerHost } from './worker-host.js';

export interface SurfaceListener {
  /** `done` frames of those given are in the surface, or were left out. */
  progress(done: number): unknown;
  /** A frame that cannot be used. */
  problem(problem: Problem): unknown;
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

  /** `voxelSize`: of the field (m); `jobs`: the recording's. Rejects with `WorkerDied` where the worker dies, or is ended. */
  async make(
    decode_config: string,
    voxelSize: number,
    frames: readonly PlacedFrame[],
    jobs: readonly SpatialJob[],
    listener: SurfaceListener,
  ): Promise<SurfaceMesh> {
    const host = this.#host;
    const byIndex = new Map(jobs.map((job) => [job.index, job]));
    await host.call('begin', decode_config, voxelSize, MEMORY_MB);
    await addFrames(frames, {
      filesOf: ({ index }) => {
        const job = byIndex.get(index);
        return job ? { depth: job.file, color: job.color } : null;
      },
      add: ({ name, pose }, depth, colors) => {
        const [ownDepth, ownColors] = [owned(depth), colors ? owned(colors) : null];
        const buffers = [ownDepth, ownColors].flatMap((given) => (given ? [given.buffer as ArrayBuffer] : []));
        return host.give('add', buffers, name, ownDepth, ownColors, pose);
      },
      refused: ({ name }, error) => {
        if (error instanceof WorkerDied) throw error;
        listener.problem(problemOf(error, name));
      },
      done: (count) => listener.progress(count),
    });
    return host.call('mesh');
  }

  file(format: MeshFormat): Promise<Uint8Array> {
    return this.#host.call('file', format);
  }

  end(): void {
    this.#hasDied = true;
    this.#host.dispose();
  }
}
