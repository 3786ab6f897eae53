import { css } from 'lit';
import { column, small } from '../components/theme.js';

export const importStyles = css`
  dialog {
    width: min(1000px, calc(100vw - 24px));
  }
  form {
    ${column};
  }
  h2 {
    font-size: calc(16 * var(--px));
    overflow-wrap: anywhere;
  }
  .body {
    display: grid;
    grid-template-columns: minmax(300px, 1fr) minmax(280px, 1fr);
    gap: 14px 18px;
  }
  .fields {
    ${column};
    gap: 10px;
  }
  fieldset {
    grid-template-columns: repeat(auto-fit, minmax(118px, 1fr));
    gap: 8px 10px;
    align-items: end;
  }
  legend {
    ${small};
  }
  label {
    ${column};
    gap: 3px;
    min-width: 0;
    ${small};
  }
  input,
  select {
    width: 100%;
    color: var(--text);
    font-size: calc(14 * var(--px));
  }
  input[type='range'] {
    padding: 0;
  }
  fieldset p {
    align-self: center;
    font-size: calc(12 * var(--px));
  }
  .seen {
    ${column};
    gap: 8px;
  }
  canvas {
    flex: 1;
    width: 100%;
    min-height: 260px;
    border: 1px solid var(--line);
    border-radius: var(--radius);
    background: var(--sunken);
  }
  .cells {
    grid-column: 1 / -1;
    overflow: auto;
    border: 1px solid var(--line);
    border-radius: var(--radius);
  }
  table {
    border-collapse: collapse;
    font: calc(12 * var(--px)) var(--mono);
  }
  th,
  td {
    padding: 3px 8px;
    text-align: right;
    white-space: nowrap;
  }
  th {
    border-bottom: 1px solid var(--line);
    font-weight: 600;
  }
  th small {
    display: block;
    font-weight: 400;
    color: var(--muted);
  }
  .range {
    background: var(--accent-soft);
  }
  .time,
  .angle {
    background: var(--doubtful-soft);
  }
  .x,
  .y,
  .heading {
    background: var(--good-soft);
  }
  .problem {
    color: var(--lost);
  }
  .problem:empty {
    display: none;
  }
  footer {
    position: sticky;
    bottom: 0;
    display: flex;
    flex-wrap: wrap;
    align-items: end;
    gap: 8px;
    margin: 0 -20px -18px;
    padding: 8px 20px 14px;
    border-top: 1px solid var(--line);
    background: var(--surface);
  }
  .command {
    flex: 1 1 280px;
  }
  .command input {
    font: calc(12 * var(--px)) var(--mono);
    background: var(--sunken);
    border-color: var(--line);
  }
  .gap {
    flex: 1 0 0;
  }
  @media (max-width: 720px) {
    form {
      padding: 14px;
    }
    .body {
      grid-template-columns: minmax(0, 1fr);
    }
    .seen {
      order: -1;
    }
    canvas {
      min-height: 200px;
    }
    .gap {
      display: none;
    }
    footer {
      margin: 0 -14px -14px;
      padding: 8px 14px;
    }
    .command {
      flex-basis: 200px;
    }
    footer button {
      flex: 1;
    }
  }
`;
