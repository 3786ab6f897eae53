/** Fields of forms, each with what is to be done with its new value. */
import { html, nothing, type TemplateResult } from 'lit';

/** What was typed or chosen in the field that an event is about. */
export const typed = (event: Event): string => (event.target as HTMLInputElement).value;

/** A box to tick, and its words. `kind`: the class of the label. */
export function check(
  words: unknown,
  isOn: boolean,
  take: (isOn: boolean) => void,
  { kind = '', hint = '' } = {},
): TemplateResult {
  const onChange = ({ target }: Event): void => take((target as HTMLInputElement).checked);
  return html`<label class=${kind || nothing} title=${hint || nothing}
    ><input type="checkbox" .checked=${isOn} @change=${onChange} />${words}</label
  >`;
}

/** A slider; `words`: what its value says to those who do not see it. */
export function slider(
  value: number,
  { label = '', min = 0, max = 1, step = 1 as number | 'any', words = '', isOff = false },
  take: (value: number) => void,
): TemplateResult {
  return html`<input
    type="range"
    min=${min}
    max=${max}
    step=${step}
    .value=${String(value)}
    ?disabled=${isOff}
    aria-label=${label || nothing}
    aria-valuetext=${words || nothing}
    @input=${(event: Event) => take(Number(typed(event)))}
  />`;
}
