/** A surface with fewer triangles: edges are collapsed where that changes it least (quadric error metrics). */
import type { Surface } from '../../pkg/scanstitch.js';

/** The most triangles that can be asked for, and the least. */
export const TRIANGLES = { least: 100, most: 100_000_000 };

/** Leaves at most about this many triangles; returns by how much that moves the surface (m). The decimator is loaded on demand. */
export async function decimate(surface: Surface, maxTriangles: number): Promise<number> {
  if (surface.num_triangles <= maxTriangles) return 0;
  const { MeshoptSimplifier } = await import('meshoptimizer/simplifier');
  await MeshoptSimplifier.ready;
  const positions = surface.positions();
  // As far as that takes it: by an error as large as the whole surface.
  const [triangles, error] = MeshoptSimplifier.simplify(surface.triangles(), positions, 3, 3 * maxTriangles, 1);
  surface.set_triangles(triangles);
  return error * MeshoptSimplifier.getScale(positions, 3);
}
