/** A building plan behind a map, as files: its picture, and the world file by which other programs lay it where it is in the map. */
import type { PlacedPlan } from '../../pkg/scanstitch.js';
import { readImage } from '../files/heads.js';
import type { Pictures } from '../files/recording.js';
import { worldLines } from './map_drawings.js';

/** Of the picture and of its world file, by its format. */
const ENDINGS = { PNG: ['png', 'pgw'], JPEG: ['jpg', 'jgw'] } as const;

/** Empty where there is no plan, or no picture of it. */
export function planFiles(plan: PlacedPlan | null | undefined, pictures: Pictures = {}) {
  const bytes = plan && pictures[plan.picture];
  if (!plan || !bytes) return {};
  const format = readImage(bytes)?.format;
  const [ending, world] = format === 'PNG' || format === 'JPEG' ? ENDINGS[format] : ['picture', 'wld'];
  const { pixel, turn, corner } = plan;
  const [along, down] = [(pixel / 2) * Math.cos(turn), (pixel / 2) * Math.sin(turn)];
  const middle = [corner[0] + along + down, corner[1] + down - along];
  return { [`plan.${ending}`]: bytes, [`plan.${world}`]: worldLines(pixel, turn, middle) };
}
