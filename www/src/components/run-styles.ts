/** How the parts of a run lie around its map, in each of the page's layouts. */
import { css } from 'lit';

/** The current activity, in a box over the content. */
export const activityStyles = css`
  .activity {
    position: absolute;
    z-index: 1; /* over messages, where the map is low */
    bottom: 14px;
    left: 50%;
    display: grid;
    gap: 8px;
    width: min(340px, calc(100% - 32px));
    padding: 10px 12px;
    border: 1px solid var(--line);
    border-radius: var(--radius);
    background: var(--surface);
    box-shadow: var(--shadow);
    transform: translateX(-50%);
  }
  /* The scale bar lies in the corner: above the buttons, where there is no room beside them. */
  @container (max-width: 720px) {
    .activity {
      bottom: 52px;
    }
  }
  /* The map's buttons, in two columns where it is low, stay free. */
  @container (max-width: 560px) {
    .activity {
      left: 12px;
      width: min(340px, calc(100% - 110px));
      transform: none;
    }
  }
  @container (max-width: 560px) and (max-height: 260px) {
    .activity {
      width: calc(100% - 150px);
    }
  }
  .activity-words {
    display: flex;
    align-items: center;
    justify-content: space-between;
    gap: 12px;
  }
  progress {
    width: 100%;
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
    display: flex;
    flex: 1;
    flex-direction: column;
    min-height: 0;
  }
  scanstitch-headline {
    border-bottom: 1px solid var(--line);
  }
  main {
    display: grid;
    flex: 1;
    min-height: 0;
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
    display: flex;
    flex-direction: column;
    overflow: hidden;
  }
  .narrow .tabs {
    border-left: 0;
    border-top: 1px solid var(--line);
  }
  .tab-bar {
    display: flex;
    flex: none;
    align-items: center;
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
    flex: 1;
    min-height: 0;
    overflow: auto;
  }
  .middle {
    display: flex;
    flex-direction: column;
    min-width: 0;
    min-height: 0;
  }
  .map-area {
    position: relative;
    display: grid;
    flex: 1;
    min-height: 0;
  }
  .map-area:has(> .aside) {
    grid-template: minmax(0, 1fr) / minmax(0, 1fr) auto;
  }
  @container (max-width: 640px) {
    .map-area:has(> .aside) {
      grid-template: minmax(0, 1fr) auto / minmax(0, 1fr);
    }
  }
  .below {
    display: flex;
    align-items: center;
    gap: 14px;
    padding: 5px 12px;
    border-top: 1px solid var(--line);
    background: var(--surface);
  }
  .low .below {
    padding-block: 2px;
  }
  scanstitch-timeline {
    flex: 1;
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
    display: flex;
    flex: none;
    flex-direction: column;
    max-height: 36%;
  }
  .empty {
    display: flex;
    flex: 1;
    flex-direction: column;
    align-items: center;
    gap: 16px;
    min-height: 0;
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
