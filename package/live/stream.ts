/** A robot's topics as they come: chosen, kept as MCAP, and counted. */
import { McapWriter } from '../bag/mcap_writer.js';
import { foxgloveSource, SUBPROTOCOLS } from './foxglove.js';
import { kindOf } from './frames.js';
import { rosbridgeSource } from './rosbridge.js';
import type { Offered, OpenSocket, Socket, Source } from './source.js';

/** How a connection ended. `isWhole`: the server closed it, or we did. */
export type End = { isWhole: boolean; reason: string };

export interface StreamOptions {
  url: string;
  openSocket: OpenSocket;
  /** Where the MCAP goes, piece by piece. */
  write: (bytes: Uint8Array) => void;
  /** Names of the topics that are asked for; null: all that are read. */
  names: ReadonlySet<string> | null;
  onMessage?: (topic: Offered, data: Uint8Array) => void;
}

/** A topic with what came of it. */
export type Received = { topic: Offered; count: number };

/** Period of repeated queries for topics, while there is none that can be used (ms). */
const ASK_AGAIN = 2000;
/** The code of a socket that was closed without a word. */
const NO_GOODBYE = 1006;

export class LiveStream {
  /** What was not understood, with how often. */
  problems: Map<string, number> = new Map();
  /** All topics that the server has offered. */
  offered: Offered[] = [];
  /** Of those that were asked for. */
  received: Map<Offered, Received> = new Map();
  protocol: 'Foxglove' | 'rosbridge' | null = null;
  /** Fulfilled when the connection has ended, with all messages written. */
  ended: Promise<End>;
  #options;
  #mcap: McapWriter | null = null;
  #socket: Socket | null = null;
  #source: Source | null = null;
  #timer: ReturnType<typeof setInterval> | undefined;
  #end: (end: End) => void = () => {};
  #isStopped = false;
  #names: ReadonlySet<string> | null;
  /** The topics that the server has now. */
  #present: Set<Offered> = new Set();

  constructor(options: StreamOptions) {
    this.#options = options;
    this.#names = options.names;
    this.ended = new Promise((resolve) => {
      this.#end = (end) => {
        clearInterval(this.#timer);
        this.#mcap?.end();
        resolve(end);
      };
    });
    this.#connect(SUBPROTOCOLS);
  }

  get numMessages() {
    return [...this.received.values()].reduce((sum, { count }) => sum + count, 0);
  }

  stop() {
    this.#isStopped = true;
    this.#socket?.close();
  }

  /** Asks for these topics as well, now and when they are offered. */
  choose(names: ReadonlySet<string>) {
    this.#names = names;
    for (const topic of this.#present) if (!this.received.has(topic)) this.#subscribe(topic);
  }

  /** A Foxglove server takes one of its own protocols; rosbridge takes none, and some sockets call that an error. */
  #connect(protocols: readonly string[]) {
    const socket = this.#options.openSocket(this.#options.url, protocols);
    this.#socket = socket;
    socket.binaryType = 'arraybuffer';
    let isOpen = false;
    socket.onopen = () => {
      const isFoxglove = SUBPROTOCOLS.some((name) => name === socket.protocol);
      isOpen = true;
      this.protocol = isFoxglove ? 'Foxglove' : 'rosbridge';
      this.#source = (isFoxglove ? foxgloveSource : rosbridgeSource)(socket, this.#listener());
      this.#timer = setInterval(() => this.received.size === 0 && this.#source?.ask(), ASK_AGAIN);
    };
    socket.onerror = () => {}; // it closes, too
    socket.onclose = ({ code, reason }) => {
      if (!isOpen && protocols.length > 0 && !this.#isStopped) this.#connect([]);
      else this.#end(this.#endOf(isOpen, code, reason));
    };
  }

  #endOf(isOpen: boolean, code: number, reason: string): End {
    if (this.#isStopped) return { isWhole: true, reason: 'stopped' };
    if (!isOpen) return { isWhole: false, reason: 'nobody answers there with a WebSocket' };
    if (this.offered.length === 0) {
      return { isWhole: false, reason: 'it speaks neither the protocol of Foxglove nor that of rosbridge' };
    }
    if (code === NO_GOODBYE) return { isWhole: false, reason: 'the connection broke' };
    return { isWhole: true, reason: `the server closed the connection${reason && `: ${reason}`}` };
  }

  #listener() {
    return {
      offered: (topic: Offered) => {
        const before = this.offered.find(({ name, type }) => name === topic.name && type !== topic.type);
        if (before) this.#problem(`${topic.name} was ${before.type} and is ${topic.type}: kept as two topics`);
        this.offered.push(topic);
        this.#present.add(topic);
        this.#subscribe(topic);
      },
      gone: (topic: Offered) => this.#present.delete(topic),
      message: (topic: Offered, time: bigint, data: Uint8Array) => {
        const received = this.received.get(topic);
        if (!received) return;
        received.count += 1;
        // A recording of an earlier stream is not written over until there is one of this.
        this.#mcap ??= new McapWriter(this.#options.write, topic.encoding === 'ros1' ? 'ros1' : 'ros2');
        this.#mcap.message(topic, time, data);
        this.#options.onMessage?.(topic, data);
      },
      problem: (problem: string) => this.#problem(problem),
    };
  }

  /** Asks for a topic, where it is wanted and its messages are read. */
  #subscribe(topic: Offered) {
    if (kindOf(topic) === undefined || this.#names?.has(topic.name) === false) return;
    this.received.set(topic, { topic, count: 0 });
    this.#source?.subscribe(topic);
  }

  #problem(problem: string) {
    this.problems.set(problem, (this.problems.get(problem) ?? 0) + 1);
  }
}
