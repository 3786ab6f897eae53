/** The line above the map that tells what was replaced, with the way back. */
import { css, html, nothing, type TemplateResult } from 'lit';
import { iconButton } from '../components/icon-button.js';
import type { Former, Shelf } from './run-kind.js';
import { cut, row } from '../components/theme.js';

/** `title`: of what is shown. `styles`: barStyles. */
export function exchangeBar(title: string, former: Former, shelf: Shelf): TemplateResult {
  const { title: other, isUndone, canJoin } = former;
  const replaced =
    title === other ? 'The files opened last replaced those before.' : html`<b>${title}</b> replaced <b>${other}</b>.`;
  return html`<section class="bar" aria-label="Replaced recording">
    <p>${isUndone ? html`<b>${title}</b> is open again.` : replaced}</p>
    <button @click=${() => shelf.exchange()}>${isUndone ? `Redo: open ${other}` : 'Undo'}</button>
    ${canJoin ? html`<button @click=${() => shelf.addInstead()}>Add instead</button>` : nothing}
    ${iconButton('close', `Dismiss; ${other} is closed`, () => shelf.forgetFormer(), { hint: 'Dismiss' })}
  </section>`;
}

export const barStyles = css`
  .bar {
    ${row};
    flex: none;
    gap: 8px;
    padding: 4px 8px 4px 16px;
    border-bottom: 1px solid var(--line);
    background: var(--accent-soft);
    font-size: calc(13 * var(--px));
  }
  .bar p {
    ${cut};
    min-width: 0;
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
