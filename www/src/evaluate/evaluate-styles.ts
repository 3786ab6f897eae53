import { css } from 'lit';

/** Of the view as a whole. */
export const evaluate_styles = css`
  .evaluate {
    position: relative;
    display: flex;
    flex-direction: column;
    gap: 10px;
    min-height: 100%;
    padding: 10px;
  }
  .problems {
    display: grid;
    gap: 4px;
  }
  .problems li {
    display: flex;
    align-items: start;
    gap: 8px;
    padding: 7px 10px;
    border-radius: var(--radius);
    background: var(--surface);
    font-size: 13px;
    overflow-wrap: anywhere;
  }
  .problems li svg {
    margin-top: 2px;
  }
  .problem,
  .problems .problem {
    color: var(--doubtful);
    background: var(--doubtful-soft);
  }
  .empty {
    display: flex;
    flex-direction: column;
    align-items: center;
    gap: 14px;
    max-width: 560px;
    margin: auto;
    padding: 32px 28px;
    border: 1.5px dashed var(--line-strong);
    border-radius: 14px;
    background: var(--surface);
    text-align: center;
  }
  .empty h2 {
    font-size: 18px;
  }
  .empty .problem {
    padding: 6px 12px;
    border-radius: var(--radius);
  }
`;

/** Of the bar of choices. */
export const controls_styles = css`
  :host {
    display: block;
    container-type: inline-size;
  }
  .controls {
    display: flex;
    flex-wrap: wrap;
    align-items: end;
    gap: 8px 12px;
    padding: 10px 12px;
    border: 1px solid var(--line);
    border-radius: var(--radius);
    background: var(--surface);
  }
  label {
    display: grid;
    gap: 3px;
    min-width: 0;
    color: var(--muted);
    font-size: 12px;
  }
  label.check {
    display: flex;
    align-items: center;
    gap: 6px;
    min-height: 32px;
  }
  select,
  input[type='number'] {
    min-height: 32px;
    max-width: 200px;
    padding: 0 8px;
    border: 1px solid var(--line-strong);
    border-radius: 7px;
    background: var(--surface);
    color: var(--text);
    font-size: 13px;
  }
  input[type='number'] {
    width: 90px;
  }
  .actions {
    display: flex;
    gap: 6px;
    margin-left: auto;
  }
  .beside {
    display: flex;
    flex-basis: 100%;
    flex-wrap: wrap;
    gap: 6px;
  }
  .beside li {
    display: flex;
    align-items: center;
    gap: 6px;
    padding-left: 10px;
    border: 1px solid var(--line);
    border-radius: 999px;
    font-size: 12px;
  }
  .beside button {
    min-height: 26px;
    width: 26px;
    border-radius: 50%;
  }
  .beside label.check {
    min-height: 26px;
  }
  @container (max-width: 560px) {
    .controls > label:not(.check) {
      flex: 1 1 calc(50% - 6px);
    }
    .controls select,
    .controls input[type='number'] {
      width: 100%;
      max-width: none;
    }
    .actions {
      flex-basis: 100%;
    }
    .actions button {
      flex: 1;
    }
  }
`;

/** Of every box with a heading. */
export const section_styles = css`
  section {
    position: relative;
    display: flex;
    flex-direction: column;
    min-width: 0;
    border: 1px solid var(--line);
    border-radius: var(--radius);
    background: var(--surface);
  }
  section > header {
    display: flex;
    flex-wrap: wrap;
    align-items: center;
    gap: 4px 10px;
    min-height: 40px;
    padding: 4px 6px 0 12px;
  }
  header .muted {
    font-size: 12px;
  }
  .save {
    display: flex;
    margin-left: auto;
  }
  .save button,
  .looks button {
    min-height: 28px;
    padding: 0 8px;
    color: var(--muted);
    font-size: 12px;
  }
  .looks {
    display: flex;
  }
  .looks button.icon {
    width: 28px;
    padding: 0;
  }
  .looks button[aria-pressed='true'] {
    background: var(--accent-soft);
    color: var(--accent);
  }
`;

/** Of the figures. */
export const figures_styles = css`
  :host {
    display: block;
    container-type: inline-size;
  }
  .grid {
    display: grid;
    grid-template-columns: repeat(12, 1fr);
    gap: 10px;
  }
  .grid > section {
    grid-column: span 6;
  }
  .paths {
    grid-row: span 2;
  }
  .over {
    color: var(--muted);
    font-size: 12px;
  }
  .over select {
    min-height: 28px;
    border: 1px solid var(--line);
    border-radius: 7px;
    background: var(--surface);
    color: var(--text);
    font-size: 12px;
  }
  .paths scanstitch-figure {
    flex: 1;
    min-height: 420px;
  }
  .errors scanstitch-figure,
  .histogram scanstitch-figure {
    height: 210px;
  }
  .positions scanstitch-figure,
  .angles scanstitch-figure {
    height: 400px;
  }
  .readout {
    position: absolute;
    left: 64px;
    bottom: 44px;
    padding: 2px 8px;
    border-radius: 6px;
    background: color-mix(in srgb, var(--surface) 88%, transparent);
    font-size: 12px;
    pointer-events: none;
  }
  @container (max-width: 900px) {
    .grid > section {
      grid-column: span 12;
    }
    .paths scanstitch-figure {
      min-height: 340px;
    }
  }
`;

/** Of tables of figures: with `table_styles`. */
export const ranking_styles = css`
  :host {
    display: block;
  }
  .scroll {
    /* Also for words that are only heard: they stand inside the table. */
    position: relative;
    overflow-x: auto;
  }
  th,
  td {
    padding: 3px 8px;
    white-space: nowrap;
  }
  thead th {
    border-top: 0;
    color: var(--muted);
    font-size: 12px;
    font-weight: 600;
  }
  tbody th {
    font-weight: inherit;
  }
  th button {
    min-height: 26px;
    padding: 0 2px;
    font-weight: 600;
  }
  .name {
    text-align: left;
  }
  td.name button {
    color: var(--text);
    text-decoration: none;
  }
  td.name i {
    flex: none;
    width: 10px;
    height: 10px;
    border-radius: 50%;
  }
  .ranking tbody tr:not(.refused) {
    cursor: pointer;
  }
  .ranking tbody tr:not(.refused):hover {
    background: var(--sunken);
  }
  tbody tr.selected {
    background: var(--accent-soft);
  }
  tr.selected .name button {
    font-weight: 650;
  }
  td.why {
    color: var(--doubtful);
    text-align: left;
    white-space: normal;
    min-width: 260px;
  }
  td.why svg {
    display: inline;
    margin-right: 6px;
    vertical-align: -2px;
  }
  p {
    padding: 4px 12px 10px;
  }
  p.problem {
    display: flex;
    gap: 8px;
    color: var(--doubtful);
  }
`;
