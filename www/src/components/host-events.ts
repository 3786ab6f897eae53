/** The events that the element fires for the page that contains it. */
import type { ScanstitchEvents } from '../../../package/element.js';
import type { Message } from './messages.js';

export type {
  ScanstitchFault,
  ScanstitchMapPoints,
  ScanstitchProgress,
  ScanstitchResult,
} from '../../../package/element.js';

export function tellHost<K extends keyof ScanstitchEvents>(
  from: EventTarget,
  type: K,
  detail: ScanstitchEvents[K],
): void {
  from.dispatchEvent(new CustomEvent(type, { detail, bubbles: true, composed: true }));
}

/** An error that is shown in the element is an event as well. */
export function tellFault(from: EventTarget, { file, place, text, remedy }: Omit<Message, 'kind'>): void {
  tellHost(from, 'scanstitch-error', { file, place, message: text, remedy });
}
