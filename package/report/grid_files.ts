/** The files of occupancy grids: one grid for each piece of the map, since pieces that are not connected do not fit in one. */
import type { OccupancyGrid, Reconstruction } from '../../pkg/scanstitch.js';

/** The name of a piece's files, without their endings; the main piece has the plain one. */
function gridName(piece: number) {
  return piece === 0 ? 'map' : `map_piece_${piece}`;
}

/** What has grids: the full engine, and the part of it that the page begins with. */
export interface HasGrids extends Pick<Reconstruction, 'pieces'> {
  occupancy_grid: (
    ...given: Parameters<Reconstruction['occupancy_grid']>
  ) => Pick<OccupancyGrid, 'pgm' | 'yaml' | 'free'>;
}

/** The files of ROS's map_server by their names, from the main piece. */
export function gridFiles(reconstruction: HasGrids) {
  const files: Record<string, Uint8Array | string> = {};
  for (const piece of reconstruction.pieces()) {
    const [name, grid] = [gridName(piece), reconstruction.occupancy_grid(undefined, piece)];
    files[`${name}.pgm`] = grid.pgm();
    files[`${name}.yaml`] = grid.yaml(`${name}.pgm`);
    grid.free();
  }
  return files;
}
