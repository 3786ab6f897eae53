/** What can be downloaded of a run of planar scans, and how a file leaves the page. */

export interface ExportItem {
  id:
    | 'trajectory'
    | 'matrices'
    | 'map'
    | 'grid'
    | 'geotiff'
    | 'walls_glb'
    | 'walls_stl'
    | 'picture'
    | 'report'
    | 'mcap'
    | 'workbench'
    | 'everything';
  label: string;
  detail: string;
}

export const EXPORTS: readonly ExportItem[] = [
  { id: 'everything', label: 'Everything', detail: 'all of these and report.json, as a zip' },
  { id: 'report', label: 'Report to print', detail: 'figures, map and notes, as HTML' },
  { id: 'trajectory', label: 'Trajectory', detail: 'TUM text: t x y z qx qy qz qw a line' },
  { id: 'matrices', label: 'Matrices', detail: '4 × 4, a text file a scan, as a zip' },
  { id: 'map', label: 'Map', detail: 'all points in one frame, as PLY' },
  { id: 'grid', label: 'Occupancy grid', detail: 'map.pgm and map.yaml of each piece, as a zip' },
  { id: 'geotiff', label: 'GeoTIFF', detail: 'the grid in metres, for QGIS' },
  { id: 'walls_glb', label: 'Walls in space', detail: '2.5 m high, as GLB' },
  { id: 'walls_stl', label: 'Walls to print', detail: 'as STL, in millimetres' },
  { id: 'mcap', label: 'MCAP', detail: 'grid, scans and path, for Foxglove and rviz' },
  { id: 'workbench', label: 'Workbench', detail: 'scans, settings and steps, to open again' },
  { id: 'picture', label: 'Picture', detail: 'the map as you see it, as PNG' },
];

export interface Download {
  name: string;
  blob: Blob;
}

export function download({ name, blob }: Download): void {
  const url = URL.createObjectURL(blob);
  const link = document.createElement('a');
  link.href = url;
  link.download = name;
  link.click();
  // The browser has taken the address by then; a minute later nobody needs it.
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}
