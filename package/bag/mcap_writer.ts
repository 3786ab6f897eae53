/**
 * Messages to an MCAP file as they come: what has been written is whole at any time, but for its end.
 *
 * Source of the layout: "MCAP Format Specification", version 0. There are no chunks and no summary, which readers do without; MCAP's own
 * writer would hold messages back until a chunk is full.
 */
import { MAGIC, OPCODE, RECORD_HEADER_BYTES } from './mcap_records.js';

/** A topic that is written. */
export interface WrittenTopic {
  name: string;
  /** Of its messages, as ROS spells it. */
  type: string;
  /** How these are serialised. */
  encoding: string;
  /** The definition of the type. */
  schema: { encoding: string; data: Uint8Array };
}

/** Of a number, and its size in bytes. */
type Part = readonly [value: number | bigint, size: 2 | 4 | 8] | string | Uint8Array;

export class McapWriter {
  #write;
  #channels: Map<WrittenTopic, { id: number; count: number }> = new Map();

  /** @param profile which ROS the messages are of */
  constructor(write: (bytes: Uint8Array) => void, profile: 'ros1' | 'ros2') {
    this.#write = write;
    write(MAGIC);
    write(record(OPCODE.header, [profile, 'scanstitch']));
  }

  /** @param time when it was taken, ns */
  message(topic: WrittenTopic, time: bigint, data: Uint8Array) {
    const channel = this.#channels.get(topic) ?? this.#add(topic);
    channel.count += 1;
    this.#write(record(OPCODE.message, [[channel.id, 2], [channel.count, 4], [time, 8], [time, 8], data]));
  }

  end() {
    this.#write(record(OPCODE.dataEnd, [[0, 4]]));
    this.#write(record(OPCODE.footer, [[0n, 8], [0n, 8], [0, 4]])); // prettier-ignore
    this.#write(MAGIC);
  }

  #add(topic: WrittenTopic) {
    const { name, type, encoding, schema } = topic;
    // A schema's number is never zero.
    const channel = { id: this.#channels.size + 1, count: 0 };
    this.#channels.set(topic, channel);
    const id = [channel.id, 2] as const;
    this.#write(record(OPCODE.schema, [id, type, schema.encoding, [schema.data.length, 4], schema.data]));
    this.#write(record(OPCODE.channel, [id, id, name, encoding, [0, 4]]));
    return channel;
  }
}

function record(opcode: number, parts: readonly Part[]) {
  const encoded = parts.map((part) => (typeof part === 'string' ? new TextEncoder().encode(part) : part));
  const sizeOf = (part: Part, index: number) => {
    if (!(part instanceof Uint8Array)) return Number(part[1]);
    return part.length + (typeof parts[index] === 'string' ? 4 : 0);
  };
  const length = encoded.reduce((sum, part, index) => sum + sizeOf(part, index), 0);
  const bytes = new Uint8Array(RECORD_HEADER_BYTES + length);
  const view = new DataView(bytes.buffer);
  view.setUint8(0, opcode);
  view.setBigUint64(1, BigInt(length), true);
  let place = RECORD_HEADER_BYTES;
  for (const [index, part] of encoded.entries()) {
    if (!(part instanceof Uint8Array)) {
      const [value, size] = part;
      if (size === 2) view.setUint16(place, Number(value), true);
      else if (size === 4) view.setUint32(place, Number(value), true);
      else view.setBigUint64(place, BigInt(value), true);
    } else {
      const isText = typeof parts[index] === 'string';
      if (isText) view.setUint32(place, part.length, true);
      bytes.set(part, place + (isText ? 4 : 0));
    }
    place += sizeOf(part, index);
  }
  return bytes;
}
