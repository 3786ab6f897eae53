/** Labelled fields of a form. */
import { html, type TemplateResult } from 'lit';
import { typed } from '../components/fields.js';
import { list } from '../components/list-field.js';

/** `value` is added as a choice if it is not one of the given ones. */
export function select(
  label: string,
  value: string,
  choices: Readonly<Record<string, string>>,
  take: (value: string) => void,
): TemplateResult {
  const known = value in choices ? choices : { ...choices, [value]: value };
  return html`<label>${label} ${list(Object.entries(known), value, take)}</label>`;
}

/** `value` is what it begins with: a number that is only half typed is none, and must not be replaced. */
export function number(label: string, value: string, take: (value: string) => void): TemplateResult {
  return html`<label>
    ${label}
    <input type="number" step="any" value=${value} @input=${(event: Event) => take(typed(event))} />
  </label>`;
}
