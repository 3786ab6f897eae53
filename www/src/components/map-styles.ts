/** What the flat map and the map in space share: the stage, the buttons on it, the list of what is drawn. */
import { css } from 'lit';

export const map_styles = css`
  :host {
    position: relative;
    display: block;
    min-height: 0;
    overflow: hidden;
    background: light-dark(#fcfdfe, #0b0f14);
  }
  .stage {
    position: absolute;
    inset: 0;
    touch-action: none;
    cursor: grab;
    user-select: none;
  }
  .stage:active {
    cursor: grabbing;
  }
  .stage[data-guarded] {
    touch-action: pan-x pan-y;
  }
  .stage:focus-visible {
    outline-offset: -2px;
  }
  canvas {
    display: block;
    width: 100%;
    height: 100%;
  }
  .readout {
    position: absolute;
    left: 64px;
    bottom: 10px;
    display: flex;
    gap: 10px;
    padding: 3px 8px;
    border-radius: 6px;
    background: color-mix(in srgb, var(--surface) 88%, transparent);
    font-size: 12px;
    color: var(--muted);
    pointer-events: none;
  }
  .controls {
    position: absolute;
    top: 10px;
    right: 10px;
    display: flex;
    flex-flow: column wrap-reverse; /* a low map has two columns of them */
    gap: 4px;
    max-height: calc(100% - 46px); /* below them is the scale bar */
  }
  .controls > button {
    background: var(--surface);
    color: var(--muted);
  }
  .controls > button:hover,
  .controls > button[aria-pressed='true'],
  .controls > button[aria-expanded='true'] {
    color: var(--text);
  }
  .controls > button[aria-pressed='true'] {
    border-color: var(--accent);
    color: var(--accent);
  }
  @media (pointer: coarse) {
    .controls > button {
      width: 36px;
      min-height: 36px;
    }
  }
  .layers {
    position: absolute;
    top: 0;
    right: calc(100% + 6px);
    display: grid;
    gap: 6px;
    width: max-content;
    max-width: 240px;
    margin: 0;
    padding: 10px 12px;
    border: 1px solid var(--line);
    border-radius: var(--radius);
    background: var(--surface);
    box-shadow: var(--shadow);
    font-size: 13px;
  }
  .layers label {
    display: flex;
    align-items: center;
    gap: 8px;
    cursor: pointer;
    min-height: 24px;
  }
  .layers input {
    margin: 0;
    accent-color: var(--accent);
  }
  .sign {
    flex: none;
    width: 22px;
    height: 0;
    border-top: 2px solid var(--text);
  }
  .sign.grid {
    border-top: 1px solid var(--line-strong);
  }
`;
