import { css } from 'lit';
import { cut, panel, row, small, wrap } from '../components/theme.js';
import { doubt } from '../components/panel-theme.js';

export const bevStyles = css`
  :host {
    container-type: inline-size;
  }
  .bev {
    position: relative;
    display: grid;
    gap: 10px;
    min-height: 100%;
    padding: 10px;
    align-content: start;
  }
  .controls {
    ${wrap};
    gap: 8px 12px;
    padding: 8px 12px;
    ${panel};
  }
  .controls label {
    ${row};
    gap: 6px;
    ${small};
  }
  .tools {
    display: flex;
  }
  .tools button {
    border-radius: 0;
    margin-left: -1px;
  }
  .tools button:first-child {
    border-radius: 7px 0 0 7px;
    margin-left: 0;
  }
  .tools button:last-child {
    border-radius: 0 7px 7px 0;
  }
  .tools button[aria-pressed='true'] {
    z-index: 1;
    border-color: var(--accent);
    background: var(--accent-soft);
    color: var(--accent);
    font-weight: 600;
  }
  .group {
    display: flex;
    gap: 6px;
  }
  .mirrored svg {
    transform: scaleX(-1);
  }
  .end {
    margin-left: auto;
  }
  input[type='number'] {
    width: 62px;
  }
  .problems {
    display: grid;
    gap: 4px;
  }
  .problems li {
    ${wrap};
    gap: 8px;
    padding: 6px 10px;
    border-radius: var(--radius);
    ${doubt};
    font-size: calc(13 * var(--px));
    overflow-wrap: anywhere;
  }
  .problems span {
    flex: 1;
    min-width: 200px;
  }
  .problems button {
    min-height: 28px;
  }
  .work {
    display: grid;
    grid-template-columns: minmax(0, 1fr);
    gap: 10px;
    align-items: start;
  }
  .views {
    display: grid;
    grid-template-columns: minmax(0, 1fr);
    gap: 10px;
  }
  .stack {
    display: grid;
    gap: 10px;
  }
  section {
    min-width: 0;
    ${panel};
    overflow: hidden;
  }
  section > header {
    ${wrap};
    gap: 4px 10px;
    min-height: 40px;
    padding: 4px 6px 4px 12px;
  }
  section > header .file {
    ${cut};
    flex: 1;
    min-width: 0;
    ${small};
  }
  section > header button {
    min-height: 28px;
    font-size: calc(12 * var(--px));
  }
  .readout {
    display: flex;
    flex-wrap: wrap;
    align-items: center;
    gap: 2px 14px;
    min-height: 48px; /* two lines, so that nothing jumps */
    padding: 4px 12px;
    color: var(--muted);
    font-size: calc(12.5 * var(--px));
    font-variant-numeric: tabular-nums;
  }
  .readout b {
    color: var(--text);
    font-weight: 550;
  }
  .blend {
    ${row};
    flex: 1;
    gap: 8px;
    min-width: 200px;
    ${small};
  }
  .blend input {
    flex: 1;
    min-width: 60px;
  }
  .panel {
    padding: 0 12px 12px;
  }
  .matrix {
    display: block;
    margin: 0;
    padding: 8px 10px;
    overflow-x: auto;
    border-radius: 6px;
    background: var(--sunken);
    font-family: var(--mono);
    font-size: calc(12 * var(--px));
    white-space: pre;
  }
  .hint {
    padding: 0 12px 10px;
    color: var(--muted);
    font-size: calc(13 * var(--px));
  }
  @container (min-width: 700px) {
    .views {
      grid-template-columns: repeat(2, minmax(0, 1fr));
    }
  }
  @container (min-width: 1080px) {
    .work {
      grid-template-columns: minmax(0, 1fr) 330px;
    }
  }
`;
