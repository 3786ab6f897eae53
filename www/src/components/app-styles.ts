/** How the parts of the page lie beside and below each other, in each of its three layouts. */
import { css } from 'lit';

export const app_styles = css`
  :host {
    display: grid;
    grid-template: minmax(0, 1fr) fit-content(40%) / minmax(0, 1fr) fit-content(40%);
    position: relative;
    height: min(90vh, 760px);
    overflow: hidden;
    background: var(--background);
    color-scheme: light dark;
    text-align: left;
  }
  :host([theme='light']) {
    color-scheme: light;
  }
  :host([theme='dark']) {
    color-scheme: dark;
  }
  .app {
    position: relative;
    display: flex;
    flex-direction: column;
    height: 100%;
    min-width: 0;
  }
  .host-side {
    grid-area: 1 / 2;
    overflow: auto;
    border-left: 1px solid var(--line);
    background: var(--surface);
  }
  .host-side.narrow {
    grid-area: 2 / 1;
    border-top: 1px solid var(--line);
    border-left: 0;
  }
  .views {
    display: contents;
  }
  .app > scanstitch-messages {
    position: absolute;
    top: 64px;
    right: 12px;
    z-index: 19; /* under the header's menus */
    width: min(430px, calc(100% - 24px));
  }
  .bar {
    display: flex;
    align-items: center;
    gap: 16px;
    min-height: 52px;
    padding: 0 12px 0 16px;
    border-bottom: 1px solid var(--line);
    background: var(--surface);
  }
  .brand {
    display: flex;
    align-items: center;
    gap: 8px;
    font-size: 16px;
    font-weight: 680;
    letter-spacing: -0.015em;
  }
  .dataset {
    display: flex;
    flex: 1;
    align-items: center;
    gap: 10px;
    min-width: 0;
    padding-left: 16px;
    border-left: 1px solid var(--line);
  }
  .title {
    overflow: hidden;
    font-weight: 550;
    text-overflow: ellipsis;
    white-space: nowrap;
  }
  .count {
    white-space: nowrap;
  }
  .chip {
    display: inline-flex;
    align-items: center;
    gap: 7px;
    height: 26px;
    padding-left: 9px;
    border: 1px solid var(--line);
    border-radius: 99px;
    font-size: 12.5px;
    white-space: nowrap;
  }
  .chip button {
    min-height: 24px;
    width: 24px;
    padding: 0;
    border-radius: 50%;
    color: var(--muted);
  }
  .dash {
    width: 18px;
    border-top: 2px dashed light-dark(#b4530a, #ffad5c);
  }
  .dash.spatial {
    height: 5px;
    border: 1px solid light-dark(#0a0c10, #d6e0ec);
    background: #06080b;
  }
  .chip > span {
    overflow: hidden;
    max-width: 16ch;
    text-overflow: ellipsis;
  }
  nav {
    display: flex;
    align-items: center;
    gap: 6px;
  }
  .tools {
    gap: 0;
    align-self: stretch;
  }
  .tools button {
    min-height: 100%;
    padding: 0 11px;
    border: 0;
    border-radius: 0;
    background: none;
    color: var(--muted);
    box-shadow: inset 0 -2px transparent;
  }
  .tools button:hover:not(:disabled) {
    background: none;
    color: var(--text);
  }
  .tools [aria-current] {
    color: var(--text);
    font-weight: 600;
    box-shadow: inset 0 -2px var(--accent);
  }
  .tools button:focus-visible {
    outline-offset: -3px;
  }
  .actions {
    margin-left: auto;
  }
  .narrow .bar {
    flex-wrap: wrap;
    gap: 0 10px;
    padding: 6px 8px 0 12px;
  }
  .medium .brand span,
  .medium .count,
  .narrow .brand span {
    display: none;
  }
  /* Beside the map no recording's name needs the room. */
  :is(.medium, .narrow) .aside .brand span {
    display: inline;
  }
  .narrow .dataset {
    flex-wrap: wrap;
    gap: 0 8px;
    padding-left: 0;
    border-left: 0;
    line-height: 1.25;
  }
  .narrow .title {
    max-width: 100%;
  }
  .narrow .count {
    font-size: 12.5px;
  }
  .narrow .tools {
    order: 1;
    flex-basis: 100%;
    justify-content: space-between;
  }
  .narrow .tools button {
    min-height: 38px;
    padding: 0 8px;
  }
  @media (max-height: 520px) {
    .app {
      min-height: 640px;
    }
    :host {
      overflow-y: auto;
    }
  }
`;

/** The current activity, in a box over the content. */
export const activity_styles = css`
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
export const layout_styles = css`
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
  .wide main {
    grid-template-columns: 284px minmax(0, 1fr) 330px;
  }
  .medium main {
    grid-template-columns: minmax(0, 1fr) 320px;
  }
  .narrow main {
    grid-template-columns: minmax(0, 1fr);
    grid-template-rows: minmax(0, 11fr) minmax(0, 9fr);
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
  [role='tablist'] {
    display: flex;
    flex: none;
    padding: 0 8px;
    border-bottom: 1px solid var(--line);
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
    display: grid;
    grid-template-columns: minmax(0, 1fr);
    grid-template-rows: minmax(0, 1fr) auto auto;
    min-width: 0;
    min-height: 0;
  }
  .narrow .middle {
    grid-template-rows: minmax(0, 1fr) auto;
  }
  .map-area {
    position: relative;
    display: grid;
    min-height: 0;
  }
  scanstitch-timeline {
    padding: 7px 16px 7px 12px;
    border-top: 1px solid var(--line);
    background: var(--surface);
  }
  scanstitch-frame-table {
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
  scanstitch-messages {
    position: absolute;
    inset: 12px auto auto 12px;
    display: flex;
    flex-direction: column;
    width: min(430px, calc(100% - 74px));
    max-height: calc(100% - 60px);
  }
  /* Beside the legend of pieces, where there is room for both. */
  @container (min-width: 780px) and (min-height: 300px) {
    scanstitch-messages {
      inset: 12px 62px auto auto;
    }
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
