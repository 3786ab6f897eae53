/** What can be exported. */
import type { MenuItem } from '../components/menu.js';
import type { BevDocument } from './document.js';
import type { Projection } from './protocol.js';

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
