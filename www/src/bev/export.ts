/** What can be taken home. */
import type { MenuItem } from '../components/menu.js';
import type { BevDocument } from './document.js';
import type { Answer } from './protocol.js';

export const EXPORTS: readonly MenuItem[] = [
  { id: 'csv', label: 'Points', detail: 'CSV: top pixel, ground, front pixel' },
  { id: 'json', label: 'Everything', detail: 'JSON: scene, homography, points, region' },
  { id: 'scene', label: 'Scene', detail: 'scene.json, for the command line' },
  { id: 'top', label: 'Top view', detail: 'PNG with the marks' },
  { id: 'front', label: 'Front view', detail: 'PNG with the projections' },
  { id: 'link', label: 'Copy a link', detail: 'that opens the same scene and marks' },
];

/** Scene and points as JSON: the same fields that the command line writes. */
export function pointsJson(version: string, made: BevDocument, answer: Answer): string {
  const rows = [0, 3, 6].map((start) => answer.homography.slice(start, start + 3));
  const report = {
    version,
    scene: made.scene,
    from: 'top',
    whole_pixels: made.whole,
    homography: rows,
    points: answer.told,
    ...(answer.region && { polygon: answer.region }),
    ...(made.pairs.length > 0 && { pairs: made.pairs }),
  };
  return `${JSON.stringify(report, null, 2)}\n`;
}
