// @ts-check
/** The files of occupancy grids: one grid for each piece of the map, since pieces that are not connected do not fit in one. */

/** The name of a piece's files, without their endings; the main piece has the plain one. @param {number} piece */
function gridName(piece) {
  return piece === 0 ? 'map' : `map_piece_${piece}`;
}

/**
 * The files of ROS's map_server by their names, from the main piece.
 * @param {Pick<import('../pkg/scanstitch.js').Reconstruction, 'pieces' | 'occupancy_grid'>} reconstruction
 */
export function gridFiles(reconstruction) {
  /** @type {Record<string, Uint8Array | string>} */
  const files = {};
  for (const piece of reconstruction.pieces()) {
    const [name, grid] = [gridName(piece), reconstruction.occupancy_grid(undefined, piece)];
    files[`${name}.pgm`] = grid.pgm();
    files[`${name}.yaml`] = grid.yaml(`${name}.pgm`);
    grid.free();
  }
  return files;
}
