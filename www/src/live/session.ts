/** A robot's topics as they come: the connection, what is kept of it, and the map that grows meanwhile. */
import type { ReactiveController, ReactiveControllerHost } from 'lit';
import { type AddressProblem, keptFrom, socketAddress, WAY_AROUND } from '../../../package/live/address.js';
import { kindOf, type MapSource, mapSourceOf, type Message, messageOf } from '../../../package/live/frames.js';
import type { Offered, Socket } from '../../../package/live/source.js';
import { type End, LiveStream } from '../../../package/live/stream.js';
import { printable } from '../../../package/base/printable.js';
import { whileConnected } from '../components/while-connected.js';
import { Announcer } from '../components/announcer.js';
import type { Growth } from './growth.js';
import { PlanarGrowth } from './planar-growth.js';
import { SpatialGrowth } from './spatial-growth.js';
import { Spool } from './spool.js';

/** choosing: the topics are listed, and none is subscribed to yet */
export type LivePhase = 'idle' | 'connecting' | 'choosing' | 'receiving' | 'ended';

/** The name that the command line gives it, too. */
const RECORDING = 'stream.mcap';
/** The figures are read as often as this (ms), and over so many of these periods. */
const TICK_MS = 500;
const RATE_TICKS = 4;
/** A server that is silent for so long is told of (ms), as on the command line. */
const SILENCE_MS = 10_000;
/** Of several kinds of messages the map is made of the same as that of the recording. */
const RANKS: Record<MapSource, number> = { depth: 3, clouds: 2, scans: 1 };

