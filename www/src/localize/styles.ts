import { css } from 'lit';

export const localizeStyles = css`
  :host {
    position: relative;
    display: block;
    flex: 1;
    min-height: 0;
    background: var(--background);
    container-type: size;
  }
  .localize {
    display: flex;
    flex-direction: column;
    height: 100%;
  }
  .bar {
    display: flex;
    flex: none;
    flex-wrap: wrap;
    align-items: center;
    gap: 4px 12px;
    min-height: 44px;
    padding: 4px 12px;
    border-bottom: 1px solid var(--line);
    background: var(--surface);
  }
  .bar .what {
    overflow: hidden;
    min-width: 0;
    text-overflow: ellipsis;
    white-space: nowrap;
  }
  .bar progress {
    flex: 0 1 160px;
    min-width: 60px;
    accent-color: var(--accent);
  }
  .bar .actions {
    display: flex;
    align-items: center;
    gap: 8px;
    margin-left: auto;
  }
  .bar label {
    display: flex;
    align-items: center;
    gap: 6px;
    color: var(--muted);
    font-size: calc(12 * var(--px));
  }
  .bar .status {
    font-size: calc(13 * var(--px));
  }
  main {
    display: grid;
    flex: 1;
    grid-template-columns: minmax(0, 1fr) calc(310 * var(--px));
    min-height: 0;
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
    display: flex;
    flex-wrap: wrap;
    align-items: center;
    gap: 4px 8px;
    margin-bottom: 6px;
  }
  aside .name {
    overflow: hidden;
    min-width: 0;
    max-width: 14em;
    font-size: calc(12.5 * var(--px));
    text-overflow: ellipsis;
    white-space: nowrap;
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
  th {
    color: var(--muted);
    font-size: calc(12 * var(--px));
    font-weight: 600;
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
    display: flex;
    flex-wrap: wrap;
    align-items: center;
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
  .sign.returns {
    border-top: 3px dotted light-dark(#1d5fd1, #7fb0ff);
  }
`;
