// @ts-check
/** Which colour picture belongs to which depth image. */

/** @typedef {import('../recording.js').DepthFrame} DepthFrame */
/** @typedef {import('../recording.js').Note} Note */
/** @typedef {import('./names.js').Member} Member */
/** @typedef {{ depth: Member, color: Member | null }} Pair */

/** Times further apart than this do not belong together (s). */
export const MAX_TIME_DIFFERENCE = 0.02;

/**
 * Pairs by number, or by time where the names are times; what stays alone comes back alone.
 * @param {readonly Member[]} depth
 * @param {readonly Member[]} colours
 * @param {boolean} mayCount whether as many of both, numbered otherwise, may be paired in order
 * @returns {{ pairs: Pair[], unused: Member[], way: 'number' | 'time' | 'order' | 'none' }}
 */
export function pairUp(depth, colours, mayCount = true) {
  const timed = [...depth, ...colours].every(({ time }) => time !== null);
  const partners = timed ? byTime(depth, colours) : byKey(depth, colours);
  /** @type {'number' | 'time' | 'order' | 'none'} */
  let way = timed ? 'time' : 'number';
  if (!timed && mayCount && depth.length === colours.length && (partners.size === 0 || areShifted(depth, colours))) {
    way = 'order';
    partners.clear();
    depth.forEach((member, index) => partners.set(member, /** @type {Member} */ (colours[index])));
  } else if (partners.size === 0) {
    way = 'none';
  }
  const used = new Set(partners.values());
  return {
    pairs: depth.map((member) => ({ depth: member, color: partners.get(member) ?? null })),
    unused: colours.filter((colour) => !used.has(colour)),
    way,
  };
}

/**
 * @param {readonly Member[]} depth
 * @param {readonly Member[]} colours
 */
export function countMatches(depth, colours) {
  const keys = new Set(colours.map(({ key }) => key));
  return depth.filter(({ key }) => keys.has(key)).length;
}

/**
 * @param {readonly Member[]} depth
 * @param {readonly Member[]} colours
 * @returns {Map<Member, Member>}
 */
function byKey(depth, colours) {
  const whole = byPart(depth, colours, (key) => key);
  if (2 * whole.size > depth.length) return whole;
  // A number and a time that differs a little: SUN3D's 0000001-000000033367.
  const first = (/** @type {string} */ key) => key.split(' ')[0] ?? '';
  const areNumbered = [depth, colours].every((list) => new Set(list.map(({ key }) => first(key))).size === list.length);
  const byFirst = areNumbered ? byPart(depth, colours, first) : whole;
  return byFirst.size > whole.size ? byFirst : whole;
}

/**
 * @param {readonly Member[]} depth
 * @param {readonly Member[]} colours
 * @param {(key: string) => string} partOf
 * @returns {Map<Member, Member>}
 */
function byPart(depth, colours, partOf) {
  const colourOf = new Map(colours.map((colour) => [partOf(colour.key), colour]));
  return new Map(
    depth.flatMap((member) => {
      const colour = colourOf.get(partOf(member.key));
      return colour ? [[member, colour]] : [];
    }),
  );
}

/**
 * As many of both, each numbered without a gap, from another first number: 0 to 79 and 1 to 80.
 * @param {readonly Member[]} depth
 * @param {readonly Member[]} colours
 */
function areShifted(depth, colours) {
  const isConsecutive = (/** @type {readonly Member[]} */ members) =>
    members.every(({ key }, index) => /^\d+$/.test(key) && Number(key) === Number(members[0]?.key) + index);
  return depth[0]?.key !== colours[0]?.key && isConsecutive(depth) && isConsecutive(colours);
}

/**
 * The nearest in time first, each once.
 * @param {readonly Member[]} depth
 * @param {readonly Member[]} colours
 * @returns {Map<Member, Member>}
 */
function byTime(depth, colours) {
  const timeOf = (/** @type {Member} */ { time }) => time ?? Number.NaN;
  const inOrder = (/** @type {readonly Member[]} */ members) => members.toSorted((a, b) => timeOf(a) - timeOf(b));
  const ordered = inOrder(colours);
  /** @type {{ member: Member, colour: Member, difference: number }[]} */
  const candidates = [];
  let first = 0;
  for (const member of inOrder(depth)) {
    const time = timeOf(member);
    while (first < ordered.length && timeOf(/** @type {Member} */ (ordered[first])) < time - MAX_TIME_DIFFERENCE)
      first += 1;
    for (const colour of ordered.slice(first)) {
      const difference = Math.abs(timeOf(colour) - time);
      if (difference > MAX_TIME_DIFFERENCE) break;
      candidates.push({ member, colour, difference });
    }
  }
  candidates.sort((a, b) => a.difference - b.difference);
  /** @type {Map<Member, Member>} */
  const partners = new Map();
  const used = new Set();
  for (const { member, colour } of candidates) {
    if (partners.has(member) || used.has(colour)) continue;
    partners.set(member, colour);
    used.add(colour);
  }
  return partners;
}
