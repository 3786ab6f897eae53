/** `scanstitch bev`: pixels of a top view, found in a front view by way of the ground. */
import { basename } from 'node:path';
import type { BevParameter, BevPoint, BevRefinement, BevRole, BevScene, WholePixels } from '../../pkg/scanstitch.js';
import { type Command, CommandError, type Engine, EXIT, oneOf, optionsOf, readArguments } from './command.js';
import { readPiped, writeWhole } from './disk.js';
import { readRequired } from './inputs.js';
import { note, print } from './terminal.js';

const ROLES = ['top', 'front'] as const;
const PARAMETERS = ['pitch', 'height', 'offset', 'ground'] as const;
const REFINED = 'pitch,height,offset';

const OPTIONS = {
  ...optionsOf({ texts: 'scene preset points pairs out', flags: 'truncate round polygon json' }),
  from: { type: 'string', default: 'top' },
  refine: { type: 'string', default: REFINED },
  camera: { type: 'string', default: 'front' },
} as const;

export const bev: Command = {
  name: 'bev',
  about: 'pixels of a top view projected into a front view by way of the ground',
  help: (engine) => `scanstitch bev --scene SCENE.json --points POINTS.csv [OPTION]...

Projects each pixel to the ground, and that point to the pixel of the other camera. Both cameras are pinholes; pixel
(0, 0) is the centre of the upper left pixel.

The points: one per line, u and v separated by commas or spaces; the first line may name the columns (u, v).
The scene: the two cameras and the ground, in metres and radians, for example

  { "axes": "three_js", "plane": { "kind": "level", "height": 0 },
    "top": { "width": 512, "height": 512,
      "intrinsics": { "kind": "field_of_view", "field_of_view": 1.5707963267948966, "side": "horizontal" },
      "pose": { "kind": "euler", "position": [0, 2.5, 0], "order": "XYZ", "angles": [-1.5707963267948966, 0, 0] } },
    "front": { ... } }

  axes        three_js | opencv | habitat | robotics | ros_optical
  plane       level: height; or tilted: normal, offset (normal . X = offset)
  intrinsics  field_of_view: field_of_view, side (horizontal | vertical); or focal: fx, fy, cx, cy
  pose        euler: position, order (XYZ is R = Rx Ry Rz), angles about x, y, z; or quaternion: position, qx, qy, qz,
              qw; or matrix: T_world_camera, four rows

Options:
  --scene FILE         the scene; without it, a preset
  --preset NAME        ${engine
    .bev_presets()
    .map(({ name }) => name)
    .join(' | ')} (default: the first)
  --points FILE        the pixels; - reads them from stdin
  --from VIEW          the view in which they are marked: top | front (default: top)
  --truncate           projected pixels truncated to whole numbers
  --round              projected pixels rounded
  --polygon            the points are the corners of a region: with --json, also the part of it that the other view
                       shows, clipped before it is projected
  --pairs FILE         points marked in both views, top_u top_v front_u front_v per line: adjusts a camera until the
                       projections fall on the marks, and uses the refined scene
  --refine LIST        refined parameters: ${PARAMETERS.join(',')} (default: ${REFINED}); ground is the
                       height of the ground itself
  --camera VIEW        the camera that is refined: top | front (default: front)

Output:
  --json               points, scene, homography and refinement as JSON; otherwise the points as CSV:
                       number,top_u,top_v,x,y,z,front_u,front_v,status
  --out FILE           into a file: JSON where its name ends so, CSV otherwise

Examples:
  scanstitch bev --scene scene.json --points points.csv --truncate
  echo "239,141" | scanstitch bev --preset homework_numbers --points - --truncate
  scanstitch bev --scene scene.json --pairs pairs.csv --refine pitch,height --json
`,
  run,
};

async function run(engine: Engine, args: string[]) {
  const { values } = readArguments('bev', { args, options: OPTIONS });
  if (values.points === undefined && values.pairs === undefined) {
    throw new CommandError('Name the points to project: --points FILE. See: scanstitch bev --help');
  }
  if (values.truncate && values.round) throw new CommandError('Choose --truncate or --round, not both.');
  const from = oneOf('from', values.from, ROLES);
  const camera = oneOf('camera', values.camera, ROLES);
  const parameters = values.refine.split(',').map((word) => oneOf('refine', word.trim(), PARAMETERS));
  const whole: WholePixels = values.truncate ? 'truncated' : values.round ? 'rounded' : 'exact';
  const given = sceneOf(engine, values.scene, values.preset);
  const refinement = values.pairs === undefined ? null : refined(engine, given, values.pairs, { camera, parameters });
  const projection = { scene: refinement?.scene ?? given, refinement, from, whole, withPolygon: values.polygon };
  const marked =
    values.points === undefined
      ? new Float64Array()
      : engine.read_bev_points(contents(values.points), basename(values.points), from);
  const { report, csv } = projected(engine, marked, projection);
  const isJson = values.json || /\.json$/i.test(values.out ?? '');
  await write(values.out, isJson ? `${JSON.stringify(report, null, 2)}\n` : csv);
  tellHidden(report.points, from);
  return EXIT.done;
}

