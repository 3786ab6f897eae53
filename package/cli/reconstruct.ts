/** `scanstitch reconstruct`: planar scans, depth images or clouds to a trajectory, a map and a report. */
import { availableParallelism } from 'node:os';
import { printable } from '../base/printable.js';
import type { Recording } from '../files/recording.js';
import { GRID_BAND } from '../mesh/floor_grid.js';
import { isListName } from '../recording/lists.js';
import type { OpenedRecording } from '../recording_reader.js';
import { type Command, CommandError, type Engine, optionsOf, readArguments } from './command.js';
import { readGridOptions } from './floor_grid.js';
import { openInputs } from './inputs.js';
import { readMeshOptions } from './mesh_options.js';
import { type Options, readMapFormat } from './results.js';
import { settingsHelp } from './settings.js';
import { Complaints, tellNotes } from './terminal.js';
import { readWishes } from './wishes.js';

const OPTIONS = {
  ...optionsOf({
    texts:
      'reference odometry intrinsics recording table preset workers map-format mesh mesh-voxel mesh-triangles fill-holes grid band splats',
    lists: 'topic set',
    flags: 'g2o mcap workbench',
  }),
  out: { type: 'string', default: 'scanstitch-out' },
} as const;

export const reconstruct: Command = {
  name: 'reconstruct',
  about: 'scans, depth images or clouds to a trajectory and a stitched map',
  help: (engine) => `scanstitch reconstruct FILES-OR-FOLDER-OR-ZIP-OR-BAG... [OPTION]...

Registers the frames of a recording and maps them in the frame of the first one. Its kind is recognized from its files:
  planar scans   PLY files, z = 0, in metres; or a laser log with many scans: CARMEN (FLASER, ROBOTLASER1), CSM's JSON,
                 rostopic echo -p, CMU 16-831, BreezySLAM, tables of ranges, MATLAB's .mat
  depth images   PNG (8 or 16 bits) or PGM, with colour pictures (PNG, JPEG) of the same numbers or times, or without:
                 rgb/ and depth/ folders, names such as frame-000001.depth.png, the layout of TUM RGB-D
  clouds         PLY, PCD, KITTI's .bin, LAS, LAZ, E57 or text (.xyz, .pts, .ptx) in space; their unit is told from
                 the file or from the first cloud
  ROS bags       .bag, .db3 or .mcap with Image, CompressedImage, CameraInfo, PointCloud2, LaserScan, Odometry,
                 PoseStamped, Path and TFMessage; for the topics that are used see: scanstitch topics BAG
Files are taken in natural order of their names: 2.ply comes before 10.ply. The reference (GT_pose.npy, *.tum, *.log,
groundtruth.txt, a pose file for each frame, ...) and the camera (camera-intrinsics.txt, camera.yaml, ...) of depth
images are found beside them; of planar scans a *.tum file, and odometry named so.

Options:
  --out DIR          folder of the results, created if missing (default: ${OPTIONS.out.default})
  --reference FILE   trajectory to compare with, or a folder with a file for each frame; never used for the estimate
  --odometry FILE    odometry of the robot, an initial guess for planar scans: rows of id x y theta, TUM, or the paths
                     of two wheels (columns named left and right) with --set wheel_track=METRES;
                     what contradicts the scans (other units, clock or log) is reported and not used
  --table FORMAT     what the columns of a table of ranges are, counted from 1; what it does not say is guessed:
                     ranges=2:541,unit=mm,start=-135deg,step=0.5deg,time=1:us,odometry=542:543:544 (x y heading);
                     range=2,angle=1:deg where each line has one reading; poses and reference as odometry;
                     wheels=LEFT:RIGHT:METRES_A_TICK:TRACK; ahead=0.2 (m)
  --intrinsics FILE  the depth camera: a 3 x 3 matrix or fx fy cx cy in pixels, or what OpenCV, ROS (camera_info),
                     Open3D, RealSense, Kalibr, ORB-SLAM, ScanNet, BOP, nerfstudio or Azure Kinect write
  --recording DIR    which recording to use, where a folder or archive holds several (default: the longest)
  --topic ROLE=NAME  a topic of a bag to use as depth, color, camera, clouds, scans, imu, odometry or reference;
                     none: do without
  --map-format NAME  of the map: ply (default) or pcd, both binary; ply-ascii, pcd-ascii; pcd-compressed
  --g2o              of planar scans: graph.g2o as well, the keyframes and the motions between them with their
                     information matrices, for GTSAM, g2o and scanstitch optimize
  --mcap             of planar scans: map.mcap as well, for Foxglove and rviz: grid, scans, poses and path
  --workbench        of planar scans: workbench.zip as well, with the scans, the settings and the steps of the map,
                     which opens again as it is
  --mesh FILE        of depth images or clouds: a surface of triangles, .ply, .obj, .glb, or .stl in millimetres;
                     .ply has the standard deviation of each vertex (m) as deviation
  --mesh-voxel SIZE  side of its voxels (m; default: 0.02; clouds: by their density)
  --mesh-triangles N
                     fewer triangles: N at most
  --fill-holes SIZE  fill its holes up to this extent (m), or auto: ten voxels; what was seen to be empty stays open,
                     and .ply marks the vertices of the filling as filled
  --grid FILE.yaml   of depth images or clouds: what is free and what is occupied on the floor, as map_server of ROS
                     reads it, with its picture beside it as .pgm; the floor is where most points below the sensor are
  --band LOW:HIGH    heights over the floor that --grid shows (m; default: ${GRID_BAND.join(':')}); what stands there is
                     occupied, and free is where the floor was seen or rays passed close over it
  --splats FOLDER    of depth images with colours: images, poses and points as nerfstudio (transforms.json) and COLMAP
                     (sparse/0) have them, for trainers of Gaussian splats
  --workers N        threads that prepare frames in advance; 0: none (default: one a core, 0 with one core)
  --preset NAME      settings for one purpose, see below (default: ${engine.presets()[0]?.name}, or ${engine.spatial_presets()[0]?.name})
  --set NAME=VALUE   one setting, see below; may be repeated. Angles are radians, or degrees as 35deg

Written into DIR:
  trajectory.tum     a line a frame: time, or index without, x y z qx qy qz qw, the pose of the sensor in the world
  map.ply or .pcd    the points of all frames in the world; of depth images with their colours
  map.pgm, map.yaml  of planar scans: what is free and what is occupied, as ROS's map_server reads it; of a map in
                     pieces that are not connected the main one, and map_piece_N.pgm and .yaml for each other
  report.json        settings, version, results of every frame, comparison, in metres and radians
  report.html        the same to be read and printed, with the map and the path drawn

Printed: a line a frame (of more than 200 planar scans, those that are not good), and the figures of the whole.
Of planar scans, sharpness is the mean distance of returns within 29 m to the surface that the other scans saw there. A
file that cannot be used is named on stderr and left out, as are files and options that were given and are not used.
Only regular files are read, no pipes. Files are written whole or not at all. Ctrl-C and SIGTERM stop; what has been
computed is written.

Examples:
  scanstitch reconstruct scans/ --reference reference.tum --set max_range=30 --out result
  scanstitch reconstruct drive.log --odometry wheels.txt --out result
  scanstitch reconstruct first_floor.zip --preset course --workers 4
  scanstitch reconstruct walk.mcap --topic depth=/camera/depth/image_raw --topic reference=none

${settingsHelp(engine)}`,
  run,
};

