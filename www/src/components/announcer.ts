/**
 * What is said to those who listen to the page. Each announcement is added below the ones before it, and none is
 * overwritten: a screen reader queues additions, and would lose a text that is replaced before its turn.
 */
import { html, nothing, type TemplateResult } from 'lit';

/** Older ones are removed from the page; they have long been read. */
const MAX_KEPT = 12;

export class Announcer {
  /** All of them: each keeps its place. */
  texts: readonly string[] = [];
  #onChange: () => void;

  constructor(onChange: () => void) {
    this.#onChange = onChange;
  }

  announce(text: string): void {
    if (text === '') return;
    this.texts = [...this.texts, text];
    this.#onChange();
  }
}

/** The live region; `styles`: shared. */
export function announcements({ texts }: Announcer): TemplateResult {
  return html`<div
    class="visually-hidden"
    role="status"
    aria-live="polite"
    aria-atomic="false"
    aria-relevant="additions"
  >
    ${texts.map((text, at) => (at < texts.length - MAX_KEPT ? nothing : html`<p>${text}</p>`))}
  </div>`;
}
