import { css } from 'lit';
import { column, cut, fill, panel, row, wrap } from '../components/theme.js';
import { note } from '../components/panel-theme.js';

export const labStyles = css`
  :host {
    display: contents;
  }
  .lab {
    position: relative;
    ${column};
    ${fill};
    container-type: inline-size;
  }
  .pair {
    ${wrap};
    gap: 6px 14px;
    padding: 7px 14px;
    border-bottom: 1px solid var(--line);
    background: var(--surface);
  }
  .pair label,
  .legend label {
    display: inline-flex;
    align-items: center;
    gap: 7px;
    min-width: 0;
  }
  .pair select,
  .legend select,
  .field select {
    min-height: 30px;
    max-width: 190px;
    text-overflow: ellipsis;
  }
  .pair .swatch {
    flex: none;
    width: 11px;
    height: 11px;
    border-radius: 50%;
  }
  .pair .method {
    flex: 1;
    min-width: 0;
    ${cut};
    color: var(--muted);
  }
  .pair .ends {
    display: flex;
    flex-wrap: wrap;
    gap: 6px;
    margin-left: auto;
  }
  .question {
    display: grid;
    gap: 4px;
    padding: 8px 14px;
    border-bottom: 1px solid var(--line);
    background: var(--accent-soft);
    font-size: calc(13.5 * var(--px));
  }
  .question summary {
    color: var(--accent);
    font-size: calc(13.5 * var(--px));
    font-weight: 550;
  }
  .first {
    ${column};
    ${fill};
    overflow: auto;
  }
  .first > h2 {
    padding: 0 24px 10px;
  }
  .first .empty {
    flex: none;
  }
  .gallery {
    display: grid;
    grid-template-columns: repeat(auto-fill, minmax(min(230px, 100%), 1fr));
    gap: 10px;
    padding: 0 24px 24px;
  }
  .gallery a {
    display: grid;
    align-content: start;
    gap: 4px;
    padding: 10px 12px;
    ${panel};
    color: var(--text);
    text-decoration: none;
  }
  .gallery a:hover {
    border-color: var(--accent);
  }
  .gallery span {
    ${note};
  }
  .columns {
    display: grid;
    ${fill};
    grid-template-columns: minmax(0, 1fr) minmax(360px, 34%);
  }
  .main {
    display: grid;
    grid-template-columns: minmax(0, 1fr);
    grid-template-rows: minmax(0, 1fr) auto;
    min-width: 0;
    min-height: 0;
  }
  .stage-area {
    position: relative;
    display: grid;
    min-height: 0;
  }
  .stage-area > scanstitch-messages {
    position: absolute;
    inset: 12px auto auto 12px;
    ${column};
    width: min(430px, calc(100% - 74px));
    max-height: calc(100% - 60px);
  }
  .hint {
    position: absolute;
    top: 10px;
    left: 12px;
    max-width: calc(100% - 80px);
    padding: 4px 10px;
    border-radius: 6px;
    background: color-mix(in srgb, var(--surface) 88%, transparent);
    ${note};
    pointer-events: none;
  }
  .run-from-here {
    position: absolute;
    bottom: 14px;
    left: 50%;
    transform: translateX(-50%);
    box-shadow: var(--shadow);
  }
  .transport {
    ${row};
    gap: 8px;
    padding: 7px 14px 7px 12px;
    border-top: 1px solid var(--line);
    background: var(--surface);
  }
  .transport input {
    flex: 1;
    min-width: 60px;
    height: 28px;
  }
  .transport output {
    min-width: 64px;
    text-align: right;
    white-space: nowrap;
  }
  .legend {
    ${wrap};
    gap: 6px 14px;
    padding: 6px 14px;
    border-top: 1px solid var(--line);
    background: var(--surface);
    font-size: calc(12.5 * var(--px));
  }
  .legend .scale {
    display: inline-flex;
    align-items: center;
    gap: 6px;
    color: var(--muted);
  }
  .legend .scale i {
    width: 76px;
    height: 8px;
    border-radius: 4px;
  }
  .legend .sign {
    ${note};
    display: inline-flex;
    align-items: center;
    gap: 5px;
    white-space: nowrap;
  }
  .legend select {
    max-width: 220px;
  }
  @container (max-width: 900px) {
    .columns {
      grid-template-columns: minmax(0, 1fr);
      grid-template-rows: minmax(0, 11fr) minmax(0, 9fr);
    }
    .legend {
      flex-wrap: nowrap;
      overflow-x: auto;
      white-space: nowrap;
    }
    .legend > * {
      flex: none;
    }
  }
  @container (max-width: 560px) {
    .pair {
      gap: 6px 10px;
      padding: 6px 10px;
    }
    .pair .method {
      display: none;
    }
    .pair select {
      max-width: 118px;
    }
    .pair .ends {
      flex-wrap: nowrap;
      gap: 4px;
      margin-left: 0;
      --menu-icon: none;
    }
    .pair .ends > button {
      padding: 0 9px;
      white-space: nowrap;
    }
    .pair .ends > button svg {
      display: none;
    }
    .columns {
      grid-template-rows: minmax(300px, 11fr) minmax(0, 9fr);
    }
    .legend select {
      max-width: 128px;
    }
    .hint,
    .transport select {
      display: none;
    }
  }
`;
