/** The files of occupancy grids: one grid for each piece of the map, since pieces that are not connected do not fit in one. */
import type { Reconstruction } from '../../pkg/scanstitch.js';

/** The name of a piece's files, without their endings; the main piece has the plain one. */
function gridName(piece: number) {
  return piece === 0 ? 'map' : `map_piece_${piece}`;
}

/** The files of ROS's map_server by their names, from the main piece. */
export function gridFiles(reconstruction: Pick<Reconstruction, 'pieces' | 'occupancy_grid'>) {
  const files: Record<string, Uint8Array | string> = {};
  for (const piece of reconstruction.pieces()) {
    const [name, grid] = [gridName(piece), reconstruction.occupancy_grid(undefined, piece)];
    files[`${name}.pgm`] = grid.pgm();
    files[`${name}.yaml`] = grid.yaml(`${name}.pgm`);
    grid.free();
  }
  return files;
}
