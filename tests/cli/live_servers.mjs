// @ts-check
/** Servers on the loopback that play bags as bridges of robots do: Foxglove's by its own library, rosbridge's by its specification. */
import { once } from 'node:events';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import { WebSocketServer } from 'ws';

/** The library's modules for import lack the endings that Node wants. @type {typeof import('@foxglove/ws-protocol')} */
const { FoxgloveServer } = createRequire(import.meta.url)('@foxglove/ws-protocol');

/** @typedef {import('./bag_writer.mjs').TopicToWrite} TopicToWrite @typedef {import('./bag_writer.mjs').MessageToWrite} MessageToWrite */
/** @typedef {import('ws').WebSocket} Connection */
/** What is done when a test is over. @typedef {{ after: (close: () => void) => void }} Closing */

/**
 * A server of WebSockets; it is closed when the test is over.
 * @param {Closing} t
 * @param {import('ws').ServerOptions} options
 * @param {(connection: Connection) => void} onConnection
 */
export async function listen(t, options, onConnection) {
  const http = createServer((_, response) => response.writeHead(404).end());
  const server = new WebSocketServer({ server: http, ...options });
  server.on('connection', onConnection);
  http.listen(0, '127.0.0.1');
  await once(http, 'listening');
  t.after(() => {
    for (const connection of server.clients) connection.terminate();
    http.close();
    server.close();
  });
  const address = /** @type {import('node:net').AddressInfo} */ (http.address());
  return `ws://127.0.0.1:${address.port}`;
}

/**
 * A bridge of Foxglove: `subscribed` has the connection once so many topics are subscribed to, by default all.
 * @param {Closing} t @param {TopicToWrite[]} topics
 */
export async function serveFoxglove(t, topics, numWanted = topics.length) {
  const server = new FoxgloveServer({ name: 'a robot' });
  const channels = topics.map(({ name, type, format = 'cdr' }) => {
    const id = server.addChannel({ topic: name, schemaName: type, encoding: format, schema: '# fields' });
    return /** @type {const} */ ([name, id]);
  });
  const ids = new Map(channels);
  /** @type {Connection | null} */
  let client = null;
  let missing = numWanted;
  /** @type {Promise<Connection>} */
  const subscribed = new Promise((resolve) => {
    server.on('subscribe', () => {
      missing -= 1;
      if (missing === 0 && client) resolve(client);
    });
  });
  const handleProtocols = (/** @type {Set<string>} */ offered) => server.handleProtocols(offered);
  const url = await listen(t, { handleProtocols }, (connection) => {
    client = connection;
    server.handleConnection(/** @type {never} */ (connection), 'client');
  });
  const send = (/** @type {MessageToWrite[]} */ messages) => {
    for (const { topic, time, data } of messages) server.sendMessage(ids.get(topic) ?? 0, time, new Uint8Array(data));
  };
  return { url, server, subscribed, send };
}

/**
 * Plays messages by Foxglove's protocol once all topics are subscribed to; `then` has the connection when all is sent.
 * @param {Closing} t @param {TopicToWrite[]} topics @param {MessageToWrite[]} messages
 * @param {(connection: Connection, server: InstanceType<typeof FoxgloveServer>) => void} [then]
 */
export async function playFoxglove(t, topics, messages, then = (connection) => connection.close(1000)) {
  const { url, server, subscribed, send } = await serveFoxglove(t, topics);
  void subscribed.then((connection) => {
    send(messages);
    then(connection, server);
  });
  return url;
}

/** CBOR of what rosbridge sends. @param {unknown} value @returns {Buffer} */
function cbor(value) {
  const head = (/** @type {number} */ kind, /** @type {number} */ size) => {
    const bytes = Buffer.alloc(5);
    bytes[0] = (kind << 5) | 26;
    bytes.writeUInt32BE(size, 1);
    return bytes;
  };
  if (typeof value === 'number') return head(0, value);
  if (value instanceof Uint8Array) return Buffer.concat([head(2, value.length), value]);
  if (typeof value === 'string') return Buffer.concat([head(3, Buffer.byteLength(value)), Buffer.from(value)]);
  const entries = Object.entries(/** @type {object} */ (value));
  return Buffer.concat([head(5, entries.length), ...entries.flatMap((entry) => entry.map(cbor))]);
}

/**
 * Plays messages by rosbridge's protocol; `until` waits for the time of a message.
 * @param {Closing} t @param {TopicToWrite[]} topics @param {MessageToWrite[]} messages
 * @param {(time: bigint) => Promise<void> | null} [until]
 */
export function playRosbridge(t, topics, messages, until = () => null) {
  return listen(t, { handleProtocols: () => false }, (connection) => {
    let missing = topics.length;
    connection.on('message', async (data) => {
      const { op, service, id, compression } = JSON.parse(String(data));
      if (op === 'call_service' && service === '/rosapi/topics') {
        const values = { topics: topics.map(({ name }) => name), types: topics.map(({ type }) => type) };
        connection.send(JSON.stringify({ op: 'service_response', service, id, values, result: true }));
      } else if (op === 'subscribe' && compression === 'cbor-raw') missing -= 1;
      if (op !== 'subscribe' || missing !== 0) return;
      for (const { topic, time, data: bytes } of messages) {
        await until(time);
        const [secs, nsecs] = [Number(time / 1_000_000_000n), Number(time % 1_000_000_000n)];
        connection.send(cbor({ op: 'publish', topic, msg: { secs, nsecs, bytes } }));
      }
      connection.close(1000);
    });
  });
}
