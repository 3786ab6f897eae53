/** What readers of the formats of bags have in common. */
import type { Note } from '../base/errors.js';
import type { MessageIndex } from './message_index.js';

export type StoredTopic = { name: string; type: string; format: string; messages: MessageIndex };
/** Told how far a bag that has no index has been gone through, in bytes. */
export type OnWalk = (done: number, total: number) => void;
/** One file of a bag. Places of messages are those of its topics' indexes. */
export interface Container {
  topics: StoredTopic[];
  notes: Note[];
  read: (place: [number, number]) => Promise<Uint8Array>;
  /** At least so much, where the message has it. */
  readHead: (place: [number, number], length: number) => Promise<Uint8Array>;
}
