/** `scanstitch localize`: where the scans of a recording were taken in a map that exists. */
import { basename, dirname, resolve } from 'node:path';
import { gunzipSync } from 'node:zlib';
import type { Localization, LocalizationResult, OccupancyGrid } from '../../pkg/scanstitch.js';
import { printable } from '../base/printable.js';
import { localizationPixels } from '../report/localization_pixels.js';
import { nextTurn } from '../run/spatial_run.js';
import { type Command, CommandError, type Engine, optionsOf, readArguments, table, untilInterrupt } from './command.js';
import { writeResults } from './disk.js';
import { openInputs, readRequired } from './inputs.js';
import { png } from './png.js';
import { withoutNamed } from './reconstruct.js';
import { addPoses, addScans } from './reconstruct_planar.js';
import { planarCatalogue, readSettings } from './settings.js';
import { Complaints, note, print, progressLine, tellNotes } from './terminal.js';

const OPTIONS = {
  ...optionsOf({ texts: 'resolution odometry table', lists: 'set', flags: 'json' }),
  out: { type: 'string', default: 'scanstitch-out' },
} as const;

/** Largest size of a packed map when unpacked (bytes). */
const MAX_UNPACKED = 1 << 30;

export const localize: Command = {
  name: 'localize',
  about: 'where the scans of a recording were taken in a map',
  help: () => `scanstitch localize MAP RECORDING... [OPTION]...

Finds planar scans in an occupancy grid, without an initial pose: every place of the map is tried, those where the scans
fit are followed with the robot's motion, and each has a probability. The map is one of
  map.yaml           of ROS's map_server, beside its picture (PGM, PNG, PPM or JPEG), in any mode, with a turned origin
  a picture          with --resolution; black is occupied, white is free, the lower left corner is the origin
  wean.dat(.gz)      of CMU 16-831
The recording is what scanstitch reconstruct takes of planar scans.

Options:
  --out DIR          folder of the results, created if missing (default: ${OPTIONS.out.default})
  --resolution M     side of a pixel of a picture without a YAML file (m)
  --odometry FILE    odometry of the robot: rows of id x y theta, or TUM; without it the log's own, or none
  --table FORMAT     what the columns of a table of ranges are, as in scanstitch reconstruct
  --set NAME=VALUE   one setting of scanstitch reconstruct, such as max_range=30; may be repeated
  --json             report.json on stdout instead of a table

Written into DIR:
  trajectory.tum     a line for each scan whose place is certain: time, or index without, x y z qx qy qz qw, the pose
                     of the robot, or of its laser where a log does not say where on the robot it sits
  report.json        the verdict; for each scan its status, its most likely place with covariance and probability,
                     and its rivals
  localization.png   the scans over the map, with the trajectory

A scan is good where its place is certain (99.9 %), doubtful where several places are possible or what it sees is not
in the map, lost where it has no place or was taken elsewhere. Where no place is certain, the verdict is "undecided" or
"not in this map". The exit code is 2 where not all scans have a certain place.

Examples:
  scanstitch localize map.yaml drive.log --out where
  scanstitch localize floor.png scans/ --resolution 0.05
`,
  run,
};

async function run(engine: Engine, args: string[]) {
  const { values, positionals } = readArguments('localize', { args, options: OPTIONS, allowPositionals: true });
  const [map, ...inputs] = positionals;
  if (map === undefined || inputs.length === 0) {
    throw new CommandError('Name a map and a recording. See: scanstitch localize --help');
  }
  const complaints = new Complaints();
  const { complain } = complaints;
  const grid = readMap(engine, map, values.resolution);
  const { recording, close } = await openInputs(inputs, complain, { isTable: values.table !== undefined });
  try {
    if (recording.kind !== 'planar_scans') {
      throw new CommandError('The recording has no planar scans, so nothing was computed.');
    }
    tellNotes(withoutNamed(recording, complain), complain);
    const settings = readSettings(planarCatalogue(engine), undefined, values.set ?? []);
    const reconstruction = new engine.Reconstruction(settings);
    await addScans(reconstruction, recording, values.table, complain);
    const setOdometry = reconstruction.set_odometry.bind(reconstruction);
    await addPoses(recording, recording.odometry, values.odometry, setOdometry, complain);
    const localization = reconstruction.localization(grid);
    if (await untilInterrupt((signal) => locateAll(localization, signal))) complain('Stopped before the last scan.');
    await report(localization, grid, values, complain);
  } finally {
    await close();
  }
  return complaints.exitCode;
}

