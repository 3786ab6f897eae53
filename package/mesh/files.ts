/** The file formats of a surface. */
import type { Surface } from '../../pkg/scanstitch.js';

export const MESH_FORMATS = ['ply', 'obj', 'stl', 'glb'] as const;
export type MeshFormat = (typeof MESH_FORMATS)[number];

/** The surface as a file. What writes GLB is loaded when it is asked for. */
export async function meshFile(surface: Surface, format: MeshFormat): Promise<Uint8Array> {
  if (format !== 'glb') return surface.file(format);
  return (await import('./glb.js')).toGlb(surface);
}
