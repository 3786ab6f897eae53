import { html, type TemplateResult } from 'lit';

/** A table of numbers, the first column its rows' heads. */
export function numberTable(
  columns: readonly string[],
  rows: readonly (readonly (string | number)[])[],
  style = '',
): TemplateResult {
  return html`<table class="number ${style}">
    <thead>
      <tr>
        ${columns.map((column) => html`<th scope="col">${column}</th>`)}
      </tr>
    </thead>
    <tbody>
      ${rows.map(
        ([head, ...cells]) =>
          html`<tr>
            <th scope="row">${head}</th>
            ${cells.map((cell) => html`<td>${cell}</td>`)}
          </tr>`,
      )}
    </tbody>
  </table>`;
}
