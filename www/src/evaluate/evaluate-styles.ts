import { css } from 'lit';
import { column, panel, row, small } from '../components/theme.js';
import { doubt, note } from '../components/panel-theme.js';

/** Of the view as a whole. */
export const evaluateStyles = css`
  .evaluate {
    position: relative;
    ${column};
    gap: 10px;
    min-height: 100%;
    padding: 10px;
  }
  .problems {
    display: grid;
    gap: 4px;
  }
  .problems li {
    display: flex;
    align-items: start;
    gap: 8px;
    padding: 7px 10px;
    border-radius: var(--radius);
    background: var(--surface);
    font-size: calc(13 * var(--px));
    overflow-wrap: anywhere;
  }
  .problems li svg {
    margin-top: 2px;
  }
  .problem,
  .problems .problem {
    ${doubt};
  }
  .empty {
    ${row};
    flex-direction: column;
    gap: 14px;
    max-width: 560px;
    margin: auto;
  }
  .empty .problem {
    padding: 6px 12px;
    border-radius: var(--radius);
  }
`;

/** Of the bar of choices. */
export const controlsStyles = css`
  :host {
    container-type: inline-size;
  }
  .controls {
    display: flex;
    flex-wrap: wrap;
    align-items: end;
    gap: 8px 12px;
    padding: 10px 12px;
    ${panel};
  }
  label {
    display: grid;
    gap: 3px;
    min-width: 0;
    ${small};
  }
  label.check {
    ${row};
    gap: 6px;
    min-height: 32px;
  }
  input[type='number'] {
    width: 90px;
  }
  .actions {
    display: flex;
    gap: 6px;
    margin-left: auto;
  }
  .more {
    flex-basis: 100%;
    ${note};
  }
  .more summary {
    width: max-content;
    min-height: 24px;
  }
  .more > div {
    display: flex;
    flex-wrap: wrap;
    align-items: end;
    gap: 8px 12px;
    padding-top: 4px;
  }
  .beside {
    display: flex;
    flex-basis: 100%;
    flex-wrap: wrap;
    gap: 6px;
  }
  .beside li {
    ${row};
    gap: 6px;
    padding-left: 10px;
    border: 1px solid var(--line);
    border-radius: 999px;
    font-size: calc(12 * var(--px));
  }
  .beside button {
    min-height: 26px;
    width: 26px;
    border-radius: 50%;
  }
  .beside label.check {
    min-height: 26px;
  }
  @container (max-width: 560px) {
    .controls > label:not(.check) {
      flex: 1 1 calc(50% - 6px);
    }
    .controls select,
    .controls input[type='number'] {
      width: 100%;
      max-width: none;
    }
    .actions {
      flex-basis: 100%;
    }
    .actions button {
      flex: 1;
    }
  }
`;

/** Of the figures. */
export const figuresStyles = css`
  :host {
    container-type: inline-size;
  }
  .grid {
    display: grid;
    grid-template-columns: repeat(12, 1fr);
    gap: 10px;
  }
  .grid > section {
    grid-column: span 6;
  }
  .paths {
    grid-row: span 2;
  }
  .over {
    ${small};
  }
  .over select {
    min-height: 28px;
    color: var(--text);
    font-size: calc(12 * var(--px));
  }
  .paths scanstitch-figure {
    flex: 1;
    min-height: 420px;
  }
  .errors scanstitch-figure,
  .histogram scanstitch-figure {
    height: 210px;
  }
  .positions scanstitch-figure,
  .angles scanstitch-figure {
    height: 400px;
  }
  .readout {
    position: absolute;
    left: 64px;
    bottom: 44px;
    padding: 2px 8px;
    border-radius: 6px;
    background: color-mix(in srgb, var(--surface) 88%, transparent);
    font-size: calc(12 * var(--px));
    pointer-events: none;
  }
  @container (max-width: 900px) {
    .grid > section {
      grid-column: span 12;
    }
    .paths scanstitch-figure {
      min-height: 340px;
    }
  }
`;
