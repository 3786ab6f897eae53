/** Parts of a run's view: tabs, progress over the map, messages, and the content before there is a result. */
import { html, nothing, type TemplateResult } from 'lit';
import '../components/messages.js';
import { iconButton } from '../components/icon-button.js';
import { icon } from '../components/icons.js';
import type { Message } from '../components/messages.js';

export type Layout = 'wide' | 'medium' | 'narrow';

/** How the panel of tabs is folded away. */
export interface TabsFold {
  isOpen: boolean;
  toggle(): void;
}

/** Tabs beside or below the map, with the panel of the one that is chosen unless that is folded. `styles`: layoutStyles. */
export function tabs<T extends string>(
  names: readonly { tab: T; label: string }[],
  chosen: T,
  panel: unknown,
  choose: (tab: T) => void,
  fold: TabsFold | null = null,
): TemplateResult {
  const isOpen = fold?.isOpen ?? true;
  const onKey = (event: KeyboardEvent): void => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    const list = event.currentTarget as HTMLElement;
    const at = names.findIndex(({ tab }) => tab === chosen);
    const next = names.at((at + step) % names.length)?.tab ?? chosen;
    choose(next);
    requestAnimationFrame(() => list.querySelector<HTMLElement>(`#tab-${next}`)?.focus());
  };
  return html`<aside class="side tabs" aria-label="Panels">
    <div class="tab-bar">
      <div role="tablist" aria-label="Panels" @keydown=${onKey}>
        ${names.map(
          ({ tab, label }) =>
            html`<button
              role="tab"
              id="tab-${tab}"
              aria-controls=${isOpen ? 'panel' : nothing}
              aria-selected=${isOpen && tab === chosen}
              tabindex=${tab === chosen ? 0 : -1}
              @click=${() => choose(tab)}
            >
              ${label}
            </button>`,
        )}
      </div>
      ${
        fold
          ? html`<button
              class="icon quiet fold"
              aria-expanded=${isOpen}
              aria-label="Panel"
              title=${isOpen ? 'Fold the panel' : 'Unfold the panel'}
              @click=${() => fold.toggle()}
            >
              ${icon('chevron')}
            </button>`
          : nothing
      }
    </div>
    ${isOpen ? html`<div id="panel" role="tabpanel" aria-labelledby="tab-${chosen}">${panel}</div>` : nothing}
  </aside>`;
}

/** Gives the element the whole screen, as on a projector, and takes it away. */
export function fullScreenButton(isOn: boolean, toggle: () => void): TemplateResult {
  const label = isOn ? 'Leave full screen' : 'Full screen';
  return iconButton(isOn ? 'shrink' : 'expand', label, toggle, { hint: label });
}

/** What both kinds of run say of themselves while they go on. */
export interface ActiveSession {
  readonly phase: string;
  readonly activity: string;
  readonly progress: number | null;
  readonly messages: readonly Message[];
  stop(): void;
  resume(): void;
  dismissMessages(): void;
}

/** The current activity with its actions; `isPartial`: frames are missing from the map. */
export function activity(session: ActiveSession, isPartial: boolean): TemplateResult | typeof nothing {
  switch (session.phase) {
    case 'reading':
    case 'running':
      return activityBox(session.activity, session.progress, 'Stop', () => session.stop());
    case 'stopped':
      return activityBox(
        isPartial ? 'Stopped: partial map' : 'Stopped: all registered, not yet optimised',
        null,
        'Continue',
        () => session.resume(),
      );
    case 'crashed':
      return activityBox('Not computed after the crash', null, 'Compute again', () => session.resume());
    default:
      return nothing;
  }
}

/** The messages of the session, until they are dismissed; `isStrip`: above what they are about, not on it. */
export function messages(session: ActiveSession, isStrip = false): TemplateResult {
  return html`<scanstitch-messages
    ?strip=${isStrip}
    .messages=${session.messages}
    @messages-dismissed=${() => session.dismissMessages()}
  ></scanstitch-messages>`;
}

export function activityBox(words: string, progress: number | null, action: string, act: () => void): TemplateResult {
  return html`<div class="activity">
    <span title=${words}>${words}</span>
    ${progress === null ? nothing : html`<progress max="1" .value=${progress} aria-label=${words}></progress>`}
    <button class=${progress === null ? 'primary' : ''} @click=${act}>${action}</button>
  </div>`;
}

/** Shown while nothing is loaded. `choices`: the offered actions, the most likely first; `want` is called with the chosen one. */
export function emptyView(
  given: { title: string; label: string; about: string; choices: readonly { id: string; label: string }[] },
  session: ActiveSession,
  want: (id: string) => void,
): TemplateResult {
  // Fingers drop nothing.
  const isTouch = matchMedia('(pointer: coarse)').matches;
  const title = isTouch ? given.title.replace(/^Drop (.*) here$/, 'Open $1') : given.title;
  return html`<div class="empty">
    ${messages(session)}
    <section aria-label=${given.label}>
      ${icon('open', 32)}
      <h2>${title}</h2>
      <p>${given.about}</p>
      <p class="actions">
        ${given.choices.map(
          ({ id, label }, index) =>
            html`<button class=${index === 0 ? 'primary' : ''} @click=${() => want(id)}>${label}</button>`,
        )}
      </p>
      <p class="muted">Everything is computed in this tab. Nothing leaves your machine.</p>
    </section>
  </div>`;
}
