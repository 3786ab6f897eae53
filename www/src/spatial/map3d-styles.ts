import { css } from 'lit';
import { panel, row, small } from '../components/theme.js';

/** What lies over the map in space. */
export const map3dStyles = css`
  .notice {
    position: absolute;
    top: 50%;
    left: 50%;
    display: grid;
    justify-items: center;
    gap: 10px;
    width: min(380px, calc(100% - 40px));
    padding: 14px 18px;
    ${panel};
    box-shadow: var(--shadow);
    text-align: center;
    transform: translate(-50%, -50%);
  }
  /* A column at the left of the map; below it where that is narrow. */
  .section {
    grid-area: section;
    ${row};
    flex-direction: column;
    justify-content: center;
    gap: 6px;
    padding: 8px 4px;
    border-right: 1px solid var(--line);
    background: var(--surface);
    color: var(--muted);
    font-size: calc(11.5 * var(--px));
  }
  .section output {
    min-width: calc(46 * var(--px));
    color: var(--text);
    text-align: center;
  }
  .section input {
    width: 24px;
    height: clamp(80px, 40cqh, 260px);
    writing-mode: vertical-lr;
    direction: rtl;
    cursor: ns-resize;
  }
  @container (max-width: 640px) {
    .section {
      flex-direction: row;
      gap: 12px;
      padding: 2px 12px;
      border: solid var(--line);
      border-width: 1px 0 0;
    }
    .section input {
      flex: 1;
      width: auto;
      min-width: 0;
      height: 28px;
      writing-mode: horizontal-tb;
      direction: ltr;
      cursor: ew-resize;
    }
  }
  .corner {
    position: absolute;
    right: 12px;
    bottom: 10px;
    display: flex;
    flex-wrap: wrap;
    align-items: flex-end;
    justify-content: flex-end;
    gap: 14px;
    padding: 3px 8px 4px;
    border-radius: 6px;
    background: color-mix(in srgb, var(--surface) 84%, transparent);
    ${small};
    pointer-events: none;
  }
  .hovered {
    padding: 1px 8px;
    border-radius: 6px;
    background: color-mix(in srgb, var(--surface) 88%, transparent);
    color: var(--text);
  }
  .legend {
    ${row};
    gap: 6px;
  }
  .legend i {
    width: 90px;
    height: 6px;
    border-radius: 3px;
  }
  .legend i.filled {
    width: 14px;
    height: 10px;
    margin-left: 8px;
  }
  .scale {
    padding-bottom: 1px;
    border: solid var(--line-strong);
    border-width: 0 1.5px 1.5px;
    text-align: center;
  }
  .layers .row {
    justify-content: space-between;
  }
  .layers input[type='range'] {
    width: 110px;
  }
  .sign.estimate {
    border-top: 3px solid light-dark(#d6201c, #ff483e);
  }
  .sign.reference {
    height: 5px;
    border: 1px solid light-dark(#0a0c10, #d6e0ec);
    background: #06080b;
  }
  .sign.dots {
    border-top: 3px dotted var(--muted);
  }
  .sign.cameras {
    height: 9px;
    border: 1px solid light-dark(#d6201c, #ff483e);
    width: 14px;
    margin: 0 4px;
  }
  /* What a tool has on the map. */
  .pad {
    position: absolute;
    bottom: 10px;
    left: 10px;
    display: grid;
    grid-template-columns: repeat(3, 44px);
    gap: 4px;
  }
  .pad button {
    min-height: 44px;
    padding: 0;
    background: color-mix(in srgb, var(--surface) 84%, transparent);
    touch-action: none;
    user-select: none;
  }
  @media (pointer: fine) {
    .pad {
      grid-template-columns: repeat(3, 30px);
    }
    .pad button {
      min-height: 28px;
    }
  }
  .beside {
    position: absolute;
    bottom: 10px;
    left: 10px;
    width: clamp(110px, 24%, 180px);
    border: 1px solid var(--line-strong);
    border-radius: 6px;
    pointer-events: none;
  }
  /* Where there is little room, the line of the surface waits until the tools are put away. */
  @container (max-width: 640px) or (max-height: 480px) {
    .bars:has(.tools) > :not(.tools),
    .keys {
      display: none;
    }
  }
  @media (pointer: coarse) {
    .keys {
      display: none;
    }
  }
  .cross {
    position: absolute;
    top: 50%;
    left: 50%;
    width: 19px;
    height: 19px;
    background:
      linear-gradient(var(--text), var(--text)) center / 1px 100% no-repeat,
      linear-gradient(var(--text), var(--text)) center / 100% 1px no-repeat;
    opacity: 0.6;
    transform: translate(-50%, -50%);
    pointer-events: none;
  }
  .floor-grid {
    position: absolute;
    bottom: 10px;
    left: 10px;
    padding: 4px;
    border: 1px solid var(--line-strong);
    border-radius: 6px;
    background: var(--surface);
    max-width: 40%;
    max-height: 40%;
    image-rendering: pixelated;
    pointer-events: none;
  }
  .measured {
    position: absolute;
    padding: 1px 8px;
    border-radius: 6px;
    background: color-mix(in srgb, var(--surface) 92%, transparent);
    font-weight: 600;
    transform: translate(-50%, -130%);
    white-space: nowrap;
    pointer-events: none;
  }
`;
