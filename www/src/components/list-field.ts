import { html, nothing, type TemplateResult } from 'lit';

/** What a list offers: the values, and what they are called. */
export type Choices<T extends string | number = string> =
  readonly (readonly [value: T, words: unknown])[] | (T extends string ? Readonly<Partial<Record<T, string>>> : never);

/** A list to choose from. `label`: where no label stands around it. */
export function list<T extends string | number>(
  choices: Choices<T>,
  present: T | null | undefined,
  take: (value: T) => void,
  { label = '', hint = '', isOff = false } = {},
): TemplateResult {
  const all = (Array.isArray(choices) ? choices : Object.entries(choices)) as [T, unknown][];
  const onChange = ({ target }: Event): void => {
    const [value] = all[(target as HTMLSelectElement).selectedIndex] ?? [];
    if (value !== undefined) take(value);
  };
  return html`<select aria-label=${label || nothing} title=${hint || nothing} ?disabled=${isOff} @change=${onChange}>
    ${all.map(([value, words]) => html`<option value=${value} .selected=${value === present}>${words}</option>`)}
  </select>`;
}