export function readMap({ OccupancyGrid, map_image_name }: Engine, path: string, resolution: string | undefined) {
  const name = basename(path);
  const bytes = unpacked(name, readRequired({ name, path }));
  if (/\.ya?ml$/i.test(name)) {
    const image = map_image_name(name, bytes);
    const picture = readRequired({ name: basename(image), path: resolve(dirname(path), image) });
    return OccupancyGrid.of_yaml(name, bytes, basename(image), picture);
  }
  if (/\.dat(\.gz)?$/i.test(name)) return OccupancyGrid.of_probabilities(name, bytes);
  if (resolution !== undefined) return OccupancyGrid.of_picture(name, bytes, Number(resolution));
  throw new CommandError(`${name}: a picture needs --resolution, the side of a pixel in metres`);
}

function unpacked(name: string, bytes: Uint8Array) {
  if (!(bytes[0] === 0x1f && bytes[1] === 0x8b)) return bytes;
  try {
    return new Uint8Array(gunzipSync(bytes, { maxOutputLength: MAX_UNPACKED }));
  } catch {
    throw new CommandError(`${name}: the packed file is damaged or too large`);
  }
}

/** Whether it was stopped before the end. */
async function locateAll(localization: Localization, signal: AbortSignal) {
  const progress = progressLine(localization.num_scans(), 'scans');
  let isDone = false;
  for (; !isDone && !signal.aborted; await nextTurn()) {
    isDone = !localization.step();
    progress.show(localization.num_located());
  }
  progress.clear();
  return !isDone;
}

async function report(
  localization: Localization,
  grid: OccupancyGrid,
  { out, json }: { out: string; json: boolean },
  complain: (problem: string) => void,
) {
  const result = localization.result();
  const { width, height, rgb } = localizationPixels(grid, localization);
  const reportJson = `${JSON.stringify(result, null, 2)}\n`;
  await writeResults(out, {
    'trajectory.tum': localization.trajectory_tum(),
    'report.json': reportJson,
    'localization.png': png(width, height, rgb),
  });
  result.notes.forEach((text) => note(text));
  const unplaced = result.scans.filter(({ status }) => status !== 'good').length;
  if (unplaced > 0) complain(`${unplaced} of ${result.scans.length} scans have no certain place.`);
  print(json ? reportJson : `${placeTable(result)}\n${result.summary}\nWritten to ${printable(out)}\n`);
}

/** A line for each stretch of scans that have one status for one reason. */
function placeTable({ scans }: LocalizationResult) {
  const rows: string[][] = [];
  let first = 0;
  scans.forEach((scan, index) => {
    const next = scans[index + 1];
    const kind = ({ status, rivals }: typeof scan) => `${status} ${status === 'good' ? '' : rivals.length}`;
    if (next && kind(next) === kind(scan)) return;
    const pose = scan.place?.T_world_sensor;
    const position = pose ? `(${pose.x.toFixed(2)}, ${pose.y.toFixed(2)})` : '';
    const range = first === index ? String(index) : `${first} to ${index}`;
    rows.push([range, scan.status, position, pose ? String(scan.rivals.length) : '', scan.reason]);
    first = index + 1;
  });
  return table(['scans', 'place', 'last at (m)', 'rivals', ''], rows, new Set([0, 1, 4]));
}
