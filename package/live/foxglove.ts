/**
 * Topics of a Foxglove bridge.
 *
 * Source: "Foxglove WebSocket Protocol", version 1 (ws-protocol, docs/spec.md). Its library, @foxglove/ws-protocol, plays the server in
 * the tests; of its client two texts and one kind of message would be used, for which it loads three packages more.
 */
import { type Listener, NO_SCHEMA, type Offered, payloadOf, type Socket, type Source } from './source.js';

export const SUBPROTOCOLS = ['foxglove.websocket.v1', 'foxglove.sdk.v1'] as const;

/** Before the data of a message: what it is, subscription, time. */
const MESSAGE_HEADER_BYTES = 13;
const MESSAGE_DATA = 1;

type Channel = {
  id: number;
  topic: string;
  encoding: string;
  schemaName: string;
  schema?: string;
  schemaEncoding?: string;
};

export function foxgloveSource(socket: Socket, listener: Listener): Source {
  const channels: Map<number, Offered> = new Map();
  const subscribed: Map<number, Offered> = new Map();
  let numSubscriptions = 0;

  const advertise = ({ id, topic, encoding, schemaName, schema, schemaEncoding }: Channel) => {
    const data = schema === undefined ? null : schemaBytes(schema, schemaEncoding ?? '');
    const described = { encoding: schemaEncoding ?? (encoding === 'ros1' ? 'ros1msg' : 'ros2msg'), data };
    const offered = { name: topic, type: schemaName, encoding, schema: data ? { ...described, data } : NO_SCHEMA };
    channels.set(id, offered);
    listener.offered(offered);
  };
  const withdraw = (id: number) => {
    const topic = channels.get(id);
    channels.delete(id);
    if (topic) listener.gone(topic);
  };
  const take = (bytes: Uint8Array) => {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    if (bytes.length > 0 && bytes[0] !== MESSAGE_DATA) return; // times, services and assets are not asked for
    if (bytes.length < MESSAGE_HEADER_BYTES) throw new RangeError(`it ends after ${bytes.length} bytes`);
    const topic = subscribed.get(view.getUint32(1, true));
    if (!topic) throw new RangeError('it belongs to no topic that was asked for');
    listener.message(topic, view.getBigUint64(5, true), bytes.subarray(MESSAGE_HEADER_BYTES));
  };
  socket.onmessage = ({ data }) => {
    try {
      const payload = payloadOf(data);
      if (typeof payload !== 'string') {
        take(payload);
        return;
      }
      const { op, channels: list = [], channelIds = [], message, level } = JSON.parse(payload);
      if (op === 'advertise') for (const channel of list) advertise(channel);
      else if (op === 'unadvertise') for (const id of channelIds) withdraw(id);
      else if (op === 'status' && level > 0) listener.problem(`the server says: ${message}`);
    } catch (error) {
      listener.problem(`a message was not understood: ${(error as Error).message}`);
    }
  };
  return {
    subscribe: (topic) => {
      const channelId = [...channels].find(([, offered]) => offered === topic)?.[0];
      if (channelId === undefined) return;
      numSubscriptions += 1;
      subscribed.set(numSubscriptions, topic);
      socket.send(JSON.stringify({ op: 'subscribe', subscriptions: [{ id: numSubscriptions, channelId }] }));
    },
    ask: () => {},
  };
}

/** Definitions that are no text come in base 64. */
function schemaBytes(schema: string, encoding: string) {
  if (encoding !== 'protobuf' && encoding !== 'flatbuffer') return new TextEncoder().encode(schema);
  return Uint8Array.from(atob(schema), (letter) => letter.charCodeAt(0));
}
