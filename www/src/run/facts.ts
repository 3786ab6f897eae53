import { html, nothing, type TemplateResult } from 'lit';

/** A fact, and what its name means. Null: it is not known, and left out. */
type Fact = readonly [name: string, value: unknown, meaning?: string] | null | false;

/** Facts, one a line: a name and a value each. */
export function facts(all: readonly Fact[], kind = 'facts number'): TemplateResult {
  return html`<dl class=${kind}>
    ${all.map((fact) => {
      if (!fact) return nothing;
      const [name, value, meaning] = fact;
      return html`<dt>${meaning ? html`<abbr title=${meaning}>${name}</abbr>` : name}</dt>
        <dd>${value}</dd>`;
    })}
  </dl>`;
}
