/** The surface of a run: what the page and the worker that makes it say to each other. */
import type { MeshFormat } from '../../../package/mesh/files.js';

/** Triangles over shared vertices. */
export interface SurfaceMesh {
  /** x y z x y z ..., world of the run, m. */
  positions: Float32Array;
  /** Unit vectors, towards the side that was seen. */
  normals: Float32Array;
  /** red green blue ...; empty without colours. */
  colors: Uint8Array;
  /** Standard deviation of each vertex along its normal, m. */
  deviations: Float32Array;
  /** 1 for each vertex that fills a hole; empty where none does. */
  filled: Uint8Array;
  /** Triangles that fill holes. */
  num_filled: number;
  /** Three vertices each. */
  triangles: Uint32Array;
  /** By how much fewer triangles have moved it, m; 0 with all of them. */
  moved: number;
  /** Frames that it is made of. */
  num_frames: number;
  /** Side of a voxel, m: larger than was asked for where the memory was not enough, or clouds have too few points for it. */
  voxel_size: number;
  /** Whether the frames are clouds, whose holes stay open. */
  is_of_clouds: boolean;
}

/** The worker that holds the surface. */
export interface SurfaceApi {
  start(module: WebAssembly.Module): void;
  /** `decode_config`: how the run read its frames. */
  begin(decode_config: string, voxel_size: number, max_megabytes: number): void;
  /** The frames that are to be in it, each with its pose x y z qx qy qz qw (m), sensor to world; which of them are to be put. */
  follow(frames: Uint32Array, poses: Float64Array, isFinal: boolean): Uint32Array;
  /** `kept`: what the run keeps of the frame. */
  put(frame: number, kept: Uint8Array): void;
  /** With at most about `maxTriangles`, null: all; its holes filled up to this extent (m), 0: none. */
  mesh(maxTriangles: number | null, maxHoleSize: number): SurfaceMesh;
  file(format: MeshFormat): Uint8Array;
}