async function run(engine: Engine, args: string[]) {
  const { values, positionals } = readArguments('reconstruct', { args, options: OPTIONS, allowPositionals: true });
  if (positionals.length === 0) {
    throw new CommandError(
      'No input was given: name files, a folder, a ZIP archive or a bag. See: scanstitch reconstruct --help',
    );
  }
  const { out, reference, odometry, intrinsics, table, preset, g2o, mcap, workbench, splats, set = [] } = values;
  const [workers, mapFormat] = [readWorkers(values.workers), readMapFormat(values['map-format'])];
  const mesh = readMeshOptions(values.mesh, values['mesh-voxel'], values['mesh-triangles'], values['fill-holes']);
  const grid = readGridOptions(values.grid, values.band);
  const also = { g2o, mcap, workbench, splats, grid };
  const options = { out, reference, odometry, intrinsics, table, preset, set, workers, mapFormat, mesh, ...also };
  const complaints = new Complaints();
  const { complain, problems } = complaints;
  const { recording, close } = await openInputs(positionals, complain, {
    ...wishesOf(values),
    isTable: table !== undefined,
  });
  try {
    const task = { engine, recording, options, complain, problems };
    if (recording.kind !== 'nothing') {
      tellNotes(withoutNamed(recording, complain), complain);
      complainOfOptions(recording, options, complain);
    }
    if (recording.kind === 'planar_scans') await (await import('./reconstruct_planar.js')).reconstructPlanar(task);
    else if (recording.kind !== 'nothing') await (await import('./reconstruct_spatial.js')).reconstructSpatial(task);
    else {
      for (const { file, reason } of recording.notes) complain(`${file}: ${reason}.`);
      throw new CommandError('Neither scans nor depth images nor clouds were found, so nothing was computed.');
    }
  } finally {
    await close();
  }
  return complaints.exitCode;
}

