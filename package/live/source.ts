/** What servers of robots' topics have in common, whichever protocol they speak. */
import type { WrittenTopic } from '../bag/mcap_writer.js';

/** A topic that a server offers; its encoding is cdr, ros1 or something that is not read. */
export type Offered = WrittenTopic;

/** Told what comes from a server. */
export interface Listener {
  offered: (topic: Offered) => void;
  /** A topic is no longer there; it may come again with another type. */
  gone: (topic: Offered) => unknown;
  /** @param time when the server took it, ns */
  message: (topic: Offered, time: bigint, data: Uint8Array) => void;
  /** What was not understood, a sentence without its full stop. */
  problem: (problem: string) => void;
}

export interface Source {
  subscribe: (topic: Offered) => void;
  /** Asks once more what topics there are, where the protocol does not tell of new ones. */
  ask: () => void;
}

/** What is used of a WebSocket, the browser's or that of the package ws. */
export interface Socket {
  binaryType: string;
  protocol: string;
  onopen: ((event: never) => void) | null;
  onmessage: ((event: { data: unknown }) => void) | null;
  onclose: ((event: { code: number; reason: string }) => void) | null;
  onerror: ((event: never) => void) | null;
  send: (text: string) => void;
  close: () => void;
}

/** Opens a socket; what is wrong with the address is thrown. */
export type OpenSocket = (url: string, protocols: readonly string[]) => Socket;

export const NO_SCHEMA = { encoding: '', data: new Uint8Array() };

/** What a message of a socket is: text, or bytes. */
export function payloadOf(data: unknown): string | Uint8Array {
  if (typeof data === 'string') return data;
  if (data instanceof ArrayBuffer) return new Uint8Array(data);
  if (ArrayBuffer.isView(data)) return new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
  throw new RangeError('it is neither text nor bytes');
}
