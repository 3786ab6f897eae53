/** Fields of the panel beside the map. */
import { css, html, nothing, type TemplateResult } from 'lit';
import type { Place } from './grid-tools.js';

/** Buttons of which one is pressed. */
export function choice<T extends string>(
  label: string,
  options: readonly (readonly [T, string, string?])[],
  chosen: T,
  take: (option: T) => void,
): TemplateResult {
  return html`<div class="choice" role="group" aria-label=${label}>
    ${options.map(
      ([option, words, hint]) =>
        html`<button aria-pressed=${option === chosen} title=${hint ?? nothing} @click=${() => take(option)}>
          ${label === 'Paint as' ? html`<i class="cell ${option}"></i>` : nothing}${words}
        </button>`,
    )}
  </div>`;
}

export function number(
  label: string,
  name: string,
  value: number | null,
  take?: (value: number) => void,
): TemplateResult {
  return html`<label
    >${label}<input
      type="number"
      step="any"
      aria-label=${name}
      .value=${value === null ? '' : String(value)}
      @change=${({ target }: Event) => take?.((target as HTMLInputElement).valueAsNumber)}
  /></label>`;
}

export function numbersOf(event: SubmitEvent): number[] {
  const inputs = (event.target as HTMLFormElement).querySelectorAll('input');
  return [...inputs].map((input) => input.valueAsNumber);
}

/** Coordinates of a point, typed. `name`: what it is; `action`: on the button that takes it. */
export function pointForm(name: string, action: string, take: (place: Place) => void): TemplateResult {
  return html`<form
    class="fields"
    @submit=${(event: SubmitEvent) => {
      event.preventDefault();
      const [x = NaN, y = NaN] = numbersOf(event);
      if (!Number.isFinite(x) || !Number.isFinite(y)) return;
      take([x, y]);
      (event.target as HTMLFormElement).reset();
    }}
  >
    ${number(`${name} x`, `${name} x (m)`, null)} ${number('y', `${name} y (m)`, null)}
    <button>${action}</button>
  </form>`;
}

export const fieldStyles = css`
  .choice {
    display: flex;
    flex-wrap: wrap;
    gap: 4px;
  }
  .choice button {
    flex: 1 0 auto;
    gap: 4px;
    min-width: 0;
    padding-inline: 2px;
    font-size: calc(12.5 * var(--px));
  }
  .choice button[aria-pressed='true'] {
    border-color: var(--accent);
    box-shadow: inset 0 0 0 1px var(--accent);
  }
  .cell {
    flex: none;
    width: 11px;
    height: 11px;
    border: 1px solid var(--line-strong);
    background: #fff;
  }
  .cell.occupied {
    background: #141414;
  }
  .cell.unknown {
    background: #8d8d8d;
  }
  .fields label {
    min-width: calc(52 * var(--px));
  }
  .fields button {
    align-self: end;
  }
  /* A number, a place or a word, with its coordinates beside it. */
  .known.fields label {
    display: flex;
    align-items: center;
    gap: 4px;
  }
  .known > span {
    flex: 1 0 100%;
  }
  .fields input {
    appearance: textfield;
    padding-inline: 6px;
  }
`;
