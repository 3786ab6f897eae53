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
  /** Of the methods beside it. */
  others: readonly Options[];
  start: Pose | null;
  at: number;
  tab: string;
}

/** Digits sufficient for differences that are visible. */
const round = (value: number): number => Number(value.toFixed(6));

/** `first`: the method of the scene that the link names, which need not be written. */
export function writeLink(link: LabLink, is_planar: boolean, first: Options = {}): string {
  const { sample, source, target, options, others, start, at, tab } = link;
  const written = (of: Options, base: Options): string =>
    writeSettings(methodValues(of, is_planar), methodValues(base, is_planar));
  const method = written(options, first);
  const given = new URLSearchParams({ source, target });
  if (sample !== null) given.set('scene', sample);
  if (start) given.set('start', startNumbers(start, is_planar).map(round).join(','));
  if (at > 0) given.set('at', String(at));
  if (tab !== 'step') given.set('tab', tab);
  for (const other of others) given.append('beside', written(other, {}));
  return `#icp&${given.toString()}${method ? `&${method}` : ''}`;
}

/** Null where the fragment is of something else. */
export function readLink(fragment: string): LabLink | null {
  const given = new URLSearchParams(fragment.replace(/^#/, ''));
  if (!given.has('icp')) return null;
  const numbers = (given.get('start') ?? '').split(',').filter(Boolean).map(Number);
  const is_planar = numbers.length !== 16;
  return {
    sample: given.get('scene'),
    source: given.get('source') ?? '',
    target: given.get('target') ?? '',
    options: methodOf(given),
    others: given.getAll('beside').map((written) => methodOf(new URLSearchParams(written))),
    start: startPose(numbers, is_planar),
    at: Number(given.get('at') ?? 0) || 0,
    tab: given.get('tab') ?? 'step',
  };
}

/** Of the fields of both kinds of cloud only those that are named are set. */
function methodOf(given: URLSearchParams): Options {
  const fields = methodFields(false) as unknown as Parameters<typeof parseSettings>[2];
  const named = parseSettings(given.toString(), {}, fields as never) as Record<string, string | number>;
  const planarMetric = given.get('metric') === 'point_to_line' ? { metric: 'point_to_line' } : {};
  return optionsOf({ ...named, ...planarMetric });
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
