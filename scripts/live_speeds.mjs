// @ts-check
/**
 * Plays bags to `scanstitch live` over the loopback and compares: `node scripts/live_speeds.mjs BAG... [--speed 1]...`. Each bag
 * is played by a Foxglove server and by a stand-in for rosbridge at these multiples of its own speed (1 and 5). A line each: messages, seconds, and
 * whether the trajectory of the stopped stream, the one computed again from the MCAP that it left and the bag's own are the same bytes.
 */
import { execFile } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { setTimeout as sleep } from 'node:timers/promises';
import { parseArgs, promisify } from 'node:util';
import { TYPES } from '../npm/bag/messages.js';
import { openBags } from '../npm/bag/open.js';
import { playRosbridge, serveFoxglove } from '../tests/cli/live_servers.mjs';
import { ROOT } from './steps.mjs';

const { values, positionals } = parseArgs({
  options: { speed: { type: 'string', multiple: true, default: ['1', '5'] } },
  allowPositionals: true,
});
const run = promisify(execFile);
/** Exit codes of doubtful frames are no failure here. @param {string[]} args */
const scanstitch = (...args) =>
  run(process.execPath, [join(ROOT, 'npm/cli.js'), ...args], { maxBuffer: 2 ** 26 }).catch((error) => error);

/** All messages of a bag in the order of their times, as a robot sends them. @param {string} path */
async function messagesOf(path) {
  const bytes = new Uint8Array(readFileSync(path));
  const source = async () => ({
    size: bytes.length,
    read: async (/** @type {number} */ start, /** @type {number} */ end) => bytes.subarray(start, end),
  });
  const { bags } = await openBags([{ path: basename(path), source }]);
  const [bag] = bags;
  if (!bag) throw new Error(`${path} is no bag`);
  // The others are not asked for.
  const topics = bag.topics.filter(({ type }) => type in TYPES);
  const messages = [];
  for (const topic of topics) {
    for (let index = 0; index < topic.count; index += 1) {
      const data = await bag.read(topic, index);
      // Those of ROS 1 have no header on the wire.
      const sent = topic.format === 'ros1' ? data.subarray(4) : data;
      messages.push({ topic: topic.name, time: bag.time(topic, index), data: Uint8Array.from(sent) });
    }
  }
  messages.sort((a, b) => (a.time < b.time ? -1 : Number(a.time > b.time)));
  return { topics: topics.map(({ name, type, format }) => ({ name, type, format })), messages };
}

/** Waits for the time of a message. @param {bigint} first @param {number} speed */
function clock(first, speed) {
  const start = performance.now();
  return async (/** @type {bigint} */ time) => {
    const wait = Number(time - first) / 1e6 / speed - (performance.now() - start);
    if (wait > 0) await sleep(wait);
  };
}

/** @param {{ after: (close: () => void) => void }} closing @param {string} protocol @param {Awaited<ReturnType<typeof messagesOf>>} recorded @param {number} speed */
async function play(closing, protocol, { topics, messages }, speed) {
  const first = messages[0]?.time ?? 0n;
  if (protocol === 'rosbridge') {
    /** @type {ReturnType<typeof clock> | null} */
    let until = null;
    return playRosbridge(closing, topics, messages, (time) => (until ??= clock(first, speed))(time));
  }
  const { url, subscribed, send } = await serveFoxglove(closing, topics);
  void subscribed.then(async (connection) => {
    const until = clock(first, speed);
    for (const message of messages) {
      await until(message.time);
      send([message]);
    }
    connection.close(1000);
  });
  return url;
}

for (const path of positionals) {
  const recorded = await messagesOf(path);
  const folder = mkdtempSync(join(tmpdir(), 'scanstitch-live-'));
  const trajectory = (/** @type {string} */ name) => readFileSync(join(folder, name, 'trajectory.tum'), 'utf8');
  await scanstitch('reconstruct', path, '--out', join(folder, 'bag'));
  for (const protocol of ['Foxglove', 'rosbridge']) {
    for (const speed of values.speed.map(Number)) {
      /** @type {(() => void)[]} */
      const closers = [];
      const url = await play({ after: (close) => closers.push(close) }, protocol, recorded, speed);
      const start = performance.now();
      const { stdout = '' } = await scanstitch('live', url, '--out', join(folder, 'live'));
      const seconds = (performance.now() - start) / 1000;
      await scanstitch('reconstruct', join(folder, 'live', 'stream.mcap'), '--out', join(folder, 'again'));
      const isSame = trajectory('live') === trajectory('bag') && trajectory('again') === trajectory('bag');
      const dropped = stdout.match(/; (\d+) came/)?.[1] ?? '-';
      const count = trajectory('bag').trim().split('\n').length;
      console.log(
        `| ${basename(path)}, ${protocol}, ${speed} x | ${recorded.messages.length} | ${count} | ${dropped} | ${seconds.toFixed(1)} | ${isSame ? 'the same' : 'DIFFERENT'} |`,
      );
      for (const close of closers) close();
    }
  }
  rmSync(folder, { recursive: true });
}
