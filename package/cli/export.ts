/** `scanstitch export`: a map for planners, drawings and maps of the world. */
import { basename } from 'node:path';
import { printable } from '../base/printable.js';
import { maskFiles, readAreas } from '../report/area_masks.js';
import { geoTiff } from '../report/geotiff.js';
import { dxf, svg, worldFile } from '../report/map_drawings.js';
import { wallLines } from '../report/wall_lines.js';
import { WALL_HEIGHT, wallFile } from '../report/wall_mesh.js';
import { type Command, CommandError, type Engine, readArguments } from './command.js';
import { writeResults } from './disk.js';
import { readText } from './inputs.js';
import { readMap } from './localize.js';
import { png } from './png.js';
import { Complaints, print } from './terminal.js';

const OPTIONS = {
  out: { type: 'string', default: 'scanstitch-out' },
  resolution: { type: 'string' },
  height: { type: 'string' },
} as const;

export const exportMap: Command = {
  name: 'export',
  about: 'a map as walls (DXF, SVG, GLB, STL), as GeoTIFF, with a world file, and as masks for nav2',
  help: () => `scanstitch export MAP [AREAS] [OPTION]...

Writes an occupancy grid, as scanstitch localize reads it, for other programs. AREAS is a file of polygons in the world
of the map (m), for the masks of nav2's costmap filters:
  {
   "scanstitch_areas": 1,
   "areas": [
    { "kind": "keepout", "polygon": [[1, 0], [3, 0], [3, 2]] },
    { "kind": "speed", "percent": 40, "polygon": [[3, 0], [6, 0], [6, 2], [3, 2]] }
   ]
  }
percent is of the full speed, from 1 to 99. Where areas overlap, the lower speed holds. A cell is in an area with its
middle.

Options:
  --out DIR          folder of the results, created if missing (default: ${OPTIONS.out.default})
  --resolution M     side of a pixel of a picture without a YAML file (m)
  --height M         of the walls in space (m; default: ${WALL_HEIGHT.usual}, for planar scans do not tell it)

Written into DIR:
  map.pgm, map.yaml  the map as map_server reads it
  map.tif            as GeoTIFF, in metres of the map; unknown cells have no data
  map.png, map.pgw   its picture with its world file, for QGIS and others
  walls.dxf          the outlines of the walls as closed polylines (m), within a cell
  walls.svg          the same as a drawing
  walls.glb          the same in space, as high as a room, for viewers of models
  walls.stl          the same for printing, in millimetres
  keepout_mask.pgm, keepout_mask.yaml
                     100 in areas to keep out of, else 0; costmap_filter_info_server: type 0, base 0.0, multiplier 1.0
  speed_mask.pgm, speed_mask.yaml
                     100 less the per cent, 0 where there is no limit; type 1, base 100.0, multiplier -1.0

Example:
  scanstitch export map.yaml areas.json --out for_nav2
`,
  run,
};

async function run(engine: Engine, args: string[]) {
  const { values, positionals } = readArguments('export', { args, options: OPTIONS, allowPositionals: true });
  const [map, areas, ...others] = positionals;
  if (map === undefined || others.length > 0) {
    throw new CommandError('Name a map, and a file of areas if there is one. See: scanstitch export --help');
  }
  const complaints = new Complaints();
  const grid = readMap(engine, map, values.resolution);
  const height = readWallHeight(values.height);
  const lines = wallLines(grid);
  const files = {
    'map.pgm': grid.pgm(),
    'map.yaml': grid.yaml('map.pgm'),
    'map.tif': geoTiff(grid, grid.grey_values()),
    'map.png': png(grid.width, grid.height, rgbOf(grid.grey_values())),
    'map.pgw': worldFile(grid),
    'walls.dxf': dxf(lines),
    'walls.svg': svg(lines),
    ...(lines.length > 0 && {
      'walls.glb': await wallFile(grid, height, 'glb'),
      'walls.stl': await wallFile(grid, height, 'stl'),
    }),
    ...(areas !== undefined && maskFiles(grid, readText(areas, readAreas), complaints.complain)),
  };
  if (lines.length === 0)
    complaints.complain(`${basename(map)}: The map shows no wall, so walls.glb and walls.stl were not written.`);
  await writeResults(values.out, files);
  print(`${lines.length} outlines of walls\nWritten to ${printable(values.out)}\n`);
  return complaints.exitCode;
}

function readWallHeight(given: string | undefined) {
  const height = given === undefined ? WALL_HEIGHT.usual : Number(given);
  const { least, most } = WALL_HEIGHT;
  if (!(height >= least && height <= most)) {
    throw new CommandError(`--height ${given}: give a number of metres from ${least} to ${most}.`);
  }
  return height;
}

function rgbOf(grey: Uint8Array) {
  const rgb = new Uint8Array(3 * grey.length);
  grey.forEach((value, index) => rgb.fill(value, 3 * index, 3 * index + 3));
  return rgb;
}
