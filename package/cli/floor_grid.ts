/** What `reconstruct --grid` asks for: a map in space flattened to a grid for robots that drive. */
import { basename, extname } from 'node:path';
import type { SpatialReconstruction } from '../../pkg/scanstitch.js';
import { printable } from '../base/printable.js';
import { floorOf, GRID_BAND } from '../mesh/floor_grid.js';
import { CommandError, isScanstitchError } from './command.js';
import { writeWhole } from './disk.js';
import { note, print } from './terminal.js';

export interface GridOptions {
  path: string;
  /** Heights over the floor (m): what stands between them is in the way. */
  band: readonly [low: number, high: number];
}

/** What `--grid` and `--band` ask for. */
export function readGridOptions(path: string | undefined, band: string | undefined): GridOptions | undefined {
  if (path === undefined) {
    if (band !== undefined) throw new CommandError('--band is the heights over the floor that --grid FILE shows.');
    return undefined;
  }
  if (!/^\.ya?ml$/i.test(extname(path))) {
    throw new CommandError(`--grid ${path}: the name ends in .yaml; its picture is written beside it as .pgm.`);
  }
  if (band === undefined) return { path, band: GRID_BAND };
  const [low = NaN, high = NaN, ...others] = band.split(':').map((height) => (height === '' ? NaN : Number(height)));
  if (!(low > 0 && low < high && high < Infinity) || others.length > 0) {
    throw new CommandError(`--band ${band}: give two heights over the floor, the lower first, as 0.2:1.8 (m).`);
  }
  return { path, band: [low, high] };
}

/** Writes the grid and its picture; `positions`: of the map's points. */
export async function writeFloorGrid(
  reconstruction: SpatialReconstruction,
  positions: Float32Array,
  { path, band }: GridOptions,
  complain: (problem: string) => void,
) {
  const { frames, camera } = reconstruction.result();
  const normals = Int16Array.from(reconstruction.map_normals(), (coordinate) => Math.round(32_767 * coordinate));
  const { up, floor } = floorOf(
    { positions, normals },
    frames.map(({ T_world_sensor: { x, y, z } }) => [x, y, z]),
    camera !== null,
  );
  try {
    const grid = reconstruction.flattened_grid(Float64Array.from(up), floor, Float64Array.from(band));
    const picture = `${path.slice(0, -extname(path).length)}.pgm`;
    await writeWhole(picture, grid.pgm());
    await writeWhole(path, grid.yaml(basename(picture)));
    note(
      `The floor is ${(-floor).toFixed(2)} m below the first frame; the grid shows what stands ${band[0]} to ${band[1]} m over it.`,
    );
    print(`Grid of ${grid.width} x ${grid.height} cells of ${grid.resolution} m, written to ${printable(path)}\n`);
    grid.free();
  } catch (error) {
    if (!isScanstitchError(error)) throw error;
    complain(`--grid ${path}: ${error.message}`);
  }
}
