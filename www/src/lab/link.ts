/** A link that holds what the lab shows: `#icp&source=...&target=...`, with the method and the start. */
import { methodFields, methodValues, optionsOf } from './method-fields.js';
import { planarParts, planarPose } from './poses.js';
import type { Options, Pose } from './protocol.js';
import { parseSettings, writeSettings } from '../views/setting-fields.js';

export interface LabLink {
  /** Of the sample or a scene; null where the clouds are the user's own files, which a link cannot carry. */
  sample: string | null;
  source: string;
  target: string;
  options: Options;
  start: Pose | null;
  at: number;
  tab: string;
}

/** Digits that tell apart what the eye does. */
const round = (value: number): number => Number(value.toFixed(6));

export function writeLink({ sample, source, target, options, start, at, tab }: LabLink, is_planar: boolean): string {
  const base = methodValues({}, is_planar);
  const method = writeSettings(methodValues(options, is_planar), base);
  const given = new URLSearchParams({ source, target });
  if (sample !== null) given.set('scene', sample);
  if (start) given.set('start', startNumbers(start, is_planar).map(round).join(','));
  if (at > 0) given.set('at', String(at));
  if (tab !== 'step') given.set('tab', tab);
  return `#icp&${given.toString()}${method ? `&${method}` : ''}`;
}

/** Null where the fragment is of something else. */
export function readLink(fragment: string): LabLink | null {
  const given = new URLSearchParams(fragment.replace(/^#/, ''));
  if (!given.has('icp')) return null;
  const numbers = (given.get('start') ?? '').split(',').filter(Boolean).map(Number);
  const is_planar = numbers.length !== 16;
  const fields = methodFields(false) as unknown as Parameters<typeof parseSettings>[2];
  // Of the fields of both kinds of cloud only those that are named in the link are set.
  const named = parseSettings(given.toString(), {}, fields as never) as Record<string, string | number>;
  const planar_metric = given.get('metric') === 'point_to_line' ? { metric: 'point_to_line' } : {};
  return {
    sample: given.get('scene'),
    source: given.get('source') ?? '',
    target: given.get('target') ?? '',
    options: optionsOf({ ...named, ...planar_metric }),
    start: startPose(numbers, is_planar),
    at: Number(given.get('at') ?? 0) || 0,
    tab: given.get('tab') ?? 'step',
  };
}

function startNumbers(start: Pose, is_planar: boolean): number[] {
  if (!is_planar) return Array.from(start);
  const { x, y, theta } = planarParts(start);
  return [x, y, theta];
}

function startPose(numbers: readonly number[], is_planar: boolean): Pose | null {
  if (numbers.some((value) => !Number.isFinite(value))) return null;
  if (is_planar) return numbers.length === 3 ? planarPose(numbers[0] ?? 0, numbers[1] ?? 0, numbers[2] ?? 0) : null;
  return numbers;
}
