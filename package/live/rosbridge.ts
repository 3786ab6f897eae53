/**
 * Topics of a rosbridge.
 *
 * Source: "rosbridge v2.0 Protocol Specification". Messages are asked for as cbor-raw, which is how ROS serialised them: the same bytes
 * as in a bag. roslib would turn them into objects, and brings readers of PNG and XML.
 */
import { readCbor, type Value } from './cbor.js';
import { type Listener, NO_SCHEMA, type Offered, payloadOf, type Socket, type Source } from './source.js';

const TOPICS = '/rosapi/topics';

export function rosbridgeSource(socket: Socket, listener: Listener): Source {
  const offered: Map<string, Offered> = new Map();
  const ask = () => socket.send(JSON.stringify({ op: 'call_service', id: TOPICS, service: TOPICS, args: {} }));

  const takeTopics = ({ topics = [], types = [] }: { topics?: string[]; types?: string[] }) => {
    for (const [index, name] of topics.entries()) {
      const type = types[index] ?? '';
      const known = offered.get(name);
      if (known?.type === type) continue;
      if (known) listener.gone(known);
      // ROS 1 has no /msg/ in its names of types.
      const topic = { name, type, encoding: type.includes('/msg/') ? 'cdr' : 'ros1', schema: NO_SCHEMA };
      offered.set(name, topic);
      listener.offered(topic);
    }
  };
  const take = ({ op, topic: name, msg, service, result, values, level, msg: text }: Record<string, Value>) => {
    if (op === 'service_response' && service === TOPICS) {
      if (result === false) listener.problem('the server does not list its topics: start rosapi beside rosbridge');
      else takeTopics(values as { topics?: string[]; types?: string[] });
    } else if (op === 'status' && (level === 'error' || level === 'warning')) {
      listener.problem(`the server says: ${String(text)}`);
    } else if (op === 'publish') {
      const topic = offered.get(String(name));
      const { secs, nsecs, bytes } = (msg ?? {}) as Record<string, Value>;
      if (!topic || !(bytes instanceof Uint8Array)) throw new RangeError(`it is no serialised message of a topic`);
      listener.message(topic, BigInt(Number(secs)) * 1_000_000_000n + BigInt(Number(nsecs)), bytes);
    }
  };
  socket.onmessage = ({ data }) => {
    try {
      const payload = payloadOf(data);
      const value = typeof payload === 'string' ? JSON.parse(payload) : readCbor(payload);
      if (value === null || typeof value !== 'object') throw new RangeError('it is no object');
      take(value);
    } catch (error) {
      listener.problem(`a message was not understood: ${(error as Error).message}`);
    }
  };
  ask();
  return {
    ask,
    subscribe: ({ name, type }) => {
      socket.send(JSON.stringify({ op: 'subscribe', topic: name, type, compression: 'cbor-raw' }));
    },
  };
}
