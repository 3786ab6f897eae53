/** Of the panels beside the stage. */
import { css } from 'lit';
import { column, row, small, wrap } from '../components/theme.js';
import { dot, doubt, note } from '../components/panel-theme.js';

export const sideStyles = css`
  .panel {
    ${column};
    gap: 10px;
    padding: 12px 16px 24px;
    overflow-wrap: anywhere;
  }
  .panel header {
    display: flex;
    flex-wrap: wrap;
    align-items: baseline;
    gap: 0 10px;
    min-height: 24px;
  }
  .panel header .muted,
  header .muted {
    font-size: calc(12.5 * var(--px));
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
    ${note};
  }
  abbr {
    text-decoration: underline dotted;
    text-underline-offset: 2px;
  }
  .key {
    display: grid;
    gap: 2px;
    font-size: calc(12.5 * var(--px));
  }
  .key li {
    ${row};
    gap: 8px;
  }
  .key .active {
    font-weight: 600;
  }
  .key i {
    flex: none;
    width: 18px;
    height: 3px;
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
    font-size: calc(15.5 * var(--px));
    line-height: 1.5;
  }
  .system {
    ${row};
    gap: 5px;
    overflow-x: auto;
    white-space: nowrap;
  }
  .matrix {
    border-right: 1.5px solid var(--text);
    border-left: 1.5px solid var(--text);
    border-radius: 7px;
    border-collapse: separate;
    border-spacing: 0;
    font-size: calc(12.5 * var(--px));
  }
  .matrix caption {
    caption-side: bottom;
    ${small};
  }
  .matrix td {
    padding: 1px 5px;
    text-align: right;
    white-space: nowrap;
  }
  .matrix th {
    padding: 1px 0 1px 5px;
    color: var(--muted);
    font-weight: 400;
    font-style: italic;
  }
  .system.large .sign {
    font-size: calc(12 * var(--px));
  }
  .system.large .matrix {
    font-size: calc(10.5 * var(--px));
  }
  .system.large .matrix td {
    padding: 1px 3px;
  }
  .sign {
    font-size: calc(15 * var(--px));
  }
  summary {
    ${note};
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
    ${dot};
  }
  .methods .name {
    min-width: 96px;
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
    ${wrap};
    gap: 8px;
  }
  .fault {
    padding: 8px 10px;
    border-radius: var(--radius);
    ${doubt};
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
    font-size: calc(12.5 * var(--px));
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
  }
  .tabs [role='tablist'] {
    overflow-x: auto;
  }
  .tabs [role='tab'] {
    font-size: calc(13 * var(--px));
  }
  @container (max-width: 900px) {
    .tabs {
      border-top: 1px solid var(--line);
      border-left: 0;
    }
  }
`;
