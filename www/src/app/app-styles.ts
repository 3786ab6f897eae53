/** How the parts of the page lie beside and below each other, in each of its three layouts. */
import { css } from 'lit';
import { column, cut, row } from '../components/theme.js';

export const appStyles = css`
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
    ${column};
    height: 100%;
    min-width: 0;
    font-size: calc(14 * var(--px));
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
    ${column};
    flex: none;
    max-height: 36%;
  }
  .bar {
    ${row};
    gap: 16px;
    min-height: 52px;
    padding: 0 12px 0 16px;
    border-bottom: 1px solid var(--line);
    background: var(--surface);
  }
  .brand {
    ${row};
    gap: 8px;
    font-size: calc(16 * var(--px));
    font-weight: 680;
    letter-spacing: -0.015em;
  }
  .dataset {
    ${row};
    flex: 1;
    gap: 10px;
    min-width: 0;
    padding-left: 16px;
    border-left: 1px solid var(--line);
  }
  .title {
    ${cut};
    font-weight: 550;
  }
  .named {
    display: grid;
    min-width: 0;
    line-height: 1.25;
  }
  .count {
    font-size: calc(12.5 * var(--px));
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
    font-size: calc(12.5 * var(--px));
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
    ${row};
    gap: 6px;
  }
  .tools {
    gap: 0;
    align-self: stretch;
    overflow-x: auto;
    scrollbar-width: none;
  }
  .tools button {
    min-height: 100%;
    padding: 0 9px;
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
  .low .count,
  .narrow .brand span {
    display: none;
  }
  /* Beside the map no recording's name needs the room. */
  :is(.medium, .narrow) .aside .brand span {
    display: inline;
  }
  .narrow .dataset {
    padding-left: 0;
    border-left: 0;
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
  /* One line, for what stands in little height: the tools scroll sideways where they have no room. */
  .low .bar {
    flex-wrap: nowrap;
    min-height: 40px;
    padding-block: 0;
  }
  .low .tools {
    order: 0;
    flex: 1 1 auto;
  }
  .narrow.low .dataset {
    display: none;
  }
  /* The views beside the map need more, and are scrolled. */
  @media (max-height: 520px) {
    .app.beside {
      min-height: 640px;
    }
    :host {
      overflow-y: auto;
    }
  }
`;
