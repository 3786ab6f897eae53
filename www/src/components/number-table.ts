import { css, html, nothing, type TemplateResult } from 'lit';

/** A table of numbers, the first column its rows' heads. `styles`: figureStyles. */
export function numberTable(
  columns: readonly string[],
  rows: readonly (readonly (string | number)[])[],
  label = '',
): TemplateResult {
  return html`<table class="number figures" aria-label=${label || nothing}>
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

export const figureStyles = css`
  .scroll {
    overflow-x: auto;
  }
  table.figures {
    width: 100%;
    border-collapse: collapse;
    font-size: calc(11.5 * var(--px));
  }
  .figures th,
  .figures td {
    padding: 2px 3px;
    text-align: right;
    font-weight: 400;
    white-space: nowrap;
  }
  .figures thead th {
    color: var(--muted);
  }
`;
