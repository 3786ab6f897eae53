/** What panels and views share that are loaded after the map. */
import { css } from 'lit';
import { column, cut, row } from './theme.js';

export const note = css`
  color: var(--muted);
  font-size: calc(12.5 * var(--px));
`;

export const doubt = css`
  color: var(--doubtful);
  background: var(--doubtful-soft);
`;

/** Of one colour of a legend. */
export const dot = css`
  flex: none;
  width: 10px;
  height: 10px;
  border-radius: 50%;
`;

/** A frame's status is never shown by colour alone: each has its own symbol and word. */
export const statusStyles = css`
  .status {
    display: inline-flex;
    align-items: center;
    gap: 5px;
    padding: 1px 8px 1px 6px;
    border-radius: 99px;
    font-size: calc(12 * var(--px));
    font-weight: 550;
    white-space: nowrap;
  }
  .status.good {
    color: var(--good);
    background: var(--good-soft);
  }
  .status.doubtful {
    color: var(--doubtful);
    background: var(--doubtful-soft);
  }
  .status.lost {
    color: var(--lost);
    background: var(--lost-soft);
  }
`;

/** What stands beside the map: a heading, words, charts below each other. */
export const panelStyles = css`
  :host {
    ${column};
    gap: 12px;
    padding: 14px 16px 24px;
    overflow-wrap: anywhere;
  }
  header {
    ${row};
    gap: 8px;
    min-height: 32px;
  }
  header h2 {
    ${cut};
  }
  section {
    ${column};
    gap: 4px;
  }
  .explanation {
    ${note};
  }
  .swatch {
    flex: none;
    width: 12px;
    height: 12px;
    border-radius: 50%;
  }
  abbr {
    text-decoration: underline dotted;
    text-underline-offset: 2px;
  }
`;

/** A view that fills the page below the header and scrolls. */
export const pageStyles = css`
  :host {
    flex: 1;
    min-height: 0;
    overflow: auto;
    background: var(--background);
  }
`;

/** A table of figures, with thin lines between its rows. */
export const tableStyles = css`
  table {
    width: 100%;
    border-collapse: collapse;
    font-size: calc(13 * var(--px));
    font-variant-numeric: tabular-nums;
  }
  th,
  td {
    padding: 2px 8px;
    border-top: 1px solid var(--line);
    text-align: right;
  }
`;

/** Of lists to choose from and of numbers, in a bar of choices. */
export const fieldStyles = css`
  select,
  input[type='number'] {
    max-width: 240px;
    color: var(--text);
    font-size: calc(13 * var(--px));
  }
`;
