import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { plural, sentence } from '../views/format.js';
import { iconButton } from './icon-button.js';
import { icon } from './icons.js';
import { column, cut, panel, row, shared } from './theme.js';
import { fire } from './fire.js';

/** Something the user should know, about a file or about the whole. */
export interface Message {
  kind: 'error' | 'note';
  /** The file it is about; empty for none. */
  file: string;
  /** "line 12", "byte 4096", or empty. */
  place: string;
  text: string;
  /** Of the box, where it is not about a fault. */
  title?: string;
  /** What to do; empty where nothing can be done. */
  remedy: string;
  /** Does what failed once more, where that may help. */
  retry?: () => void;
}

/**
 * What went wrong or was left out, with the files that it is about, until it is dismissed.
 *
 * Fires `messages-dismissed`.
 */
@customElement('scanstitch-messages')
export class ScanstitchMessages extends LitElement {
  @property({ attribute: false }) messages: readonly Message[] = [];
  /** Over the whole width, above what it is about, and notes in one line until they are asked for, but for those with a button. */
  @property({ type: Boolean, reflect: true }) strip = false;

  protected override render(): TemplateResult {
    const { messages } = this;
    const [first] = messages;
    const num_errors = messages.filter(({ kind }) => kind === 'error').length;
    const kind = num_errors > 0 ? 'error' : 'note';
    const isFolded = this.strip && num_errors === 0 && !messages.some(({ retry }) => retry);
    return html`<section class="card ${kind}" aria-label="Messages" ?hidden=${messages.length === 0}>
      <details class="all" ?open=${!isFolded}>
        <summary>
          ${icon(num_errors > 0 ? 'doubtful' : 'info')}
          <h2>${title(messages, num_errors)}</h2>
          <span class="first" aria-hidden="true">${[first?.file, first?.text].filter(Boolean).join(': ')}</span>
        </summary>
        <ul>
          ${alike(messages).map(renderRow)}
        </ul>
      </details>
      ${iconButton('close', 'Dismiss the messages', () => fire(this, 'messages-dismissed'), { hint: 'Dismiss', kind: 'quiet dismiss' })}
    </section>`;
  }

  static override styles = [
    shared,
    css`
      :host {
        pointer-events: none;
      }
      .card {
        position: relative;
        ${column};
        max-height: 100%;
        overflow: auto;
        ${panel};
        border-left: 3px solid var(--accent);
        box-shadow: var(--shadow);
        pointer-events: auto;
      }
      .card.error {
        border-left-color: var(--lost);
      }
      :host([strip]) .card {
        border-width: 0 0 1px 3px;
        border-radius: 0;
        box-shadow: none;
      }
      .all > summary {
        position: sticky;
        top: 0;
        ${row};
        gap: 8px;
        min-height: 36px;
        padding: 2px 44px 2px 12px;
        background: var(--surface);
        color: var(--accent);
        list-style: none;
      }
      .all > summary::-webkit-details-marker {
        display: none;
      }
      .error .all > summary {
        color: var(--lost);
      }
      h2 {
        flex: none;
        color: var(--text);
      }
      .first {
        ${cut};
        min-width: 0;
        color: var(--text);
        font-weight: 400;
      }
      .all[open] .first {
        display: none;
      }
      .dismiss {
        position: absolute;
        top: 2px;
        right: 4px;
        color: var(--muted);
      }
      ul {
        padding: 0 14px 10px 12px;
      }
      li {
        ${column};
        padding: 7px 0;
        border-top: 1px solid var(--line);
        font-size: calc(13 * var(--px));
        overflow-wrap: anywhere;
      }
      strong {
        display: block;
        font-weight: 600;
      }
      summary {
        font-weight: 600;
      }
      details strong {
        font-weight: 400;
      }
      .remedy {
        color: var(--muted);
      }
      .retry {
        width: max-content;
        margin-top: 6px;
      }
    `,
  ];
}

/** Largest number of files whose names are listed in a message. */
const MOST_NAMED = 200;

/** Merges messages that differ only in their file and the numbers in them. */
function alike(messages: readonly Message[]): Message[][] {
  const groups = new Map<string, Message[]>();
  for (const message of messages) {
    const { kind, file, text, remedy } = message;
    const key =
      file === '' ? JSON.stringify(message) : JSON.stringify([kind, text, remedy]).replace(/\d+(\.\d+)?/g, '0');
    const group = groups.get(key);
    if (group) group.push(message);
    else groups.set(key, [message]);
  }
  return [...groups.values()];
}

function renderRow(group: readonly Message[]): TemplateResult | typeof nothing {
  const [first] = group;
  if (!first) return nothing;
  const { kind, text, remedy } = first;
  return html`<li class=${kind}>
    ${
      group.length === 1
        ? heading(first)
        : first.file === ''
          ? html`<strong>${group.length} times</strong>`
          : html`<details>
              <summary>${plural(group.length, 'file')}</summary>
              ${group.slice(0, MOST_NAMED).map(heading)}
              ${group.length > MOST_NAMED ? html`<strong>and ${plural(group.length - MOST_NAMED, 'other')}</strong>` : nothing}
            </details>`
    }
    <span>${sentence(text)}</span>
    ${remedy ? html`<span class="remedy">${sentence(remedy)}</span>` : nothing} ${retryButton(first)}
  </li>`;
}

export function retryButton({ retry }: Message): TemplateResult | typeof nothing {
  return retry ? html`<button class="retry" @click=${retry}>Try again</button>` : nothing;
}

function heading({ file, place }: Message): TemplateResult | typeof nothing {
  return file || place ? html`<strong>${file}${file && place ? ', ' : ''}${place}</strong>` : nothing;
}

function title(messages: readonly Message[], num_errors: number): string {
  const [only] = messages;
  if (messages.length === 1 && only) {
    if (only.title !== undefined) return only.title;
    if (only.kind === 'note') return 'Note';
    return only.file ? 'A file could not be used' : 'Something went wrong';
  }
  const numNotes = messages.length - num_errors;
  const counts = [num_errors > 0 ? plural(num_errors, 'problem') : '', numNotes > 0 ? plural(numNotes, 'note') : ''];
  return counts.filter(Boolean).join(', ');
}
