/** When the messages of a topic were made, in order, and what is wrong with their times. */
import { lost, type Note } from '../base/errors.js';
import { decodeStamp, type Stamp, STAMP_BYTES } from './messages.js';
import type { Bag, Topic } from './open.js';

/** time, recorded: ns */
export type Stamped = { index: number; time: bigint; recorded: bigint };

/** So many messages are looked into at a time. */
const READ_AT_ONCE = 64;
/** A time that lies further back than this is a new beginning; what lies nearer came out of order (ns). */
const NEW_BEGINNING = 1_000_000_000n;

/**
 * The messages of a topic by the times in their headers, or, where these are not set, by when they were recorded. Those
 * that cannot be read are left out, and told.
 * @param onProgress messages looked into
 */
export async function stampedMessages(
  bag: Bag,
  topic: Topic,
  onProgress: (done: number) => void = () => {},
): Promise<{ messages: Stamped[]; notes: Note[] }> {
  const faults: Map<string, number> = new Map();
  const found: Stamped[] = [];
  let numUnset = 0;
  for (let first = 0; first < topic.count; first += READ_AT_ONCE) {
    const indexes = Array.from({ length: Math.min(READ_AT_ONCE, topic.count - first) }, (_, i) => first + i);
    const heads = await Promise.allSettled(
      indexes.map(async (index) => nanoseconds(decodeStamp(await bag.readHead(topic, index, STAMP_BYTES)))),
    );
    for (const [i, head] of heads.entries()) {
      if (head.status === 'fulfilled') {
        if (head.value === 0n) numUnset += 1;
        found.push({ index: first + i, time: head.value, recorded: bag.time(topic, first + i) });
      } else {
        const { problem, message } = head.reason;
        const reason = problem ?? message;
        faults.set(reason, (faults.get(reason) ?? 0) + 1);
      }
    }
    onProgress(first + indexes.length);
  }
  const isSet = 2 * numUnset < found.length;
  const timed = isSet ? found.filter(({ time }) => time !== 0n) : found.map(byRecorder);
  const { messages, notes } = inOrder(topic.name, timed);
  for (const [reason, count] of faults) {
    notes.push(lost(topic.name, `${plural(count, 'message')} of ${topic.count} left out: ${reason}`));
  }
  if (!isSet && found.length > 0) {
    notes.push({ file: topic.name, reason: 'the times in its headers are not set: the times of recording are used' });
  } else if (numUnset > 0) {
    notes.push(lost(topic.name, `${plural(numUnset, 'message')} left out: the time in the header is not set`));
  }
  return { messages, notes };
}

/**
 * Messages in the order of their times, each time once.
 * @param name of the topic
 * @param messages in the order in which they were recorded
 */
function inOrder(name: string, messages: readonly Stamped[]) {
  const { messages: continuous, notes } = withoutJumps(name, messages);
  let latest = continuous[0]?.time ?? 0n;
  let numEarly = 0;
  for (const { time } of continuous) {
    if (time < latest) numEarly += 1;
    else latest = time;
  }
  if (numEarly > 0) {
    const reason = `time runs backwards at ${plural(numEarly, 'message')}; all are taken in the order of their times`;
    notes.push({ file: name, reason });
  }
  const ordered = continuous.toSorted((a, b) => (a.time < b.time ? -1 : a.time > b.time ? 1 : a.index - b.index));
  const distinct = ordered.filter(({ time }, index) => index === 0 || time !== ordered[index - 1]?.time);
  if (distinct.length < ordered.length) {
    const reason = `${plural(ordered.length - distinct.length, 'message')} left out: another one has the same time`;
    notes.push(lost(name, reason));
  }
  return { messages: distinct, notes };
}

/**
 * Messages whose times do not begin anew. Where they do and some come again, a recording was played twice: the longest stretch
 * is kept. Where none comes again, either a clock was set, and the times of recording are used, or messages came late.
 * @param messages in the order in which they were recorded
 */
export function withoutJumps(
  name: string,
  messages: readonly Stamped[],
): { messages: readonly Stamped[]; notes: Note[] } {
  const stretches = stretchesOf(messages);
  if (stretches.length < 2) return { messages, notes: [] };
  const jumps = `time jumps back ${stretches.length === 2 ? 'once' : `${stretches.length - 1} times`}`;
  if (new Set(messages.map(({ time }) => time)).size < messages.length) {
    const longest = stretches.toSorted((a, b) => b.length - a.length)[0] ?? [];
    const reason = `${jumps}; the longest stretch is used, ${longest.length} of ${plural(messages.length, 'message')}`;
    return { messages: longest, notes: [lost(name, reason)] };
  }
  if (!stretches.every(isSteady)) return { messages, notes: [] };
  const reason = `${jumps}, as where a clock is set: the times of recording are used`;
  return { messages: messages.map(byRecorder), notes: [{ file: name, reason }] };
}

function stretchesOf(messages: readonly Stamped[]) {
  const stretches: Stamped[][] = [];
  let latest: bigint | null = null;
  for (const message of messages) {
    if (latest === null || message.time < latest - NEW_BEGINNING) {
      stretches.push([]);
      latest = message.time;
    }
    stretches.at(-1)?.push(message);
    if (message.time > latest) latest = message.time;
  }
  return stretches;
}

/** Whether its clock goes as the recorder's does. */
function isSteady(stretch: readonly Stamped[]) {
  const [first] = stretch;
  const late = (message: Stamped) => message.recorded - message.time;
  return stretch.every((message) => {
    const change = late(message) - late(first ?? message);
    return change < NEW_BEGINNING && change > -NEW_BEGINNING;
  });
}

function byRecorder(message: Stamped): Stamped {
  return { ...message, time: message.recorded };
}

export function nanoseconds({ sec, nsec }: Stamp) {
  return BigInt(sec) * 1_000_000_000n + BigInt(nsec);
}

/** @param time ns */
export function stampOf(time: bigint): Stamp {
  return { sec: Number(time / 1_000_000_000n), nsec: Number(time % 1_000_000_000n) };
}

/**
 * Seconds, with all nine digits.
 * @param time ns
 */
export function timeText(time: bigint) {
  const { sec, nsec } = stampOf(time);
  return `${sec}.${String(nsec).padStart(9, '0')}`;
}

export function plural(count: number, what: string) {
  return `${count} ${what}${count === 1 ? '' : 's'}`;
}
