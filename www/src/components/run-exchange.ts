/** Two recordings of a view: the one that is shown, and the one that stepped aside for it and can be brought back as it is. */
import { css, html, nothing, type TemplateResult } from 'lit';
import { icon } from './icons.js';

/** A session as far as it can step aside. */
interface Exchangeable {
  readonly phase: string;
  readonly dataset: unknown;
  readonly snapshot: unknown;
  stop(): void;
  end(): void;
}

/** A recording of the other kind of run, which another view shows. */
export interface Elsewhere {
  title: string;
  /** Whether it was gone back from, rather than replaced. */
  is_undone: boolean;
}

export class RunExchange<Session extends Exchangeable> {
  /** What stepped aside; null where nothing did. */
  other: Session | null = null;
  /** Whether the one that is shown was brought back, and the other one came after it. */
  is_undone = false;

  /** `session` steps aside, and stops. What stepped aside before it is gone. */
  stepAside(session: Session): void {
    if (session.phase === 'running' || session.phase === 'reading') session.stop();
    this.forget();
    this.other = session;
  }

  /** The other one, for which `session` steps aside. */
  swap(session: Session): Session {
    const { other } = this;
    if (!other) return session;
    if (session.phase === 'running' || session.phase === 'reading') session.stop();
    this.other = session;
    this.is_undone = !this.is_undone;
    return other;
  }

  /** The other one, for good: `session` ends. */
  giveBack(session: Session): Session {
    const { other } = this;
    if (!other) return session;
    session.end();
    this.other = null;
    this.is_undone = false;
    return other;
  }

  forget(): void {
    this.other?.end();
    this.other = null;
    this.is_undone = false;
  }
}

export interface ExchangeBar {
  /** Of what is shown, and of what is not. */
  title: string;
  other: string;
  is_undone: boolean;
  swap(): void;
  /** Null where the files cannot join the recording before. */
  addInstead: (() => void) | null;
  /** Null where another view keeps it. */
  forget: (() => void) | null;
}

/** One line above the map. `styles`: bar_styles. */
export function exchangeBar({ title, other, is_undone, swap, addInstead, forget }: ExchangeBar): TemplateResult {
  const replaced =
    title === other ? 'The files opened last replaced those before.' : html`<b>${title}</b> replaced <b>${other}</b>.`;
  return html`<section class="bar" aria-label="Replaced recording">
    <p>${is_undone ? html`<b>${title}</b> is open again.` : replaced}</p>
    <button @click=${swap}>${is_undone ? `Redo: open ${other}` : 'Undo'}</button>
    ${addInstead ? html`<button @click=${addInstead}>Add instead</button>` : nothing}
    ${
      forget
        ? html`<button class="quiet icon" aria-label="Dismiss; ${other} is closed" title="Dismiss" @click=${forget}>
            ${icon('close')}
          </button>`
        : nothing
    }
  </section>`;
}

export const bar_styles = css`
  .bar {
    display: flex;
    flex: none;
    align-items: center;
    gap: 8px;
    padding: 4px 8px 4px 16px;
    border-bottom: 1px solid var(--line);
    background: var(--accent-soft);
    font-size: calc(13 * var(--px));
  }
  .bar p {
    overflow: hidden;
    min-width: 0;
    text-overflow: ellipsis;
    white-space: nowrap;
  }
  .bar b {
    font-weight: 600;
  }
  .bar button {
    flex: none;
    max-width: 50%;
    min-height: 28px;
    overflow: hidden;
  }
  .bar .icon {
    margin-left: auto;
    min-height: 32px;
  }
  .narrow .bar {
    flex-wrap: wrap;
    padding: 4px 4px 4px 12px;
  }
  .narrow .bar p {
    flex: 1 1 100%;
  }
`;