export class LiveSession implements ReactiveController {
  phase: LivePhase = 'idle';
  /** Address of the server, as it is shown. */
  address = '';
  stream: LiveStream | null = null;
  end: End | null = null;
  problem: AddressProblem | null = null;
  growth: Growth | null = null;
  /** What went wrong with the growing map. */
  mapProblem = '';
  /** Messages a second. */
  rate = 0;
  /** Since when nothing has come (ms); 0 where something comes. */
  silence = 0;
  /** The recording of the stream that has ended; null without. */
  recording: File | null = null;
  readonly announcer = new Announcer(() => this.#host.requestUpdate());
  readonly #host: ReactiveControllerHost & Element;
  readonly #kept: (recording: File) => void;
  #spool = new Spool();
  #source: { topic: Offered; kind: MapSource } | null = null;
  #camera: Message | null = null;
  #timer: ReturnType<typeof setInterval> | undefined;
  /** Messages so far, at the last ticks. */
  #counts: number[] = [];
  #heardAt = 0;
  #isForbidden = false;
  /** What is done when the stream has ended. */
  #next: (() => void) | null = null;

  /** `kept`: has the recording of a stream that has ended. */
  constructor(host: ReactiveControllerHost & Element, kept: (recording: File) => void) {
    this.#host = host;
    this.#kept = kept;
    host.addController(this);
    // A stream that is not saved would be lost with the page.
    whileConnected(host, window, 'beforeunload', (event) => {
      if (this.phase === 'receiving') event.preventDefault();
    });
    whileConnected(host, document, 'securitypolicyviolation', ({ effectiveDirective }) => {
      if (this.phase === 'connecting' && effectiveDirective === 'connect-src') this.#isForbidden = true;
    });
  }

  hostDisconnected(): void {
    queueMicrotask(() => {
      if (!this.#host.isConnected) this.stop();
    });
  }

  get isOpen(): boolean {
    return this.phase === 'connecting' || this.phase === 'choosing' || this.phase === 'receiving';
  }

  /** Bytes of the recording so far. */
  get numBytes(): number {
    return this.#spool.size;
  }

  /** `isAll`: asks for all topics that are read, without a question. */
  connect(typed: string, isAll = false): void {
    if (this.isOpen) {
      this.#next = () => this.connect(typed, isAll);
      this.stop();
      return;
    }
    const url = socketAddress(typed);
    const problem = url instanceof URL ? keptFrom(url, location.protocol) : url;
    [this.problem, this.end, this.recording, this.mapProblem] = [problem, null, null, ''];
    [this.growth, this.#source, this.#camera, this.#isForbidden] = [null, null, null, false];
    [this.#counts, this.#spool, this.rate, this.silence] = [[], new Spool(), 0, 0];
    this.address = url instanceof URL ? url.href.replace(/\/$/, '') : typed;
    this.stream = null;
    this.phase = problem ? 'ended' : 'connecting';
    if (!problem) this.#open(isAll ? null : new Set());
    this.#host.requestUpdate();
  }

  /** Asks for these topics, and for the transforms between frames. */
  start(names: ReadonlySet<string>): void {
    this.stream?.choose(names);
    this.#receive();
  }

  /** Ends the stream; what has come is kept. */
  stop(): void {
    this.stream?.stop();
  }

  #open(names: ReadonlySet<string> | null): void {
    const stream = new LiveStream({
      url: this.address,
      openSocket,
      write: (bytes) => this.#spool.write(bytes),
      names,
      onMessage: (topic, data) => this.#onMessage(topic, data),
    });
    this.stream = stream;
    this.#timer = setInterval(() => this.#tick(stream, names === null), TICK_MS);
    void stream.ended.then((end) => this.#onEnd(stream, end));
  }

  #receive(): void {
    this.phase = 'receiving';
    this.#heardAt = performance.now();
    this.announcer.announce(`Receiving from ${this.address}.`);
    this.#host.requestUpdate();
  }

  #onMessage(topic: Offered, data: Uint8Array): void {
    this.#heardAt = performance.now();
    const message = messageOf(topic, data);
    if (kindOf(topic) === 'camera') this.#camera ??= message;
    const kind = mapSourceOf(message);
    if (kind && (!this.#source || RANKS[kind] > RANKS[this.#source.kind])) this.#grow(topic, kind);
    if (topic === this.#source?.topic) this.growth?.take(message);
  }

  /** Begins a map of these messages. */
  #grow(topic: Offered, kind: MapSource): void {
    this.#source = { topic, kind };
    this.growth?.dispose();
    const hooks = {
      changed: () => this.#host.requestUpdate(),
      problem: (problem: string) => {
        this.mapProblem = problem;
      },
    };
    this.growth = kind === 'scans' ? new PlanarGrowth(hooks) : new SpatialGrowth(hooks, () => this.#camera);
    if (kind !== 'scans') void import('../spatial/map3d.js');
  }

  #tick(stream: LiveStream, isAll: boolean): void {
    if (this.phase === 'connecting' && stream.protocol) {
      this.phase = 'choosing';
      if (isAll) this.#receive();
      else this.announcer.announce(`Connected to ${this.address}. Choose topics.`);
    }
    const counts = [...this.#counts, stream.numMessages].slice(-RATE_TICKS - 1);
    this.#counts = counts;
    const seconds = ((counts.length - 1) * TICK_MS) / 1000;
    this.rate = seconds > 0 ? ((counts.at(-1) ?? 0) - (counts[0] ?? 0)) / seconds : 0;
    const silence = this.phase === 'receiving' ? performance.now() - this.#heardAt : 0;
    if (silence > SILENCE_MS && this.silence === 0) this.announcer.announce('No messages come; still listening.');
    this.silence = silence > SILENCE_MS ? silence : 0;
    this.#host.requestUpdate();
  }

  async #onEnd(stream: LiveStream, end: End): Promise<void> {
    clearInterval(this.#timer);
    // That the policy of the page forbids a connection is told after that has failed.
    await new Promise((resolve) => setTimeout(resolve));
    this.growth?.dispose();
    [this.phase, this.end, this.silence] = ['ended', end, 0];
    if (stream.numMessages > 0) this.recording = this.#spool.file(RECORDING);
    else if (!end.isWhole) this.problem = this.#refusal(end.reason);
    this.announcer.announce(`${this.address}: ${printable(end.reason)}.`);
    this.#host.requestUpdate();
    if (this.recording) this.#kept(this.recording);
    this.#next?.();
    this.#next = null;
  }

  #refusal(reason: string): AddressProblem {
    if (this.#isForbidden) {
      const problem = `The policy of this page forbids connections to ${this.address}, so that nothing leaves this machine`;
      return { problem, remedy: WAY_AROUND };
    }
    const remedy = this.stream?.protocol
      ? 'Give the address of a Foxglove bridge or of rosbridge with rosapi'
      : 'Is the bridge running, and is this its address and port? A firewall may be in the way, or the browser, which asks whether a page may look into this network';
    return { problem: `No stream from ${this.address}: ${printable(reason)}`, remedy };
  }
}

/** Where the policy of the page forbids a connection, Chromium tells of an error alone, and of no end. */
function openSocket(url: string, protocols: readonly string[]): Socket {
  const socket = new WebSocket(url, [...protocols]);
  let hasEnded = false;
  socket.addEventListener('close', () => {
    hasEnded = true;
  });
  socket.addEventListener('error', () => {
    setTimeout(() => hasEnded || socket.dispatchEvent(new CloseEvent('close', { code: 1006 })));
  });
  return socket as unknown as Socket;
}
