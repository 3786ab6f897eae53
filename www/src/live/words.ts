/** What is said of a stream. */
import type { TYPES } from '../../../package/bag/messages.js';
import { kindOf } from '../../../package/live/frames.js';
import type { Offered } from '../../../package/live/source.js';
import { formatCount, plural } from '../views/format.js';
import type { LiveSession } from './session.js';

const KINDS: Record<(typeof TYPES)[keyof typeof TYPES], string> = {
  image: 'images',
  'packed image': 'compressed images',
  camera: 'camera',
  cloud: 'clouds',
  'livox cloud': 'clouds',
  'laser scan': 'laser scans',
  pose: 'poses',
  path: 'path',
  transforms: 'transforms',
  imu: 'inertial unit',
};

/** What messages of a topic are, or why they are not read. */
export function kindWords(topic: Offered): string {
  const kind = kindOf(topic);
  if (kind !== undefined) return KINDS[kind];
  const isRos = topic.encoding === 'cdr' || topic.encoding === 'ros1';
  return isRos ? 'not read' : `not read: serialised as ${topic.encoding || 'something unknown'}`;
}

/** How much comes, and how much of it is on the map. */
export function flowWords({ stream, rate, silence, numBytes, growth }: LiveSession): string {
  const numMessages = stream?.numMessages ?? 0;
  const flow =
    silence > 0
      ? `No message for ${Math.floor(silence / 1000)} s; still listening`
      : numMessages === 0
        ? 'Waiting for the first message'
        : rate === 0
          ? 'No message at the moment'
          : `Receiving ${rate < 10 ? rate.toFixed(1) : rate.toFixed(0)} messages/s`;
  const kept = `${plural(numMessages, 'message')} kept, ${sizeWords(numBytes)}`;
  if (!growth) return `${flow} · ${kept}`;
  const dropped = growth.numDropped > 0 ? `, ${formatCount(growth.numDropped)} left out of it` : '';
  return `${flow} · ${kept} · ${formatCount(growth.numPlaced)} on the map${dropped}`;
}

export function sizeWords(bytes: number): string {
  return bytes < 1e6 ? `${Math.ceil(bytes / 1000)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}
