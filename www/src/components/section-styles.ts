/** Styles of boxes with a heading and of tables, which several views share. */
import { css } from 'lit';
import { column, fill, panel, small, wrap } from './theme.js';
import { dot } from './panel-theme.js';

/** Of every box with a heading. */
export const sectionStyles = css`
  section {
    position: relative;
    ${column};
    min-width: 0;
    ${panel};
  }
  section > header {
    ${wrap};
    gap: 4px 10px;
    min-height: 40px;
    padding: 4px 6px 0 12px;
  }
  header .muted {
    font-size: calc(12 * var(--px));
  }
  .save {
    display: flex;
    margin-left: auto;
  }
  .save button,
  .looks button {
    min-height: 28px;
    padding: 0 8px;
    ${small};
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

/** Of tables of figures: with `tableStyles`. */
export const rankingStyles = css`
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
    ${small};
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
    ${dot};
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

/** A dialog with groups of fields. */
export const dialogStyles = css`
  dialog {
    max-height: calc(100dvh - 24px);
    padding: 0;
    overflow: auto;
    border: 1px solid var(--line);
    border-radius: 12px;
    background: var(--surface);
    color: var(--text);
    box-shadow: var(--shadow);
  }
  dialog::backdrop {
    background: rgb(10 14 20 / 0.45);
  }
  form {
    display: grid;
    gap: 12px;
    padding: 18px 20px;
  }
  fieldset {
    display: grid;
    min-width: 0;
    margin: 0;
    padding: 6px 12px 10px;
    border: 1px solid var(--line);
    border-radius: var(--radius);
  }
  legend {
    padding: 0 4px;
    font-weight: 600;
  }
`;

/** A view that fills its place, with a bar of its state and buttons at the top. */
export const barStyles = css`
  :host {
    position: relative;
    ${fill};
    background: var(--background);
    container-type: size;
  }
  .whole {
    ${column};
    height: 100%;
  }
  .bar {
    ${wrap};
    flex: none;
    gap: 4px 12px;
    min-height: 44px;
    padding: 4px 12px;
    border-bottom: 1px solid var(--line);
    background: var(--surface);
  }
`;
