/** Makes the files to download of a run of planar scans. */
import type { Answers, Edit, InputFile, Inputs } from '../engine/protocol.js';
import { Remote } from '../engine/remote.js';
import { startWorker } from '../engine/start.js';
import type { Pictures } from '../../../package/files/recording.js';
import type { reportHtml } from '../../../package/report/report.js';
import type { WallFormat } from '../../../package/report/wall_mesh.js';
import type { ZipApi } from './zip-worker.js';
import type { Download, ExportItem } from './download.js';
import zipUrl from './zip-worker.ts?worker&url';

/** Where the contents come from: the engine, and the canvas. */
export interface Sources {
  ask<K extends Exclude<keyof Answers, 'correspondences'>>(kind: K): Promise<Answers[K]>;
  picture(): Promise<Blob>;
  frameNames: readonly string[];
  /** The points of the map, and where those of each frame end. */
  points: { points: Float32Array; offsets: Uint32Array };
  /** What is open, and how it was made into a map. */
  opened: {
    dataset: Inputs | null;
    settings: object | null;
    facts: { presets: readonly { settings: object }[] } | null;
    client: { steps: readonly Edit[] } | null;
    pictures: Pictures;
  };
  report: ReportSource;
}

/** What the report to be read is made of. */
export interface ReportSource {
  result: Parameters<typeof reportHtml>[0];
  context: Omit<Parameters<typeof reportHtml>[1], 'picture'>;
}

export async function makeExport(id: ExportItem['id'], sources: Sources): Promise<Download> {
  switch (id) {
    case 'trajectory':
      return { name: 'trajectory.tum', blob: textBlob(await sources.ask('trajectory_tum')) };
    case 'matrices':
      return { name: 'trajectory_matrices.zip', blob: await zip(await matricesOf(sources)) };
    case 'map':
      return { name: 'map.ply', blob: new Blob([await plyBytes(sources)]) };
    case 'grid':
      return { name: 'occupancy_grid.zip', blob: await zip(bytesOf(await sources.ask('gridFiles'))) };
    case 'geotiff':
      return { name: 'map.tif', blob: new Blob([await geoTiffOf(sources)]) };
    case 'walls_glb':
      return { name: 'walls.glb', blob: new Blob([await wallsOf(sources, 'glb')]) };
    case 'walls_stl':
      return { name: 'walls.stl', blob: new Blob([await wallsOf(sources, 'stl')]) };
    case 'mcap':
      return { name: 'map.mcap', blob: new Blob([await mcapOf(sources)]) };
    case 'workbench':
      return { name: 'workbench.zip', blob: await zip(await benchOf(sources)) };
    case 'picture':
      return { name: 'map.png', blob: await sources.picture() };
    case 'report':
      return { name: 'report.html', blob: await reportOf(sources) };
    case 'everything':
      return { name: 'scanstitch.zip', blob: await zip(await allFiles(sources)) };
  }
}

async function benchOf({
  opened: { dataset, settings, facts, client, pictures },
  frameNames,
}: Sources): Promise<Files> {
  const { workbenchFiles } = await import('../../../package/report/workbench.js');
  const file = ({ name, bytes }: InputFile) => ({ path: name, bytes: new Uint8Array(bytes) });
  const { scans = [], reference = null, odometry = null } = dataset ?? {};
  const table = scans.find((scan) => scan.table !== undefined)?.table;
  return workbenchFiles({
    num_scans: frameNames.length,
    settings: changedSettings(settings, facts?.presets[0]?.settings),
    steps: [...(client?.steps ?? [])],
    pictures,
    ...(table !== undefined && { table }),
    scans: scans.map((scan) => ({ ...file(scan), isLog: scan.isLog ?? false })),
    reference: reference && file(reference),
    odometry: odometry && file(odometry),
  });
}

/** The settings that are not those by default. */
export function changedSettings(settings: object | null, defaults: object = {}): Record<string, unknown> {
  const before = new Map(Object.entries(defaults));
  return Object.fromEntries(Object.entries(settings ?? {}).filter(([name, value]) => value !== before.get(name)));
}

/** The grid of the main piece, and its greys. */
async function gridOf({ ask }: Sources) {
  const { grey_values: greys, ...grid } = await ask('occupancy_grid');
  return { grid: { ...grid, origin: Float64Array.from(grid.origin), yaw: 0 }, greys: new Uint8Array(greys) };
}

