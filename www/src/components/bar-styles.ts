import { css } from 'lit';
import { column, fill, wrap } from './theme.js';

/** A view that fills its place, with a bar of its state and buttons at the top. */
export const barStyles = css`
  :host {
    position: relative;
    ${fill};
    background: var(--background);
    container-type: size;
  }
  .whole {
    ${column};
    height: 100%;
  }
  .bar {
    ${wrap};
    flex: none;
    gap: 4px 12px;
    min-height: 44px;
    padding: 4px 12px;
    border-bottom: 1px solid var(--line);
    background: var(--surface);
  }
`;
