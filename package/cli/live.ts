/** `scanstitch live`: a robot's topics as they come, kept as a recording that is then reconstructed. */
import { closeSync, mkdirSync, openSync, writeSync } from 'node:fs';
import { join } from 'node:path';
import { printable } from '../base/printable.js';
import type { Offered, OpenSocket, Socket } from '../live/source.js';
import { type End, LiveStream } from '../live/stream.js';
import { type Command, CommandError, type Engine, EXIT, readArguments, table, untilInterrupt } from './command.js';
import { invocation } from './invocation.js';
import { LiveMap } from './live_map.js';
import { reconstruct } from './reconstruct.js';
import { note, print, tell } from './terminal.js';
import { readWishes } from './wishes.js';

const OPTIONS = {
  topic: { type: 'string', multiple: true },
  seconds: { type: 'string' },
  preset: { type: 'string' },
  set: { type: 'string', multiple: true },
  out: { type: 'string', default: 'scanstitch-live' },
} as const;
/** Name of the recording in the folder of the results. */
const RECORDING = 'stream.mcap';
/** A server that is silent for so long is told of (s). */
const SILENCE = 10;

export const live: Command = {
  name: 'live',
  about: 'topics of a robot as they come, by a Foxglove bridge or rosbridge',
  help: () => `scanstitch live ws://HOST:PORT [OPTION]...

Asks a Foxglove bridge (ros2 launch foxglove_bridge foxglove_bridge_launch.xml, port 8765) or a rosbridge with rosapi
(port 9090) for its laser scans, depth images with their camera, clouds, odometry and transforms. All messages are
kept in DIR/${RECORDING}, as they were sent. While they come, clouds and depth images are registered; those that come
faster than that are left out of the growing map and counted. Ctrl-C, the end of the stream or --seconds stops; then
all messages are reconstructed, as scanstitch reconstruct DIR/${RECORDING} does.

Options:
  --out DIR          folder of the recording and the results, created if missing (default: ${OPTIONS.out.default})
  --topic ROLE=NAME  a topic to use as depth, color, camera, clouds, scans, imu, odometry or reference; then no others
                     are asked for but transforms (default: all that are read)
  --seconds N        stop after this time
  --preset NAME, --set NAME=VALUE   as of scanstitch reconstruct

Examples:
  scanstitch live ws://localhost:8765 --seconds 60
  scanstitch live ws://robot.local:9090 --topic scans=/scan --topic odometry=/odom --out lap
`,
  run,
};

async function run(engine: Engine, args: string[]) {
  const { values, positionals } = readArguments('live', { args, options: OPTIONS, allowPositionals: true });
  const [url, ...others] = positionals;
  if (url === undefined || others.length > 0 || !/^wss?:\/\/[^/]/.test(url)) {
    throw new CommandError('Give one address, such as ws://localhost:8765. See: scanstitch live --help');
  }
  const seconds = values.seconds === undefined ? null : Number(values.seconds);
  if (seconds !== null && !(seconds > 0))
    throw new CommandError(`--seconds ${values.seconds}: this is a time, such as 60`);
  const wishes = Object.values(readWishes(values.topic)).filter((name) => name !== null);
  const names = wishes.length > 0 ? new Set([...wishes, '/tf', '/tf_static']) : null;

  mkdirSync(values.out, { recursive: true });
  const path = join(values.out, RECORDING);
  const { stream, end, map } = await record(engine, { url, path, names, seconds });
  tellEnd(stream, end, url);
  if (stream.numMessages === 0) throw new CommandError(`${printable(url)}: nothing was recorded. ${offer(stream)}`);
  print(`${summary(stream, map)}Recorded to ${printable(path)}\n`);

  const passed = [...list('--topic', values.topic), ...list('--preset', values.preset), ...list('--set', values.set)];
  const code = await reconstruct.run(engine, [path, '--out', values.out, ...passed]);
  return code === EXIT.done && !end.isWhole ? EXIT.partial : code;
}

type Task = { url: string; path: string; names: ReadonlySet<string> | null; seconds: number | null };

/** Receives until the stream ends, is stopped or the time is over. */
async function record(engine: Engine, { url, path, names, seconds }: Task) {
  const openSocket = await socketOpener();
  let file: number | null = null;
  const map = new LiveMap(engine);
  const { stderr } = invocation();
  let [isHeard, isTold] = [true, false];
  try {
    return await untilInterrupt(async (signal) => {
      const onMessage = (topic: Offered, data: Uint8Array) => {
        isHeard = true;
        map.take(topic, data);
        if (stderr.isTTY) stderr.write(`\r${stream.numMessages} messages, ${map.numPlaced} frames in the map`);
      };
      const write = (bytes: Uint8Array) => {
        file ??= openSync(path, 'w');
        writeSync(file, bytes);
      };
      const stream = new LiveStream({ url, openSocket, write, names, onMessage });
      const stop = () => stream.stop();
      signal.addEventListener('abort', stop);
      const limit = seconds === null ? undefined : setTimeout(stop, 1000 * seconds);
      const silence = setInterval(() => {
        if (!isHeard && !isTold) note(`${printable(url)}: no message for ${SILENCE} s; still listening.`);
        [isHeard, isTold] = [false, !isHeard];
      }, 1000 * SILENCE);
      const end = await stream.ended;
      clearTimeout(limit);
      clearInterval(silence);
      map.stop();
      return { stream, end, map };
    });
  } finally {
    if (stderr.isTTY) stderr.write('\r\x1b[K');
    if (file !== null) closeSync(file);
  }
}

/** Node has a WebSocket of its own from version 22 on. */
async function socketOpener(): Promise<OpenSocket> {
  const Own = globalThis.WebSocket ?? (await import('ws')).WebSocket;
  return (url, protocols) => new Own(url, [...protocols]) as unknown as Socket;
}

function tellEnd(stream: LiveStream, { isWhole, reason }: End, url: string) {
  (isWhole ? note : tell)(`${printable(url)}: ${reason}.`);
  for (const [problem, count] of stream.problems) {
    tell(`${printable(url)}: ${printable(problem)}${count > 1 ? ` (${count} times)` : ''}.`);
  }
}

/** What the server has, where nothing of it was received. */
function offer({ offered }: LiveStream) {
  const names = offered.map(({ name, type, encoding }) => `${name} (${type}, ${encoding})`);
  return names.length > 0 ? `It offers ${printable(names.join(', '))}.` : 'It offers no topics.';
}

function summary(stream: LiveStream, map: LiveMap) {
  const rows = [...stream.received.values()].map(({ topic, count }) => [topic.name, topic.type, String(count)]);
  const { numPlaced, numDropped } = map;
  const growing =
    numPlaced + numDropped > 0
      ? `${numPlaced} frames were registered as they came; ${numDropped} came too fast for that and are in the recording\n`
      : '';
  return `${table(['topic', 'type', 'messages'], rows, new Set([0, 1]))}${growing}`;
}

function list(name: string, values: string | string[] | undefined) {
  return [values ?? []].flat().flatMap((value) => [name, value]);
}