async function geoTiffOf(sources: Sources): Promise<Uint8Array<ArrayBuffer>> {
  const { geoTiff } = await import('../../../package/report/geotiff.js');
  const { grid, greys } = await gridOf(sources);
  return geoTiff(grid, greys);
}

async function wallsOf(sources: Sources, format: WallFormat): Promise<Uint8Array<ArrayBuffer>> {
  const { WALL_HEIGHT, wallFile } = await import('../../../package/report/wall_mesh.js');
  const { grid, greys } = await gridOf(sources);
  return new Uint8Array(await wallFile({ ...grid, grey_values: () => greys }, WALL_HEIGHT.usual, format));
}

async function mcapOf({ ask, points: { points, offsets } }: Sources): Promise<Uint8Array<ArrayBuffer>> {
  const { mapMcap } = await import('../../../package/report/map_mcap.js');
  const sizes = offsets.slice(1).map((end, frame) => end - (offsets[frame] ?? 0));
  return mapMcap({ trajectory: await ask('trajectory_tum'), points, sizes, grid: await ask('occupancy_grid') });
}

type Files = Record<string, Uint8Array>;

async function allFiles(sources: Sources): Promise<Files> {
  const { planFiles } = await import('../../../package/report/plan_files.js');
  return {
    'trajectory.tum': utf8(await sources.ask('trajectory_tum')),
    ...(await matricesOf(sources)),
    'map.ply': await plyBytes(sources),
    ...bytesOf(await sources.ask('gridFiles')),
    ...bytesOf(planFiles(await sources.ask('plan'), sources.opened.pictures)),
    'map.png': new Uint8Array(await (await sources.picture()).arrayBuffer()),
    'report.json': utf8(await sources.ask('report_json')),
    'report.html': new Uint8Array(await (await reportOf(sources)).arrayBuffer()),
  };
}

/** The report to be read and printed, with the map as it is on the screen. */
export async function reportOf({ report, picture }: Pick<Sources, 'report' | 'picture'>): Promise<Blob> {
  const { reportHtml } = await import('../../../package/report/report.js');
  const html = reportHtml(report.result, { ...report.context, picture: await dataAddress(await picture()) });
  return new Blob([html], { type: 'text/html' });
}

function dataAddress(blob: Blob): Promise<string> {
  return new Promise((resolve, reject) => {
    const reader = new FileReader();
    reader.onload = () => resolve(String(reader.result));
    reader.onerror = () => reject(reader.error ?? new Error('The picture could not be read.'));
    reader.readAsDataURL(blob);
  });
}

async function matricesOf({ ask, frameNames }: Sources): Promise<Files> {
  return matrixFiles(await ask('trajectory_matrices'), frameNames);
}

function bytesOf(files: Record<string, Uint8Array | string>): Files {
  const bytes = (content: Uint8Array | string) => (typeof content === 'string' ? utf8(content) : content);
  return Object.fromEntries(Object.entries(files).map(([name, content]) => [name, bytes(content)]));
}

/** `matrices/0007_7.txt`: the number keeps the order, the name identifies the scan. */
export function matrixFiles(matrices: readonly string[], frameNames: readonly string[]): Files {
  return Object.fromEntries(
    matrices.map((matrix, frame) => {
      const stem = (frameNames[frame] ?? '').replace(/^.*\//, '').replace(/\.[^.]*$/, '');
      return [`matrices/${String(frame).padStart(4, '0')}_${stem}.txt`, utf8(matrix)];
    }),
  );
}

async function plyBytes({ ask }: Sources): Promise<Uint8Array<ArrayBuffer>> {
  return new Uint8Array(await ask('map_ply'));
}

export async function zip(files: Files): Promise<Blob> {
  const zipper = new Remote<ZipApi>(startWorker(zipUrl));
  try {
    return new Blob([new Uint8Array(await zipper.call('zip', files))], { type: 'application/zip' });
  } finally {
    zipper.end();
  }
}

export function textBlob(text: string): Blob {
  return new Blob([text], { type: 'text/plain' });
}

export function utf8(text: string): Uint8Array {
  return new TextEncoder().encode(text);
}
