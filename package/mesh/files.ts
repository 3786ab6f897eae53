/** The file formats of a surface. */
import type { Surface } from '../../pkg/scanstitch.js';

export const MESH_FORMATS = ['ply', 'obj', 'stl', 'glb'] as const;
export type MeshFormat = (typeof MESH_FORMATS)[number];

/** The surface as a file. The writer of GLB is loaded on demand. */
export async function meshFile(surface: Surface, format: MeshFormat): Promise<Uint8Array> {
  if (format !== 'glb') return surface.file(format);
  return (await import('./glb.js')).toGlb(surface);
}
