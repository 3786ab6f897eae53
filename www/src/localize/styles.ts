import { css } from 'lit';
import { cut, fill, row, small, wrap } from '../components/theme.js';

export const localizeStyles = css`
  .bar .what {
    ${cut};
    min-width: 0;
  }
  .bar progress {
    flex: 0 1 160px;
    min-width: 60px;
  }
  .bar .actions {
    ${row};
    gap: 8px;
    margin-left: auto;
  }
  .bar label {
    ${row};
    gap: 6px;
    ${small};
  }
  .bar .status {
    font-size: calc(13 * var(--px));
  }
  main {
    display: grid;
    ${fill};
    grid-template-columns: minmax(0, 1fr) calc(310 * var(--px));
  }
  main.alone {
    grid-template-columns: minmax(0, 1fr);
  }
  aside {
    overflow: auto;
    padding: 12px 16px 20px;
    border-left: 1px solid var(--line);
    background: var(--surface);
  }
  aside section + section {
    margin-top: 16px;
    padding-top: 12px;
    border-top: 1px solid var(--line);
  }
  aside header {
    ${wrap};
    gap: 4px 8px;
    margin-bottom: 6px;
  }
  aside .name {
    ${cut};
    min-width: 0;
    max-width: 14em;
    font-size: calc(12.5 * var(--px));
  }
  aside p {
    font-size: calc(13 * var(--px));
    overflow-wrap: anywhere;
  }
  aside h3 {
    margin: 12px 0 4px;
  }
  dl {
    display: grid;
    grid-template-columns: minmax(0, 1fr) auto;
    gap: 3px 12px;
    margin-top: 8px;
    font-size: calc(13 * var(--px));
  }
  dt {
    color: var(--muted);
  }
  dd {
    text-align: right;
    white-space: nowrap;
  }
  .particles form {
    display: grid;
    gap: 6px;
    margin-top: 10px;
  }
  .particles label {
    ${row};
    justify-content: space-between;
    gap: 8px;
    font-size: calc(13 * var(--px));
  }
  .particles input {
    width: 7em;
  }
  scanstitch-timeline {
    flex: none;
    padding: 4px 16px;
    border-top: 1px solid var(--line);
    background: var(--surface);
  }
  .empty {
    padding: 24px;
  }
  .empty section {
    display: grid;
    gap: 10px;
    justify-items: center;
    max-width: 760px;
    margin: 0 auto;
  }
  .next {
    flex: none;
    padding: 10px 16px;
    border-bottom: 1px solid var(--line);
    background: var(--accent-soft);
  }
  .next form {
    ${wrap};
    gap: 8px;
    margin-top: 6px;
  }
  @container (max-width: 720px) {
    main {
      grid-template-columns: minmax(0, 1fr);
      grid-template-rows: minmax(0, 3fr) minmax(0, 2fr);
    }
    main.alone {
      grid-template-rows: minmax(0, 1fr);
    }
    aside {
      border-width: 1px 0 0;
      border-top: 1px solid var(--line);
      border-left: 0;
    }
    .bar .what {
      flex: 1 1 100%;
    }
    .bar .actions {
      gap: 6px;
      margin-left: 0;
    }
    .bar select {
      max-width: 118px;
    }
  }
`;

export const locatedMapStyles = css`
  .sign.trajectory {
    border-color: light-dark(#0a7a3f, #53d08a);
  }
  .sign.places {
    border-color: light-dark(#c05c00, #ffb04d);
  }
  .sign.particles {
    border-top: 4px dotted light-dark(#9324a5, #e296f0);
  }
  .sign.field {
    border: 0;
    height: 8px;
    background: linear-gradient(to right, light-dark(#fff, #2d3642), light-dark(#1c2633, #e4eaf2));
  }
  .sign.returns {
    border-top: 3px dotted light-dark(#1d5fd1, #7fb0ff);
  }
`;
