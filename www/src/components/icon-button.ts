import { html, nothing, type TemplateResult } from 'lit';
import { icon, type Sign } from './icons.js';

/** What a button with a sign has beside its name. `hint`: the tooltip; `pressed` and `expanded`: of what is switched on or unfolded. */
export interface IconButton {
  hint?: string;
  kind?: string;
  size?: number;
  isOff?: boolean;
  pressed?: boolean;
  expanded?: boolean;
}

/** A button that shows a sign alone: `label` is what it is called. */
export function iconButton(
  sign: Sign,
  label: string,
  press: (event: Event) => void,
  { hint = '', kind = 'quiet', size = 16, isOff = false, pressed, expanded }: IconButton = {},
): TemplateResult {
  return html`<button
    type="button"
    class="icon ${kind}"
    aria-label=${label}
    aria-pressed=${pressed ?? nothing}
    aria-expanded=${expanded ?? nothing}
    title=${hint || nothing}
    ?disabled=${isOff}
    @click=${press}
  >
    ${icon(sign, size)}
  </button>`;
}
