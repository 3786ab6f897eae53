import { html, nothing, type TemplateResult } from 'lit';
import { icon, type IconName } from './icons.js';

/** A button that shows a sign alone: `label` is what it is called, `hint` the tooltip. */
export function iconButton(
  sign: IconName,
  label: string,
  press: (event: Event) => void,
  { hint = '', kind = 'quiet', size = 16, isOff = false } = {},
): TemplateResult {
  return html`<button
    type="button"
    class="icon ${kind}"
    aria-label=${label}
    title=${hint || nothing}
    ?disabled=${isOff}
    @click=${press}
  >
    ${icon(sign, size)}
  </button>`;
}
