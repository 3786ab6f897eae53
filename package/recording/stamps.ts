/**
 * Whether the times of images can be the times they were taken at. Numbers in names and lists may be durations, exposure
 * times or another clock's: sorted by those, the frames of a recording are shuffled.
 */
import { compareNaturally } from '../base/natural_order.js';
import { baseOf, type Member } from '../files/names.js';

/** More images a second than this no depth camera takes: the fastest have 300. */
const MAX_RATE = 400;
/** Stamps that arrive out of order, as networks deliver them, move a frame by no more places than this. */
const MAX_JITTER = 3;

/**
 * The images with the times that their names or a list give, or without any where these cannot be times.
 * @param members in natural order of their names
 * @param listed times of paths, in the order of the list
 * @returns fault: completes "FOLDER: its time stamps ..."
 */
export function withTimes(
  members: readonly Member[],
  listed: ReadonlyMap<string, number>,
): { members: Member[]; fault: string | null } {
  const { ordered, isOrdered } = inFileOrder(members, listed);
  const dated = ordered.map((member) => ({ ...member, time: listed.get(member.path) ?? member.time }));
  const fault = faultOfTimes(
    dated.map(({ time }) => time),
    isOrdered,
  );
  return { members: fault === null ? dated : dated.map((member) => ({ ...member, time: null })), fault };
}

/**
 * In the order of the list, or by the numbers beside the times in the names; names that are times alone have no other order.
 */
function inFileOrder(members: readonly Member[], listed: ReadonlyMap<string, number>) {
  const place = new Map([...listed.keys()].map((path, index) => [path, index]));
  if (members.every(({ path }) => place.has(path))) {
    const ordered = members.toSorted((a, b) => (place.get(a.path) ?? 0) - (place.get(b.path) ?? 0));
    return { ordered, isOrdered: true };
  }
  const countOf = ({ path }: Member) => baseOf(path).replace(/\d+\.\d+/, '');
  const hasCounts = new Set(members.map(countOf)).size === members.length;
  const ordered = hasCounts ? members.toSorted((a, b) => compareNaturally(countOf(a), countOf(b))) : [...members];
  return { ordered, isOrdered: hasCounts };
}

/**
 * Why these are no times; null where they may be.
 * @param times s
 * @param isOrdered whether their order is that of the recording
 */
function faultOfTimes(times: readonly (number | null)[], isOrdered: boolean) {
  const known = times.filter((time) => time !== null);
  if (known.length < 3 || known.length < times.length) return null;
  const places = known.map((_, index) => index).sort((a, b) => (known[a] ?? 0) - (known[b] ?? 0));
  const [first, last] = [known[places[0] ?? 0] ?? 0, known[places.at(-1) ?? 0] ?? 0];
  const words = (time: number) => `${Number(time.toFixed(4))} s`;
  if (last === first) return `are all the same (${words(first)})`;
  const isShuffled = isOrdered && !places.every((place, index) => Math.abs(place - index) <= MAX_JITTER);
  if (isShuffled) {
    const fall = known.findIndex((time, index) => index > 0 && time < (known[index - 1] ?? 0));
    return `do not ascend (${words(known[fall - 1] ?? 0)}, then ${words(known[fall] ?? 0)})`;
  }
  const isTooFast = (known.length - 1) / (last - first) > MAX_RATE;
  const span = `${words(first)} and ${words(last)} for ${known.length} images`;
  return isTooFast ? `lie between ${span}, as durations may, but no times of a camera` : null;
}
