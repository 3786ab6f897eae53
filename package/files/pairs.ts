/** Which colour picture belongs to which depth image. */
import type { Member } from './names.js';

type Pair = { depth: Member; color: Member | null };

/** Times further apart than this do not belong together (s). */
export const MAX_TIME_DIFFERENCE = 0.02;

/**
 * Pairs by number, or by time where the names are times; what stays alone comes back alone.
 * @param mayCount whether as many of both, numbered otherwise, may be paired in order
 */
export function pairUp(
  depth: readonly Member[],
  colors: readonly Member[],
  mayCount = true,
): { pairs: Pair[]; unused: Member[]; way: 'number' | 'time' | 'order' | 'none' } {
  const timed = [...depth, ...colors].every(({ time }) => time !== null);
  const partners = timed ? byTime(depth, colors) : byKey(depth, colors);
  let way: 'number' | 'time' | 'order' | 'none' = timed ? 'time' : 'number';
  if (!timed && mayCount && depth.length === colors.length && (partners.size === 0 || areShifted(depth, colors))) {
    way = 'order';
    partners.clear();
    depth.forEach((member, index) => partners.set(member, colors[index] as Member));
  } else if (partners.size === 0) {
    way = 'none';
  }
  const used = new Set(partners.values());
  return {
    pairs: depth.map((member) => ({ depth: member, color: partners.get(member) ?? null })),
    unused: colors.filter((color) => !used.has(color)),
    way,
  };
}

export function countMatches(depth: readonly Member[], colors: readonly Member[]) {
  const keys = new Set(colors.map(({ key }) => key));
  return depth.filter(({ key }) => keys.has(key)).length;
}

function byKey(depth: readonly Member[], colors: readonly Member[]): Map<Member, Member> {
  const whole = byPart(depth, colors, (key) => key);
  if (2 * whole.size > depth.length) return whole;
  // A number and a time that differs a little: SUN3D's 0000001-000000033367.
  const first = (key: string) => key.split(' ')[0] ?? '';
  const areNumbered = [depth, colors].every((list) => new Set(list.map(({ key }) => first(key))).size === list.length);
  const byFirst = areNumbered ? byPart(depth, colors, first) : whole;
  return byFirst.size > whole.size ? byFirst : whole;
}

function byPart(
  depth: readonly Member[],
  colors: readonly Member[],
  partOf: (key: string) => string,
): Map<Member, Member> {
  const colorOf = new Map(colors.map((color) => [partOf(color.key), color]));
  return new Map(
    depth.flatMap((member) => {
      const color = colorOf.get(partOf(member.key));
      return color ? [[member, color]] : [];
    }),
  );
}

/** As many of both, each numbered without a gap, from another first number: 0 to 79 and 1 to 80. */
function areShifted(depth: readonly Member[], colors: readonly Member[]) {
  const isConsecutive = (members: readonly Member[]) =>
    members.every(({ key }, index) => /^\d+$/.test(key) && Number(key) === Number(members[0]?.key) + index);
  return depth[0]?.key !== colors[0]?.key && isConsecutive(depth) && isConsecutive(colors);
}

/** The nearest in time first, each once. */
function byTime(depth: readonly Member[], colors: readonly Member[]): Map<Member, Member> {
  const timeOf = ({ time }: Member) => time ?? Number.NaN;
  const inOrder = (members: readonly Member[]) => members.toSorted((a, b) => timeOf(a) - timeOf(b));
  const ordered = inOrder(colors);
  const candidates: { member: Member; color: Member; difference: number }[] = [];
  let first = 0;
  for (const member of inOrder(depth)) {
    const time = timeOf(member);
    while (first < ordered.length && timeOf(ordered[first] as Member) < time - MAX_TIME_DIFFERENCE) first += 1;
    for (const color of ordered.slice(first)) {
      const difference = Math.abs(timeOf(color) - time);
      if (difference > MAX_TIME_DIFFERENCE) break;
      candidates.push({ member, color, difference });
    }
  }
  candidates.sort((a, b) => a.difference - b.difference);
  const partners: Map<Member, Member> = new Map();
  const used = new Set();
  for (const { member, color } of candidates) {
    if (partners.has(member) || used.has(color)) continue;
    partners.set(member, color);
    used.add(color);
  }
  return partners;
}