/** Which of several recordings, and which topics of a bag. */
export function wishesOf({ recording, topic }: { recording?: string | undefined; topic?: string[] | undefined }) {
  return { topics: readWishes(topic), ...(recording !== undefined && { folder: recording }) };
}

export function readWorkers(text: string | undefined) {
  // A thread of its own on the only core takes more time than it saves.
  if (text === undefined) return availableParallelism() > 1 ? availableParallelism() : 0;
  if (!/^\d{1,3}$/.test(text)) throw new CommandError(`--workers ${text}: this is a number of threads, such as 4`);
  return Number(text);
}

/** So many files are named in full. */
const MOST_NAMED = 5;

/** The notes without those about files that were named one by one and are not used: these are complained of. */
export function withoutNamed({ notes, files, ...recording }: OpenedRecording, complain: (problem: string) => void) {
  const { depth_frames, clouds, scans, reference, odometry, intrinsics } = recording;
  const images = depth_frames.flatMap(({ depth, color }) => [depth, color]);
  const used = new Set([...images, ...clouds, ...scans, ...reference, odometry, intrinsics]);
  const unused = [...files.values()].filter(({ path, isNamed }) => isNamed && !used.has(path) && !isListName(path));
  const reasons = new Map(notes.map(({ file, reason }) => [file, reason]));
  const [told, untold] = [
    unused.filter(({ path }) => reasons.has(path)),
    unused.filter(({ path }) => !reasons.has(path)),
  ];
  for (const { path } of told) complain(`${printable(path)}: ${reasons.get(path)}.`);
  for (const { path } of untold.slice(0, MOST_NAMED)) complain(`${printable(path)}: This file is not used.`);
  if (untold.length > MOST_NAMED) complain(`${untold.length - MOST_NAMED} more files that were named are not used.`);
  const toldPaths = new Set(told.map(({ path }) => path));
  return notes.filter(({ file }) => !toldPaths.has(file));
}

/** Options that say nothing to recordings of this kind. */
function complainOfOptions(
  { kind }: Recording,
  { intrinsics, odometry, mesh, grid, splats, g2o, mcap, workbench }: Options,
  complain: (problem: string) => void,
) {
  const what = kind === 'planar_scans' ? 'planar scans' : kind === 'clouds' ? 'clouds' : 'depth images';
  if (intrinsics !== undefined && kind !== 'depth_images') {
    complain(`--intrinsics ${intrinsics}: not used, for ${what} have no camera.`);
  }
  if (mesh !== undefined && kind === 'planar_scans') {
    complain(
      `--mesh ${mesh.path}: not used, for planar scans have no surface; scanstitch export writes the walls of their map.`,
    );
  }
  if (grid !== undefined && kind === 'planar_scans') {
    complain(`--grid ${grid.path}: not used, for the grid of planar scans is map.pgm and map.yaml.`);
  }
  if (splats !== undefined && kind !== 'depth_images') {
    complain(`--splats ${splats}: not used, for ${what} have no pictures.`);
  }
  for (const [name, isGiven] of Object.entries({ g2o, mcap, workbench })) {
    if (isGiven && kind !== 'planar_scans') complain(`--${name}: not used, for it is written of planar scans alone.`);
  }
  if (odometry !== undefined && kind !== 'planar_scans') {
    complain(`--odometry ${odometry}: not used, for it is read for planar scans alone.`);
  }
}
