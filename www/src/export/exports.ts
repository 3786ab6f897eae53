/** Makes the files to download of a run of planar scans. */
import type { Answers } from '../engine/protocol.js';
import { Remote } from '../engine/remote.js';
import { startWorker } from '../engine/start.js';
import type { reportHtml } from '../../../package/report/report.js';
import type { ZipApi } from './zip-worker.js';
import type { Download, ExportItem } from './download.js';
import zipUrl from './zip-worker.ts?worker&url';

/** Where the contents come from: the engine, and the canvas. */
export interface Sources {
  ask<K extends Exclude<keyof Answers, 'correspondences'>>(kind: K): Promise<Answers[K]>;
  picture(): Promise<Blob>;
  frameNames: readonly string[];
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
    case 'picture':
      return { name: 'map.png', blob: await sources.picture() };
    case 'report':
      return { name: 'report.html', blob: await reportOf(sources) };
    case 'everything':
      return { name: 'scanstitch.zip', blob: await zip(await allFiles(sources)) };
  }
}

type Files = Record<string, Uint8Array>;

async function allFiles(sources: Sources): Promise<Files> {
  return {
    'trajectory.tum': utf8(await sources.ask('trajectory_tum')),
    ...(await matricesOf(sources)),
    'map.ply': await plyBytes(sources),
    ...bytesOf(await sources.ask('gridFiles')),
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
