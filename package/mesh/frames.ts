/** The frames that the surface of a run is made of, and how they are added to it: the same for the page and the command line. */
import type { SpatialResult } from '../../pkg/scanstitch.js';

/** Side of a voxel (m) and memory of the field (MB), by default: the engine's own. Clouds have larger voxels, by their density. */
export const VOXEL_SIZE = 0.02;
export const MEMORY_MB = 400;
/** Holes are filled up to so many sides of a voxel where no size is given: as large as the smallest part that is kept. */
export const HOLE_VOXELS = 10;

/** A frame whose pose counts. */
export interface PlacedFrame {
  /** Number in the recording. */
  index: number;
  name: string;
  /** x y z qx qy qz qw (m), sensor to world. */
  pose: Float64Array;
}

/** The frames whose pose is good, in the main piece of the map. */
export function placedFrames({ frames }: SpatialResult): PlacedFrame[] {
  return frames
    .filter(({ status, piece }) => status === 'good' && piece === 0)
    .map(({ index, name, T_world_sensor: T }) => ({
      index,
      name,
      pose: Float64Array.of(T.x, T.y, T.z, T.qx, T.qy, T.qz, T.qw),
    }));
}

/** As the engine's `Surface.follow` takes them: their numbers, and all their poses. */
export function numbersAndPoses(frames: readonly PlacedFrame[]): [numbers: Uint32Array, poses: Float64Array] {
  return [Uint32Array.from(frames, ({ index }) => index), Float64Array.from(frames.flatMap(({ pose }) => [...pose]))];
}

interface Readable {
  read(): Promise<Uint8Array>;
}

export interface FrameFiles {
  depth: Readable;
  color: Readable | null;
}

/** What is done with each frame. */
export interface SurfaceSteps {
  /** Null: the frame has none. */
  filesOf(frame: PlacedFrame): FrameFiles | null;
  /** `colors`: undefined without. */
  add(frame: PlacedFrame, depth: Uint8Array, colors: Uint8Array | undefined): void | Promise<void>;
  /** The frame cannot be used. The others are added; what this throws ends it. */
  refused(frame: PlacedFrame, error: unknown): void;
  /** `count` frames are done. */
  done(count: number): void;
}

/** Adds frames one after the other; the next one is read meanwhile. */
export async function addFrames(frames: readonly PlacedFrame[], steps: SurfaceSteps): Promise<void> {
  const read = (frame: PlacedFrame | undefined) => readFiles(frame ? steps.filesOf(frame) : null);
  let next = read(frames[0]);
  for (const [at, frame] of frames.entries()) {
    const files = await next;
    next = read(frames[at + 1]);
    try {
      const { depth, colors } = files();
      if (depth) await steps.add(frame, depth, colors);
    } catch (error) {
      steps.refused(frame, error);
    }
    steps.done(at + 1);
  }
}

/** A function that returns what was read or throws the error. A frame without its colours is used as well. */
async function readFiles(files: FrameFiles | null): Promise<() => { depth?: Uint8Array; colors?: Uint8Array }> {
  if (!files) return () => ({});
  try {
    const [depth, colors] = await Promise.all([files.depth.read(), files.color?.read().catch(() => undefined)]);
    return () => (colors ? { depth, colors } : { depth });
  } catch (error) {
    return () => {
      throw error;
    };
  }
}
