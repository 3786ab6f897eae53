/** What both kinds of reconstruction share: offering files to the engine, writing what came of them. */
import { basename } from 'node:path';
import type { ReconstructionResult, SpatialReconstruction, SpatialResult } from '../../pkg/scanstitch.js';
import { lookUp } from '../base/look_up.js';
import type { OpenedRecording } from '../recording_reader.js';
import { reportHtml } from '../report/report.js';
import type { StepsFile } from '../report/steps_file.js';
import { CommandError, type Engine, isScanstitchError } from './command.js';
import type { GridOptions } from './floor_grid.js';
import type { MeshOptions } from './mesh_options.js';

/** What a reconstruction is given. */
export interface Task {
  engine: Engine;
  recording: OpenedRecording;
  options: Options;
  /** Reports what is left out, which makes the exit code 2. */
  complain: (problem: string) => void;
  /** All that was complained of so far. */
  problems?: readonly string[];
}

export interface Options {
  out: string;
  reference: string | undefined;
  /** Of planar scans. */
  odometry: string | undefined;
  /** By which the map of planar scans is mended, with the name of their file. */
  steps?: (StepsFile & { name: string }) | undefined;
  /** What the columns of tables of ranges are. */
  table?: string | undefined;
  intrinsics: string | undefined;
  preset: string | undefined;
  set: string[];
  workers: number;
  /** Of the map; binary PLY without. */
  mapFormat?: MapFormat | undefined;
  /** What else is written of planar scans: the graph, the map as MCAP, and a file that opens as the map is. */
  g2o?: boolean | undefined;
  mcap?: boolean | undefined;
  workbench?: boolean | undefined;
  /** Of depth images. */
  mesh?: MeshOptions | undefined;
  /** Of depth images or clouds. */
  grid?: GridOptions | undefined;
  /** Folder for trainers of splats. */
  splats?: string | undefined;
}

type MapFormat = Parameters<SpatialReconstruction['map_file']>[0];

/** Formats of a map, as the command line calls them. */
const MAP_FORMATS: Readonly<Record<string, MapFormat>> = Object.freeze({
  ply: 'ply',
  'ply-ascii': 'ply_ascii',
  pcd: 'pcd',
  'pcd-ascii': 'pcd_ascii',
  'pcd-compressed': 'pcd_binary_compressed',
});

export function readMapFormat(name: string | undefined): MapFormat | undefined {
  if (name === undefined) return undefined;
  const known = lookUp(MAP_FORMATS, name);
  if (known) return known;
  throw new CommandError(`--map-format ${name}: it is one of ${Object.keys(MAP_FORMATS).join(', ')}`);
}

/** The name of the map's file, and its bytes. */
export function mapFile(
  reconstruction: { map_file: (format: MapFormat) => Uint8Array },
  { mapFormat = 'ply' }: Options,
) {
  const name = `map.${mapFormat.slice(0, 3)}`;
  return { name, bytes: reconstruction.map_file(mapFormat) };
}

/** Whether the engine took it; other faults are reported. */
export function accepted(offer: () => void, complain: (problem: string) => void) {
  try {
    offer();
    return true;
  } catch (error) {
    if (!isScanstitchError(error)) throw error;
    complain(error.message);
    return false;
  }
}

export function millimetres(metres: number) {
  return (1000 * metres).toFixed(1);
}

/** An error's figures; `format` writes a length with its unit. */
export function errorFigures(
  { mean, rmse, max }: { mean: number; rmse: number; max: number },
  format: (metres: number) => string,
) {
  return `mean ${format(mean)}, rmse ${format(rmse)}, max ${format(max)}`;
}

/**
 * The report to be read and printed.
 * @param points of the map
 */
export function reportFile(
  result: ReconstructionResult | SpatialResult,
  points: Float32Array,
  { recording, options, problems = [] }: Task,
) {
  const { scans, clouds, depth_frames, reference, odometry, intrinsics } = recording;
  const images = depth_frames.flatMap(({ depth, color }) => [depth, color]);
  const beside = [options.reference ?? reference, options.odometry ?? odometry, options.intrinsics ?? intrinsics];
  const opened = [...scans, ...clouds, ...images, ...beside.flat()].filter((path) => path !== null);
  const num_frames = depth_frames.length + clouds.length;
  const title = basename(recording.root) || basename(opened[0] ?? '') || 'Recording';
  return { 'report.html': reportHtml(result, { title, opened, losses: problems, points, num_frames }) };
}
