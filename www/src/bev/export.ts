/** What can be exported. */
import type { MenuItem } from '../components/menu.js';
import type { Download } from '../export/download.js';
import { type BevDocument, flat, markedPixels } from './document.js';
import type { Projection } from './protocol.js';
import type { BevSession } from './session.js';

export const EXPORTS: readonly MenuItem[] = [
  { id: 'csv', label: 'Points', detail: 'CSV: top pixel, ground, front pixel' },
  { id: 'json', label: 'Everything', detail: 'JSON: scene, homography, points, region' },
  { id: 'scene', label: 'Scene', detail: 'scene.json, for the command line' },
  { id: 'top', label: 'Top view', detail: 'PNG with the marks' },
  { id: 'front', label: 'Front view', detail: 'PNG with the projections' },
  { id: 'link', label: 'Copy a link', detail: 'that opens the same scene and marks' },
];

/** Scene and points as JSON: the same fields that the command line writes. */
export function pointsJson(version: string, document: BevDocument, answer: Projection): string {
  const rows = [0, 3, 6].map((start) => answer.homography.slice(start, start + 3));
  const report = {
    version,
    scene: document.scene,
    from: 'top',
    whole_pixels: document.whole,
    homography: rows,
    points: answer.reported,
    ...(answer.region && { polygon: answer.region }),
    ...(document.pairs.length > 0 && { pairs: document.pairs }),
  };
  return `${JSON.stringify(report, null, 2)}\n`;
}

/** The file of an entry of `EXPORTS`; null while there is nothing to write. `picture`: of the view that is chosen. */
export async function exportFile(
  id: string,
  { answered, client, version }: BevSession,
  document: BevDocument,
  picture: { png(): Promise<Blob> } | null,
): Promise<Download | null> {
  const text = (name: string, content: string) => ({ name, blob: new Blob([content], { type: 'text/plain' }) });
  if (id === 'scene') return text('scene.json', `${JSON.stringify(document.scene, null, 2)}\n`);
  if (id === 'json') return answered && text('bev.json', pointsJson(version, answered.document, answered.answer));
  if (id !== 'csv') return picture && { name: `${id}_view.png`, blob: await picture.png() };
  if (!client) return null;
  const given = { scene: document.scene, marked: flat(markedPixels(document)), whole: document.whole };
  return text('points.csv', await client.call('points_csv', given));
}
