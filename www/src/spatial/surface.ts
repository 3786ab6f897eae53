/** The surface of the run that is shown: made when it is asked for, from then on it follows the run, and is discarded with it. */
import type { ReactiveController, ReactiveControllerHost } from 'lit';
import type { MeshFormat } from '../../../package/mesh/files.js';
import { type PlacedFrame, placedFrames, VOXEL_SIZE } from '../../../package/mesh/frames.js';
import { messageOf } from '../engine/message-of.js';
import { WorkerDied } from '../engine/remote.js';
import { SurfaceClient } from '../engine/surface-client.js';
import type { SpatialResult } from '../engine/spatial-protocol.js';
import type { SurfaceMesh } from '../engine/surface-protocol.js';
import { formatCount, formatDuration, plural } from '../views/format.js';
import { memoizeLast } from '../views/memoize-last.js';
import type { SpatialSession } from './session.js';
import type { SurfaceChange, SurfaceState } from './surface-bar.js';

const POINTS_STAY = 'The points of the map are still there';

/** While the run goes on, the surface is brought up to date in so large a share of the time. */
const UPDATE_SHARE = 0.3;

/** What is made, or was, of a run. */
interface Making {
  client: SurfaceClient;
  session: SpatialSession;
  /** How its depths were read; undefined before the first. */
  quantisation?: SpatialResult['quantisation'];
  isBusy: boolean;
  /** While the run goes on, it is not brought up to date before (ms, of `performance`). */
  nextUpdate: number;
  /** The frames of `mesh`; null before the first. Final: of a run that had ended. */
  made: { frames: readonly PlacedFrame[]; isFinal: boolean } | null;
}

export class RunSurface implements ReactiveController {
  mesh: SurfaceMesh | null = null;
  /** While it is made: the share that is done, 0..1, and what is being done. */
  progress: number | null = null;
  activity = '';
  /** Side of a voxel (m). */
  #voxelSize = VOXEL_SIZE;
  /** 0: all. */
  #maxTriangles = 0;
  /** Holes are filled up to so many voxels; 0: none. */
  #holeVoxels = 0;
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
      maxTriangles: number,
      holeVoxels: number,
    ): SurfaceState => ({
      mesh,
      numPlaced,
      num_frames,
      isMaking,
      voxelSize,
      maxTriangles,
      holeVoxels,
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

  stateOf({ snapshot }: SpatialSession): SurfaceState {
    const { result } = snapshot ?? {};
    const numPlaced = result ? this.#placedOf(result).length : 0;
    const isMaking = this.#making !== null && !this.mesh;
    return this.#stateOf(
      this.mesh,
      numPlaced,
      result?.frames.length ?? 0,
      isMaking,
      this.#voxelSize,
      this.#maxTriangles,
      this.#holeVoxels,
    );
  }

  /** To be called whenever the run may have changed: its surface grows with it. */
  follow(session: SpatialSession): void {
    const making = this.#making;
    if (!making) return;
    if (session !== making.session || session.snapshot === null) this.#end();
    else if (making.isBusy || this.#isUpToDate(making)) return;
    else if (session.phase !== 'running' || performance.now() >= making.nextUpdate)
      this.#finished = this.#update(making);
  }

  /** Makes it, unless it is there or being made with voxels of this side (m). Whether it is there in the end; why not is told. */
  async make(session: SpatialSession, voxelSize = this.#voxelSize): Promise<boolean> {
    if (voxelSize !== this.#voxelSize) this.#end();
    this.#voxelSize = voxelSize;
    if (!this.#making && session.snapshot) {
      const { snapshot } = session;
      const making: Making = { client: new SurfaceClient(), session, isBusy: false, nextUpdate: 0, made: null };
      this.#making = making;
      session.announce(`Making the surface of ${plural(this.#placedOf(snapshot.result).length, 'frame')}.`);
      this.#finished = this.#update(making);
    }
    return this.#finished;
  }

  /** Has the surface with so many triangles at most, 0: all; and its holes filled up to so many voxels, 0: none. */
  change({ maxTriangles = this.#maxTriangles, holeVoxels = this.#holeVoxels }: SurfaceChange): void {
    this.#maxTriangles = maxTriangles;
    this.#holeVoxels = holeVoxels;
    const making = this.#making;
    if (!making) return;
    making.made = null;
    // What is being made is changed by its next update.
    if (!making.isBusy) this.#finished = this.#update(making);
    this.#host.requestUpdate();
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

  /** Whether it is of the run as it is: with the frames' poses, and final where the run has ended. */
  #isUpToDate({ session, made }: Making): boolean {
    const { snapshot, phase } = session;
    const isSame = snapshot !== null && made !== null && areEqual(this.#placedOf(snapshot.result), made.frames);
    return isSame && (made.isFinal || phase === 'running');
  }

  /** Until it is of the run as it is; while the run goes on, once. */
  async #update(making: Making): Promise<boolean> {
    making.isBusy = true;
    const start = performance.now();
    try {
      do await this.#updateOnce(making);
      while (this.#making === making && making.session.phase !== 'running' && !this.#isUpToDate(making));
      if (this.#making !== making) return false;
      if (making.made?.isFinal) this.#announceEnd(making, start);
      return true;
    } catch (error) {
      if (this.#making === making) this.#onFailed(making, error);
      return false;
    } finally {
      making.isBusy = false;
      making.nextUpdate = performance.now() + (performance.now() - start) / UPDATE_SHARE;
      if (this.#making === making) this.#show(null, '');
    }
  }

  async #updateOnce(making: Making): Promise<void> {
    const { client, session } = making;
    const { snapshot, phase } = session;
    if (!snapshot) return;
    const { quantisation } = snapshot.result;
    if (making.quantisation !== quantisation) {
      // All depths are read in another way than before.
      const config = await session.ask('decode_config');
      if (config === undefined) throw new Error('No frame has been read');
      await client.begin(config, this.#voxelSize);
      making.quantisation = quantisation;
    }
    const frames = this.#placedOf(snapshot.result);
    // A surface that has grown with the run first takes in its last keyframes and is shown, then has all frames.
    const { made } = making;
    const hasGrown = made !== null && !made.isFinal && !this.mesh?.is_of_clouds;
    const isFinal = phase !== 'running' && !(hasGrown && !areEqual(frames, made.frames));
    await client.follow(frames, isFinal, {
      points: (frame) => session.ask('kept_points', frame),
      progress: (done, total) =>
        this.#making === making && session.phase !== 'running' && this.#onProgress(done, total),
    });
    const [maxTriangles, holeVoxels] = [this.#maxTriangles, this.#holeVoxels];
    const mesh = await client.mesh(maxTriangles || null, holeVoxels * this.#voxelSize);
    if (this.#making !== making) return;
    if (isFinal && mesh.triangles.length === 0) throw new Error('No surface was seen well enough');
    const isAsWanted = maxTriangles === this.#maxTriangles && holeVoxels === this.#holeVoxels;
    making.made = isAsWanted ? { frames, isFinal } : null;
    this.mesh = mesh.triangles.length > 0 ? mesh : null;
    this.#host.requestUpdate();
  }

  #announceEnd({ session }: Making, start: number): void {
    const took = formatDuration(performance.now() - start);
    session.announce(`Surface of ${formatCount((this.mesh?.triangles.length ?? 0) / 3)} triangles made in ${took}.`);
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
