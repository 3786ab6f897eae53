import { css } from 'lit';

export const lab_styles = css`
  :host {
    display: contents;
  }
  .lab {
    position: relative;
    display: flex;
    flex: 1;
    flex-direction: column;
    min-height: 0;
    container-type: inline-size;
  }
  .pair {
    display: flex;
    flex-wrap: wrap;
    align-items: center;
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
    padding: 0 6px;
    border: 1px solid var(--line-strong);
    border-radius: 7px;
    background: var(--surface);
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
    overflow: hidden;
    color: var(--muted);
    text-overflow: ellipsis;
    white-space: nowrap;
  }
  .pair .ends {
    display: flex;
    gap: 6px;
    margin-left: auto;
  }
  .columns {
    display: grid;
    flex: 1;
    grid-template-columns: minmax(0, 1fr) minmax(360px, 34%);
    min-height: 0;
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
  .hint {
    position: absolute;
    top: 10px;
    left: 12px;
    max-width: calc(100% - 80px);
    padding: 4px 10px;
    border-radius: 6px;
    background: color-mix(in srgb, var(--surface) 88%, transparent);
    color: var(--muted);
    font-size: 12.5px;
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
    display: flex;
    align-items: center;
    gap: 8px;
    padding: 7px 14px 7px 12px;
    border-top: 1px solid var(--line);
    background: var(--surface);
  }
  .transport input {
    flex: 1;
    min-width: 60px;
    height: 28px;
    margin: 0;
    accent-color: var(--accent);
  }
  .transport select {
    min-height: 30px;
    border: 1px solid var(--line);
    border-radius: 7px;
    background: var(--surface);
  }
  .transport output {
    min-width: 64px;
    text-align: right;
    white-space: nowrap;
  }
  .legend {
    display: flex;
    flex-wrap: wrap;
    align-items: center;
    gap: 6px 14px;
    padding: 6px 14px;
    border-top: 1px solid var(--line);
    background: var(--surface);
    font-size: 12.5px;
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
    font-size: 12.5px;
    display: inline-flex;
    align-items: center;
    gap: 5px;
    color: var(--muted);
    white-space: nowrap;
  }
  .legend select {
    max-width: 128px;
  }
  .legend input {
    margin: 0;
    accent-color: var(--accent);
  }
  .panel {
    display: flex;
    flex-direction: column;
    gap: 10px;
    padding: 12px 16px 24px;
    overflow-wrap: anywhere;
  }
  .panel header {
    display: flex;
    align-items: baseline;
    gap: 10px;
    min-height: 24px;
  }
  .panel header .muted,
  header .muted {
    font-size: 12.5px;
  }
  .panel h3 {
    margin-top: 6px;
  }
  .facts {
    display: grid;
    grid-template-columns: auto minmax(0, 1fr);
    gap: 2px 14px;
  }
  .facts dt {
    color: var(--muted);
  }
  .explanation {
    color: var(--muted);
    font-size: 12.5px;
  }
  abbr {
    text-decoration: underline dotted;
    text-underline-offset: 2px;
  }
  scanstitch-figure.cost {
    height: 170px;
  }
  scanstitch-figure.map {
    height: auto;
    aspect-ratio: 1.12;
    cursor: crosshair;
  }
  .equation {
    display: grid;
    gap: 8px;
  }
  .formula {
    font-family: 'STIX Two Text', Cambria, Georgia, serif;
    font-size: 15.5px;
    line-height: 1.5;
  }
  .system {
    display: flex;
    flex-wrap: wrap;
    align-items: center;
    gap: 8px;
    overflow-x: auto;
  }
  .matrix {
    border-right: 1.5px solid var(--text);
    border-left: 1.5px solid var(--text);
    border-radius: 7px;
    border-collapse: separate;
    border-spacing: 0;
    font-size: 12.5px;
  }
  .matrix caption {
    caption-side: bottom;
    color: var(--muted);
    font-size: 12px;
  }
  .matrix td {
    padding: 1px 7px;
    text-align: right;
    white-space: nowrap;
  }
  .matrix th {
    padding: 1px 0 1px 7px;
    color: var(--muted);
    font-weight: 400;
    font-style: italic;
  }
  .system.large .matrix {
    font-size: 10.5px;
  }
  .system.large .matrix td {
    padding: 1px 4px;
  }
  .sign {
    font-size: 15px;
  }
  summary {
    color: var(--muted);
    font-size: 12.5px;
    cursor: pointer;
  }
  .scroll {
    overflow-x: auto;
  }
  table.iterations {
    width: 100%;
    margin-top: 6px;
    border-collapse: collapse;
    font-size: 11.5px;
  }
  .iterations th,
  .iterations td {
    padding: 2px 3px;
    text-align: right;
    font-weight: 400;
    white-space: nowrap;
  }
  .iterations thead th {
    color: var(--muted);
  }
  .methods button.link {
    display: inline-flex;
    gap: 7px;
    color: var(--text);
    text-align: left;
    text-decoration: none;
    white-space: normal;
  }
  .methods button.icon {
    width: 24px;
    min-height: 24px;
  }
  .methods i {
    flex: none;
    width: 10px;
    height: 10px;
    border-radius: 50%;
  }
  .methods .name {
    min-width: 120px;
    text-align: left;
    white-space: normal;
  }
  .methods tr.selected {
    background: var(--accent-soft);
  }
  .methods tr.selected button.link {
    font-weight: 600;
  }
  .row {
    display: flex;
    flex-wrap: wrap;
    align-items: center;
    gap: 8px;
  }
  .directions {
    display: grid;
    gap: 4px;
  }
  .directions li {
    display: grid;
    grid-template-columns: minmax(0, 1fr) 90px 42px;
    align-items: center;
    gap: 10px;
    font-size: 12.5px;
  }
  .directions .bar {
    height: 8px;
    min-height: 0;
    padding: 0;
    border: 0;
    border-radius: 4px;
    background: var(--line);
    overflow: hidden;
  }
  .directions .bar i {
    display: block;
    height: 100%;
  }
  .directions li span:last-child {
    text-align: right;
  }
  .row input[type='range'] {
    flex: 1;
    accent-color: var(--accent);
  }
  .tabs [role='tablist'] {
    overflow-x: auto;
  }
  .tabs [role='tab'] {
    font-size: 13px;
  }
  @container (max-width: 900px) {
    .columns {
      grid-template-columns: minmax(0, 1fr);
      grid-template-rows: minmax(0, 11fr) minmax(0, 9fr);
    }
    .columns .tabs {
      border-top: 1px solid var(--line);
      border-left: 0;
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
    .hint,
    .transport select {
      display: none;
    }
  }
`;
