import { css } from 'lit';
import { column, row, small, wrap } from '../components/theme.js';
import { doubt, note } from '../components/panel-theme.js';

export const strategyStyles = css`
  :host {
    container-type: inline-size;
  }
  .strategies {
    ${column};
    gap: 10px;
    padding: 10px;
  }
  .bar {
    ${wrap};
    gap: 6px 12px;
    padding: 8px 12px;
  }
  .bar progress {
    flex: 1 1 160px;
    min-width: 100px;
  }
  .empty {
    display: grid;
    justify-items: center;
    gap: 10px;
  }
  .problems li {
    padding: 6px 10px;
    border-radius: var(--radius);
    ${doubt};
    font-size: calc(13 * var(--px));
    overflow-wrap: anywhere;
  }
  td button.icon {
    min-height: 24px;
    width: 24px;
  }
  tr.retired td {
    color: var(--muted);
  }
  td.best {
    font-weight: 700;
    color: var(--good);
  }
  .choice {
    padding: 4px 12px 12px;
  }
  .choice ul {
    display: grid;
    grid-template-columns: repeat(auto-fill, minmax(min(320px, 100%), 1fr));
    gap: 8px 18px;
  }
  .choice label {
    display: grid;
    grid-template-columns: auto 1fr;
    gap: 0 8px;
    align-items: baseline;
  }
  .choice label > span {
    grid-column: 2;
  }
  .choice .about {
    ${note};
  }
  .choice i {
    display: inline-block;
    width: 10px;
    height: 10px;
    margin-right: 6px;
    border-radius: 50%;
  }
  .choice p {
    padding-top: 10px;
  }
  .figures {
    display: flex;
    flex-wrap: wrap;
    gap: 10px;
  }
  /* Two a row; a figure without a neighbour takes the whole row. */
  .figures section {
    flex: 1 1 calc(50% - 10px);
    min-width: 0;
  }
  .figures header label {
    ${row};
    gap: 5px;
    margin-left: auto;
    padding-right: 8px;
    ${small};
  }
  .figures scanstitch-figure {
    height: 260px;
  }
  .figures .wide {
    flex-basis: 100%;
  }
  .figures .wide scanstitch-figure {
    height: 420px;
  }
  @container (max-width: 760px) {
    .figures section {
      flex-basis: 100%;
    }
  }
`;
