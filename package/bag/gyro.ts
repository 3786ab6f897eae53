/**
 * What an inertial unit beside a lidar says of its turns, as comments before the PCD files of the clouds: `# gyro T X Y Z`, with the time from the
 * cloud's stamp (s) and the angular velocity in the frame of the lidar (rad/s).
 */
import type { Note } from '../base/errors.js';
import { decodeImu, type Quaternion } from './messages.js';
import type { Bag, Topic } from './open.js';
import { readAlone, treeOf } from './path.js';
import { type Stamped, stampedMessages } from './stamps.js';
import type { TopicFacts } from './topics.js';
import { rotate } from './transforms.js';

/** No further from a cloud than this (ns). */
const MAX_APART = 1_000_000_000n;
/** So much is read beyond the clouds before and after (ns): readings lie on both sides of a time. */
const MARGIN = 50_000_000n;

export class Gyroscope {
  #bag: Bag;
  #topic: Topic;
  #readings: Stamped[];
  #rotation: Quaternion;

  private constructor(bag: Bag, topic: Topic, readings: Stamped[], rotation: Quaternion) {
    this.#bag = bag;
    this.#topic = topic;
    this.#readings = readings;
    this.#rotation = rotation;
  }

  /** @param lidar the topic of the clouds, whose frame the readings are turned into by /tf */
  static async open(bag: Bag, topics: readonly TopicFacts[], imu: TopicFacts, lidar: TopicFacts) {
    const { name } = imu.topic;
    const tree = await treeOf(bag, topics, true, []);
    const mounting = tree.between(lidar.frame, imu.frame);
    const { messages, notes } = await stampedMessages(bag, imu.topic);
    const assumed = `no /tf tells how ${imu.frame || 'its frame'} lies in ${lidar.frame || 'that of the clouds'}: taken for the same`;
    const all: Note[] = mounting ? notes : [...notes, { file: name, reason: assumed }];
    return { gyroscope: new Gyroscope(bag, imu.topic, messages, mounting?.rotation ?? [0, 0, 0, 1]), notes: all };
  }

  /**
   * The comments of a cloud: readings from the cloud before it to the one after it.
   * @param times of the three (ns)
   */
  async comments([before, time, after]: readonly [bigint, bigint, bigint]) {
    const from = (before > time - MAX_APART ? before : time - MAX_APART) - MARGIN;
    const to = (after < time + MAX_APART ? after : time + MAX_APART) + MARGIN;
    const lines = ['# gyro'];
    for (let at = this.#firstAfter(from); at < this.#readings.length; at += 1) {
      const reading = this.#readings[at] as Stamped;
      if (reading.time > to) break;
      const rate = await this.#rate(reading.index);
      const since = Number(reading.time - time) / 1e9;
      if (rate) lines.push(`# gyro ${since.toFixed(6)} ${rate.map((value) => value.toPrecision(8)).join(' ')}`);
    }
    return new TextEncoder().encode(`${lines.join('\n')}\n`);
  }

  #firstAfter(time: bigint) {
    let [low, high] = [0, this.#readings.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((this.#readings[middle] as Stamped).time < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** Null where the message cannot be read or says that it has none. */
  async #rate(index: number) {
    try {
      const { rate } = decodeImu(await readAlone(this.#bag, this.#topic, index));
      return rate && rotate(this.#rotation, rate);
    } catch {
      return null;
    }
  }
}
