/**
 * What is said to those who listen to the page. Each announcement is added below the ones before it, and none is
 * overwritten: a screen reader queues additions, and would lose a text that is replaced before its turn.
 */
import { html, type TemplateResult } from 'lit';
import { repeat } from 'lit/directives/repeat.js';

export interface Announcement {
  id: number;
  text: string;
}

/** Older ones are removed; they have long been read. */
const MAX_KEPT = 12;

export class Announcer {
  queue: readonly Announcement[] = [];
  #nextId = 0;
  #onChange: () => void;

  constructor(onChange: () => void) {
    this.#onChange = onChange;
  }

  announce(text: string): void {
    if (text === '') return;
    this.queue = [...this.queue, { id: this.#nextId++, text }].slice(-MAX_KEPT);
    this.#onChange();
  }
}

/** The live region; `styles`: shared. */
export function announcements({ queue }: Announcer): TemplateResult {
  return html`<div
    class="visually-hidden"
    role="status"
    aria-live="polite"
    aria-atomic="false"
    aria-relevant="additions"
  >
    ${repeat(
      queue,
      ({ id }) => id,
      ({ text }) => html`<p>${text}</p>`,
    )}
  </div>`;
}
