/** How the parts of a run lie around its map, in each of the page's layouts. */
import { css } from 'lit';
import { column, cut, fill, row, wrap } from '../components/theme.js';

/** The current activity, in a line. */
export const activityStyles = css`
  .activity {
    ${row};
    flex: 1 1 260px;
    gap: 12px;
    min-width: 0;
  }
  .activity > span {
    ${cut};
  }
  .app > .activity,
  .middle > .activity {
    flex: none;
    padding: 4px 12px;
    border-block: 1px solid var(--line);
    background: var(--surface);
  }
  progress {
    flex: 1;
    min-width: 60px;
    height: 5px;
    border: 0;
    border-radius: 3px;
    overflow: hidden;
    appearance: none;
    background: var(--line);
    color: var(--accent);
  }
  progress::-webkit-progress-bar {
    background: var(--line);
  }
  progress::-webkit-progress-value {
    background: var(--accent);
  }
  progress::-moz-progress-bar {
    background: var(--accent);
  }
`;

/** Within a view of a run: figures, settings, map, table, details. */
export const layoutStyles = css`
  :host {
    display: contents;
  }
  .run {
    ${column};
    ${fill};
  }
  scanstitch-headline {
    border-bottom: 1px solid var(--line);
  }
  main {
    display: grid;
    ${fill};
  }
  main {
    grid-template-columns: auto minmax(0, 1fr) auto;
  }
  .middle {
    grid-column: 2;
  }
  .left {
    width: calc(284 * var(--px));
  }
  .right {
    width: calc(330 * var(--px));
  }
  .narrow main {
    grid-template-columns: minmax(0, 1fr);
    grid-template-rows: minmax(0, 11fr) minmax(0, 9fr);
  }
  .narrow main:not(:has([role='tabpanel'])) {
    grid-template-rows: minmax(0, 1fr) auto;
  }
  .narrow .middle {
    grid-column: 1;
  }
  .side.alone {
    flex: none;
    width: min(100%, 460px);
    max-height: 40%;
    margin: 0 auto 32px;
  }
  .side {
    min-height: 0;
    overflow: auto;
    background: var(--surface);
  }
  .left {
    border-right: 1px solid var(--line);
  }
  .right,
  .tabs {
    border-left: 1px solid var(--line);
  }
  .tabs {
    ${column};
    overflow: hidden;
  }
  .narrow .tabs {
    border-left: 0;
    border-top: 1px solid var(--line);
  }
  .tab-bar {
    ${row};
    flex: none;
    padding: 0 8px;
    border-bottom: 1px solid var(--line);
  }
  [role='tablist'] {
    display: flex;
    flex: 1;
    min-width: 0;
  }
  .fold {
    color: var(--muted);
  }
  .fold[aria-expanded='false'] svg {
    transform: rotate(180deg);
  }
  [role='tab'] {
    flex: 1;
    min-height: 42px;
    padding: 0 6px;
    border: 0;
    border-radius: 0;
    background: none;
    color: var(--muted);
    box-shadow: inset 0 -2px transparent;
  }
  [role='tab'][aria-selected='true'] {
    color: var(--text);
    font-weight: 600;
    box-shadow: inset 0 -2px var(--accent);
  }
  [role='tab']:focus-visible {
    outline-offset: -3px;
  }
  [role='tabpanel'] {
    ${fill};
    overflow: auto;
  }
  .middle {
    ${column};
    min-width: 0;
    min-height: 0;
  }
  /* A question is beside the map, or below it where there is little room. */
  .map-area {
    position: relative;
    display: grid;
    grid-template: 'map question' minmax(0, 1fr) / minmax(0, 1fr) auto;
    ${fill};
  }
  .map-area > :first-child {
    grid-area: map;
  }
  @container (max-width: 600px) {
    .map-area {
      grid-template: 'map' minmax(0, 1fr) 'question' auto / minmax(0, 1fr);
    }
  }
  .below {
    ${wrap};
    gap: 4px 14px;
    padding: 5px 12px;
    border-top: 1px solid var(--line);
    background: var(--surface);
  }
  .low .below {
    padding-block: 2px;
  }
  scanstitch-timeline {
    flex: 1 1 180px;
    min-width: 0;
  }
  .folds {
    display: flex;
    gap: 2px;
  }
  .folds button {
    padding: 0 10px;
    color: var(--muted);
  }
  .folds [aria-expanded='true'] {
    background: var(--accent-soft);
    color: var(--accent);
    font-weight: 600;
  }
  scanstitch-frame-table {
    flex: none;
    max-height: clamp(140px, 34cqh, 310px);
    border-top: 1px solid var(--line);
    background: var(--surface);
  }
  .spatial scanstitch-frame-table {
    --cell-padding: 7px;
    max-height: clamp(110px, 25cqh, 240px);
  }
  .middle {
    container-type: size;
  }
  /* In a panel of its own that scrolls, as on a phone, a figure may take two lines. */
  .run [role='tabpanel'] scanstitch-headline {
    --value-wrap: normal;
  }
  .run [role='tabpanel'] scanstitch-frame-table {
    max-height: 100%;
    border-top: 0;
  }
  /* Above the map, not on it. */
  .middle > scanstitch-messages {
    ${column};
    flex: none;
    max-height: 36%;
  }
  .empty {
    ${row};
    ${fill};
    flex-direction: column;
    gap: 16px;
    padding: 24px;
    overflow: auto;
  }
  .empty scanstitch-messages {
    position: static;
    width: min(460px, 100%);
    max-height: none;
  }
  .empty section {
    display: grid;
    justify-items: center;
    gap: 12px;
    max-width: 460px;
    margin: auto 0;
  }
`;
