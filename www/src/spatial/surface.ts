/** The surface of the run that is shown: made when it is asked for, and discarded when the run's poses are others. */
import type { ReactiveController, ReactiveControllerHost } from 'lit';
import type { MeshFormat } from '../../../package/mesh/files.js';
import { type PlacedFrame, placedFrames, VOXEL_SIZE } from '../../../package/mesh/frames.js';
import { errorMessage } from '../components/session.js';
import { messageOf } from '../engine/message-of.js';
import { WorkerDied } from '../engine/remote.js';
import { SurfaceClient } from '../engine/surface-client.js';
import type { SurfaceMesh } from '../engine/surface-protocol.js';
import { formatCount, formatDuration, plural } from '../views/format.js';
import { memoizeLast } from '../views/memoize-last.js';
import type { SpatialSession } from './session.js';
import type { SurfaceState } from './surface-bar.js';

const POINTS_STAY = 'The points of the map are still there';

/** What is made, or was, and of which frames. */
interface Making {
  client: SurfaceClient;
  session: SpatialSession;
  frames: readonly PlacedFrame[];
}

export class RunSurface implements ReactiveController {
  mesh: SurfaceMesh | null = null;
  /** While it is made: the share that is done, 0..1, and what is being done. */
  progress: number | null = null;
  activity = '';
  /** Side of a voxel (m). */
  #voxelSize = VOXEL_SIZE;
  #making: Making | null = null;
  #finished: Promise<boolean> = Promise.resolve(false);
  #host: ReactiveControllerHost & { readonly isConnected: boolean };
  #placedOf = memoizeLast(placedFrames);
  #stateOf = memoizeLast(
    (
      mesh: SurfaceMesh | null,
      numPlaced: number,
      num_frames: number,
      isMaking: boolean,
      voxelSize: number,
    ): SurfaceState => ({
      mesh,
      numPlaced,
      num_frames,
      isMaking,
      voxelSize,
    }),
  );

  constructor(host: ReactiveControllerHost & { readonly isConnected: boolean }) {
    this.#host = host;
    host.addController(this);
  }

  /** A host that is moved within the page keeps it. */
  hostDisconnected(): void {
    queueMicrotask(() => this.#host.isConnected || this.#end());
  }

  stateOf({ snapshot, phase }: SpatialSession): SurfaceState {
    const { result } = snapshot ?? {};
    const hasEnded = phase === 'done' || phase === 'stopped';
    const numPlaced = hasEnded && result?.camera ? this.#placedOf(result).length : 0;
    return this.#stateOf(this.mesh, numPlaced, result?.frames.length ?? 0, this.progress !== null, this.#voxelSize);
  }

  /** To be called whenever the run may be another one. */
  follow(session: SpatialSession): void {
    if (!this.#making) return;
    const { snapshot, phase } = session;
    const isSame =
      session === this.#making.session &&
      phase !== 'running' &&
      snapshot !== null &&
      areEqual(this.#placedOf(snapshot.result), this.#making.frames);
    if (!isSame) this.#end();
  }

  /** Makes it, unless it is there or being made with voxels of this side (m). Whether it is there in the end; why not is told. */
  make(session: SpatialSession, voxelSize = this.#voxelSize): Promise<boolean> {
    if (voxelSize !== this.#voxelSize) this.#end();
    this.#voxelSize = voxelSize;
    const { mesh, progress } = this;
    if (mesh || progress !== null || !session.snapshot) return mesh ? Promise.resolve(true) : this.#finished;
    const frames = this.#placedOf(session.snapshot.result);
    const making = { client: new SurfaceClient(), session, frames };
    this.#making = making;
    this.#finished = this.#make(making);
    return this.#finished;
  }

  /** Ends the making; the points of the map stay. */
  stop(): void {
    const { session } = this.#making ?? {};
    this.#end();
    session?.announce(`The surface was stopped. ${POINTS_STAY}.`);
  }

  /** The surface that is there, as a file. Made again where its thread has died since. */
  async file(session: SpatialSession, format: MeshFormat): Promise<Uint8Array> {
    if (this.#making?.client.hasDied) this.#end();
    if (!(await this.make(session)) || !this.#making) throw new Error('There is no surface');
    return this.#making.client.file(format);
  }

  async #make(making: Making): Promise<boolean> {
    const { client, session, frames } = making;
    const start = performance.now();
    this.#show(0, 'Starting the surface');
    session.announce(`Making the surface of ${plural(frames.length, 'frame')}.`);
    try {
      const config = await session.ask('decode_config');
      if (config === undefined) throw new Error('No depth image has been read');
      const mesh = await client.make(config, this.#voxelSize, frames, session.dataset?.jobs ?? [], {
        progress: (done) => this.#making === making && this.#onProgress(done, frames.length),
        problem: (problem) => this.#making === making && session.tell([errorMessage(problem)]),
      });
      if (this.#making !== making) return false;
      if (mesh.triangles.length === 0) throw new Error('No surface was seen well enough');
      this.mesh = mesh;
      const took = formatDuration(performance.now() - start);
      session.announce(`Surface of ${formatCount(mesh.triangles.length / 3)} triangles made in ${took}.`);
      return true;
    } catch (error) {
      if (this.#making === making) this.#onFailed(making, error);
      return false;
    } finally {
      if (this.#making === making) this.#show(null, '');
    }
  }

  #onProgress(done: number, total: number): void {
    const activity = done < total ? `Surface: frame ${done + 1} of ${total}` : 'Surface: extracting the triangles';
    this.#show(done / total, activity);
  }

  #onFailed({ session }: Making, error: unknown): void {
    this.#end();
    const isCrash = error instanceof WorkerDied;
    const why = isCrash ? `: its worker ended (${messageOf(error)}), as when memory is short` : `: ${messageOf(error)}`;
    session.report(
      `The surface could not be made${why.replace(/\.$/, '')}. ${POINTS_STAY}`,
      isCrash ? 'Close other tabs and try again' : '',
      isCrash ? () => void this.make(session) : undefined,
    );
  }

  /** Without a surface. */
  #end(): void {
    this.#making?.client.end();
    this.#making = null;
    this.mesh = null;
    this.#show(null, '');
  }

  #show(progress: number | null, activity: string): void {
    this.progress = progress;
    this.activity = activity;
    this.#host.requestUpdate();
  }
}

function areEqual(a: readonly PlacedFrame[], b: readonly PlacedFrame[]): boolean {
  const isSame = (one: PlacedFrame, other: PlacedFrame | undefined): boolean =>
    one.index === other?.index && one.pose.every((value, i) => value === other.pose[i]);
  return a === b || (a.length === b.length && a.every((frame, i) => isSame(frame, b[i])));
}
