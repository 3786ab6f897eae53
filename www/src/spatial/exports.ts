/** Exports of a run in space. */
import { MESH_FORMATS, type MeshFormat } from '../../../package/mesh/files.js';
import type { MenuItem } from '../components/menu.js';
import type { FloorGridFiles, SpatialAnswers } from '../engine/spatial-protocol.js';
import type { Download } from '../export/download.js';
import { matrixFiles, reportOf, type ReportSource, textBlob, utf8, zip } from '../export/exports.js';

export const SPATIAL_EXPORTS: readonly MenuItem[] = [
  {
    id: 'everything',
    label: 'Everything',
    detail: 'trajectory, matrices, map as PLY and PCD, reports, errors and picture, as a zip',
  },
  { id: 'trajectory', label: 'Trajectory', detail: 'TUM text: t x y z qx qy qz qw a line' },
  { id: 'ply', label: 'Map as PLY', detail: 'points with colours and normals, binary' },
  { id: 'ply_ascii', label: 'PLY as text', detail: 'the map, human-readable' },
  { id: 'pcd', label: 'Map as PCD', detail: 'the same for PCL, binary' },
  { id: 'pcd_binary_compressed', label: 'PCD, compressed', detail: 'the map, lossless' },
  { id: 'pcd_ascii', label: 'PCD as text', detail: 'the map, human-readable' },
  {
    id: 'floor_grid',
    label: 'Grid on the floor',
    detail: 'for robots: map.pgm and map.yaml of what stands 0.2 to 1.8 m over it, or as chosen',
  },
  { id: 'report', label: 'Report to print', detail: 'figures, map, path, frames and notes, as one HTML file' },
  { id: 'json', label: 'Report as JSON', detail: 'report.json: settings, frames, comparison' },
  { id: 'errors', label: 'Errors', detail: 'one line a frame, as CSV' },
  { id: 'picture', label: 'Picture', detail: 'the map as you see it, as PNG' },
  { id: 'turntable', label: 'Turntable', detail: 'the map as it turns once, in 8 s, as WebM' },
];

/** Of a run of depth images; what is not there yet is made first. */
const SURFACE_EXPORTS: readonly MenuItem[] = [
  {
    id: 'surface_glb',
    label: 'Surface as GLB',
    detail: 'triangles with colours where there are any, for viewers, phones and games',
  },
  { id: 'surface_ply', label: 'Surface as PLY', detail: 'with normals and standard deviations, binary' },
  { id: 'surface_obj', label: 'Surface as OBJ', detail: 'triangles, as text' },
  { id: 'surface_stl', label: 'Surface as STL', detail: 'in millimetres, for printing' },
];
/** Of a run with pictures. */
const SPLATS: MenuItem = {
  id: 'splats',
  label: 'Images and poses',
  detail: 'for trainers of splats: nerfstudio and COLMAP, as a zip',
};

/** These exports with those of the surface, which follow those of the map, and of the pictures, where there are any. */
export function withSurface(items: readonly MenuItem[], hasPictures: boolean): readonly MenuItem[] {
  const further = hasPictures ? [...SURFACE_EXPORTS, SPLATS] : SURFACE_EXPORTS;
  return items.flatMap((item) => (item.id === 'report' ? [...further, item] : [item]));
}

/** Null: it is no export of the surface. */
export function surfaceFormat(id: string): MeshFormat | null {
  return MESH_FORMATS.find((format) => id === `surface_${format}`) ?? null;
}

/** Where the contents come from: the engine, and the view. */
export interface SpatialSources {
  ask<K extends keyof SpatialAnswers>(kind: K): Promise<SpatialAnswers[K]>;
  surface(format: MeshFormat): Promise<Uint8Array>;
  picture(): Promise<Blob>;
  turntable(): Promise<Blob>;
  floorGrid(): Promise<FloorGridFiles>;
  /** The files for trainers of splats. */
  splats(): Promise<Record<string, Uint8Array>>;
  errors(): string;
  frameNames: readonly string[];
  report: ReportSource;
}

/** The map's formats: the name of the file, and what the engine calls its content. */
const MAPS: Readonly<Record<string, readonly [string, MapAnswer]>> = {
  ply: ['map.ply', 'map_ply'],
  ply_ascii: ['map.ply', 'map_ply_ascii'],
  pcd: ['map.pcd', 'map_pcd'],
  pcd_binary_compressed: ['map.pcd', 'map_pcd_compressed'],
  pcd_ascii: ['map.pcd', 'map_pcd_ascii'],
};
type MapAnswer = Extract<keyof SpatialAnswers, `map_p${string}`>;

export async function makeSpatialExport(id: string, sources: SpatialSources): Promise<Download> {
  const map = MAPS[id];
  if (map) return { name: map[0], blob: new Blob([new Uint8Array(await sources.ask(map[1]))]) };
  const format = surfaceFormat(id);
  if (format) return { name: `surface.${format}`, blob: new Blob([new Uint8Array(await sources.surface(format))]) };
  switch (id) {
    case 'trajectory':
      return { name: 'trajectory.tum', blob: textBlob(await sources.ask('trajectory_tum')) };
    case 'report':
      return { name: 'report.html', blob: await reportOf(sources) };
    case 'json':
      return { name: 'report.json', blob: textBlob(await sources.ask('report_json')) };
    case 'errors':
      return { name: 'errors.csv', blob: textBlob(sources.errors()) };
    case 'picture':
      return { name: 'map.png', blob: await sources.picture() };
    case 'turntable':
      return { name: 'turntable.webm', blob: await sources.turntable() };
    case 'floor_grid': {
      const { filesOf } = await import('./flattening.js');
      return { name: 'floor_grid.zip', blob: await zip(filesOf(await sources.floorGrid())) };
    }
    case 'splats':
      return { name: 'splats.zip', blob: await zip(await sources.splats()) };
    default:
      return { name: 'scanstitch.zip', blob: await zip(await allFiles(sources)) };
  }
}

async function allFiles(sources: SpatialSources): Promise<Record<string, Uint8Array>> {
  return {
    'trajectory.tum': utf8(await sources.ask('trajectory_tum')),
    ...matrixFiles(await sources.ask('trajectory_matrices'), sources.frameNames),
    'map.ply': await sources.ask('map_ply'),
    'map.pcd': await sources.ask('map_pcd'),
    'report.json': utf8(await sources.ask('report_json')),
    'report.html': new Uint8Array(await (await reportOf(sources)).arrayBuffer()),
    'errors.csv': utf8(sources.errors()),
    'map.png': new Uint8Array(await (await sources.picture()).arrayBuffer()),
  };
}
