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

/** The head of a column that the rows can be sorted by. `isDescending`: null where they are sorted by another one. */
export function sortHead(
  label: string,
  hint: string,
  isDescending: boolean | null,
  sort: (isDescending: boolean) => void,
): TemplateResult {
  const order = isDescending === null ? 'none' : isDescending ? 'descending' : 'ascending';
  return html`<th scope="col" aria-sort=${order}>
    <button class="quiet" title=${hint} @click=${() => sort(isDescending === false)}>
      ${label}${{ descending: ' ▾', ascending: ' ▴', none: '' }[order]}
    </button>
  </th>`;
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
