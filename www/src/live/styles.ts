import { css } from 'lit';
import { cut, fill, row, small, wrap } from '../components/theme.js';
import { doubt } from '../components/panel-theme.js';

export const liveStyles = css`
  .bar .address {
    ${cut};
    min-width: 0;
    color: var(--muted);
  }
  .bar .flow {
    font-size: calc(13 * var(--px));
  }
  .bar button {
    margin-left: auto;
  }
  .problems {
    flex: none;
    padding: 4px 12px;
    font-size: calc(13 * var(--px));
    overflow-wrap: anywhere;
    ${doubt};
  }
  scanstitch-map,
  scanstitch-map3d {
    ${fill};
  }
  .empty {
    flex: 1;
    overflow: auto;
    padding: 24px;
  }
  .empty > p {
    text-align: center;
  }
  .empty section {
    display: grid;
    gap: 14px;
    max-width: 760px;
    margin: 0 auto;
  }
  form:not(.topics) {
    ${wrap};
    justify-content: center;
    gap: 8px;
  }
  form label {
    ${row};
    flex-wrap: wrap;
    gap: 6px;
    text-align: left;
  }
  .topics label {
    flex-wrap: nowrap;
  }
  input[name='address'] {
    width: min(320px, 60cqw);
  }
  dl {
    ${small};
  }
  dd {
    margin-bottom: 4px;
    overflow-wrap: anywhere;
  }
  table {
    width: 100%;
    margin: 10px 0;
    border-collapse: collapse;
    text-align: left;
  }
  th,
  td {
    padding: 5px 8px;
    border-top: 1px solid var(--line);
    font-weight: 400;
    overflow-wrap: anywhere;
  }
  .type {
    ${small};
  }
  @container (max-width: 560px) {
    .empty {
      padding: 10px;
    }
    .empty section {
      padding: 20px 14px;
    }
    form label,
    input[name='address'] {
      flex: 1 1 100%;
      width: 100%;
    }
    .topics label {
      flex: initial;
    }
    td.type {
      display: none;
    }
    .bar .flow {
      order: 1;
      flex: 1 1 100%;
    }
  }
`;
