/** `scanstitch edit`: the map of planar scans, mended by the steps that a file keeps. */
import { basename } from 'node:path';
import { printable } from '../base/printable.js';
import { readSteps, type StepsFile } from '../report/steps_file.js';
import { type Command, CommandError, type Engine, optionsOf, readArguments } from './command.js';
import { writeResults } from './disk.js';
import { openInputs, readText } from './inputs.js';
import { readMap } from './localize.js';
import { withoutNamed } from './reconstruct.js';
import { reconstructPlanar, tellUntaken } from './reconstruct_planar.js';
import { readMapFormat } from './results.js';
import { Complaints, print, tellNotes } from './terminal.js';

const OPTIONS = {
  ...optionsOf({ texts: 'reference odometry table map-format', lists: 'set', flags: 'g2o mcap workbench' }),
  out: { type: 'string', default: 'scanstitch-out' },
} as const;

/** A map of ROS's map_server. */
const IS_MAP = /\.ya?ml$/i;

type Named = StepsFile & { name: string };

export const edit: Command = {
  name: 'edit',
  about: 'a map of planar scans, mended by the steps that a file keeps',
  help: () => `scanstitch edit RECORDING... STEPS [OPTION]...
scanstitch edit MAP STEPS [OPTION]...

Reconstructs planar scans as scanstitch reconstruct does, with the settings that the file of steps keeps, and mends
the map by its steps: the results are those that the page exports, byte by byte. The page saves such a file; it can be
written by hand as well:
  {
   "scanstitch_steps": 1, "num_scans": 395, "settings": {},
   "steps": [
    { "action": "remove_loop", "target": 24, "source": 215 },
    { "action": "add_loop", "target": 8, "source": 394, "T_target_source": { "x": 0.2, "y": 0, "theta": 3.1 } }
   ]
  }
target and source are scans, counted from 0, and stand for the places where they were taken. T_target_source is where
the source is in the frame of the target (m, rad), as far as the eye can tell: it is registered within 1 m and 0.3 rad.
A step that the scans or the graph contradict is not taken, and stderr says why. "unchecked": true puts a loop in as it
is given, without any test; all poses are doubtful then. A loop that is put in and taken out again leaves no trace.

Further steps edit the map that the loops have made, and its grid, in their order; points are x and y in metres:
    { "action": "paint_line", "cells": "occupied", "ends": [[1, 2], [4, 2]], "width": 0.1 }
    { "action": "paint_rectangle", "cells": "free", "corners": [[0, 0], [2, 1]] }
    { "action": "paint_polygon", "cells": "unknown", "corners": [[0, 0], [2, 0], [1, 2]] }
    { "action": "crop", "corners": [[-5, -5], [20, 12]] }
    { "action": "rotate" }                  to the walls; "angle": 0.3 (rad) turns by that, counter-clockwise
    { "action": "anchor", "pairs": [{ "map": [0, 0], "world": [120, 45] }, { "map": [9, 2], "world": [129, 47] }] }
                                            onto known coordinates; "accuracy": 0.02 (m, standard deviation)
    { "action": "lay_plan", "picture": "plan.png", "points": [{ "picture": [120, 40], "map": [0, 0] }, ...] }
                                            a building plan behind the map, by three points or more: pixels right
                                            and down from the upper left corner; "accuracy": 0.1 (m)
    { "action": "remove_plan" }             takes it off
    { "action": "leave_out", "first": 10, "last": 19 }
Poses, points and grid move together; a turn is about the map's origin. Painted and cropped is the grid of the main
piece.

Of a MAP without its scans, map.yaml beside its picture, the grid alone is painted and cropped.

Options:
  --out DIR          folder of the results, created if missing (default: ${OPTIONS.out.default})
  --reference FILE, --odometry FILE, --table FORMAT, --map-format NAME, --g2o, --mcap, --workbench
                     as in scanstitch reconstruct
  --set NAME=VALUE   one setting in place of that of the file; may be repeated

Written into DIR: what scanstitch reconstruct writes; where a plan is laid whose picture the file keeps, plan.png or
plan.jpg with its world file; of a MAP, map.pgm and map.yaml.

Examples:
  scanstitch edit drive.log drive.steps.json --out mended
  scanstitch edit map.yaml walls.steps.json --out mended
`,
  run,
};

async function run(engine: Engine, args: string[]) {
  const { values, positionals } = readArguments('edit', { args, options: OPTIONS, allowPositionals: true });
  const [path, inputs] = [positionals.at(-1), positionals.slice(0, -1)];
  if (path === undefined || inputs.length === 0) {
    throw new CommandError('Name a recording and a file of steps. See: scanstitch edit --help');
  }
  const steps = { name: basename(path), ...readText(path, readSteps) };
  const { out, reference, odometry, table, g2o, mcap, workbench, set = [] } = values;
  const mapFormat = readMapFormat(values['map-format']);
  const given = { out, reference, odometry, table, set, mapFormat, g2o, mcap, workbench };
  const options = { ...given, steps, intrinsics: undefined, preset: undefined, workers: 0 };
  const complaints = new Complaints();
  const { complain, problems } = complaints;
  const [map, ...others] = inputs;
  if (map !== undefined && others.length === 0 && IS_MAP.test(map)) {
    for (const name of Object.keys(values).filter((name) => name !== 'out')) {
      complain(`--${name}: not used, for a map is edited without its scans.`);
    }
    await editGrid(engine, map, steps, out, complain);
    return complaints.exitCode;
  }
  const { recording, close } = await openInputs(inputs, complain, { isTable: table !== undefined });
  try {
    if (recording.kind !== 'planar_scans')
      throw new CommandError('The recording has no planar scans, so nothing was computed.');
    tellNotes(withoutNamed(recording, complain), complain);
    await reconstructPlanar({ engine, recording, options, complain, problems });
  } finally {
    await close();
  }
  return complaints.exitCode;
}

/** Paints and crops a grid without its scans. */
async function editGrid(engine: Engine, path: string, steps: Named, out: string, complain: Complaints['complain']) {
  const grid = readMap(engine, path, undefined);
  tellUntaken(grid.edit(steps.steps), steps.name, complain);
  await writeResults(out, { 'map.pgm': grid.pgm(), 'map.yaml': grid.yaml('map.pgm') });
  print(`${grid.width} x ${grid.height} cells of ${grid.resolution} m\nWritten to ${printable(out)}\n`);
}