/** The scene refined by the pairs of a file; what changed is told. */
function refined(
  engine: Engine,
  scene: BevScene,
  path: string,
  options: { camera: BevRole; parameters: BevParameter[] },
): BevRefinement {
  const pairs = engine.read_bev_pairs(contents(path), basename(path));
  const refinement = engine.bev_refine(scene, pairs, options);
  note(toldRefinement(refinement, options.camera));
  return refinement;
}

/** The points in both views, as a report and as a table. */
function projected(
  engine: Engine,
  marked: Float64Array,
  {
    scene,
    refinement,
    from,
    whole,
    withPolygon,
  }: { scene: BevScene; refinement: BevRefinement | null; from: BevRole; whole: WholePixels; withPolygon: boolean },
) {
  const view = new engine.BirdsEyeView(scene);
  try {
    const report = {
      version: engine.version(),
      scene,
      from,
      whole_pixels: whole,
      homography: rows(view.homography(from)),
      points: view.points(marked, from, whole),
      ...(withPolygon && { polygon: view.polygon(marked, from) }),
      ...(refinement && { refinement: { ...refinement, scene: undefined } }),
    };
    return { report, csv: view.points_csv(marked, from, whole) };
  } finally {
    view.free();
  }
}

function sceneOf(engine: Engine, path: string | undefined, preset: string | undefined): BevScene {
  if (path !== undefined && preset !== undefined) throw new CommandError('Choose --scene or --preset, not both.');
  if (path !== undefined) return engine.read_bev_scene(contents(path), basename(path));
  const presets = engine.bev_presets();
  const chosen = preset === undefined ? presets[0] : presets.find(({ name }) => name === preset);
  if (chosen) return chosen.scene;
  const known = presets.map(({ name }) => name).join(', ');
  throw new CommandError(`There is no preset ${JSON.stringify(preset)}. There are: ${known}.`);
}

/** Bytes of a file, or of stdin. */
function contents(path: string) {
  if (path === '-') return readPiped();
  return readRequired({ name: path, path });
}

/** Nine numbers as three rows. */
function rows(matrix: Float64Array) {
  return [0, 3, 6].map((start) => [...matrix.subarray(start, start + 3)]);
}

async function write(path: string | undefined, text: string) {
  if (path === undefined) print(text);
  else await writeWhole(path, text);
}

/** Points without a place in the other image are results like others, and are reported. */
function tellHidden(points: BevPoint[], from: BevRole) {
  const other = from === 'top' ? 'front' : 'top';
  const words = {
    outside_image: `outside the image of the ${other} view`,
    behind_camera: `behind the ${other} camera`,
    no_ground: `at or above the horizon of the ${from} view, where no ground is seen`,
  };
  for (const [status, where] of Object.entries(words)) {
    const numbers = points.flatMap((point, index) => (point.status === status ? [index + 1] : []));
    const listed = numbers.length > 10 ? `${numbers.slice(0, 10).join(', ')}, ...` : numbers.join(', ');
    if (numbers.length > 0) note(`${numbers.length} of ${points.length} ${where}: ${listed}`);
  }
}

function toldRefinement(
  { pitch, height, right, ahead, ground, rmse_before, rmse, residuals, converged }: BevRefinement,
  camera: BevRole,
) {
  const degrees = ((pitch * 180) / Math.PI).toFixed(3);
  const metres = (value: number) => `${value.toFixed(4)} m`;
  const moved = `turned up by ${degrees} degrees, raised by ${metres(height)}, to the right by ${metres(right)}, ahead by ${metres(ahead)}${ground === 0 ? '' : `, the ground raised by ${metres(ground)}`}`;
  const fit = `${residuals.length} pairs, rmse ${rmse_before.toFixed(3)} before, ${rmse.toFixed(3)} pixels after`;
  return `${camera} camera ${moved}; ${fit}${converged ? '' : ' (not converged)'}`;
}
