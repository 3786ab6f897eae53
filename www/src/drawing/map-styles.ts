/** What the flat map and the map in space share: the stage, the buttons on it, the list of what is drawn. */
import { css } from 'lit';
import { cover, row, small, stretch } from '../components/theme.js';

export const mapStyles = css`
  :host {
    position: relative;
    min-height: 0;
    overflow: hidden;
    background: light-dark(#fcfdfe, #0b0f14);
    container-type: size;
  }
  /* What is drawn, and around it what explains it: nothing lies on the map but its buttons and scale. */
  .frame {
    display: grid;
    grid-template: 'section view layers' minmax(0, 1fr) 'legend legend legend' auto / auto minmax(0, 1fr) auto;
    height: 100%;
  }
  .view {
    position: relative;
    grid-area: view;
    min-height: 0;
    overflow: hidden;
  }
  @container (max-width: 640px) {
    .frame {
      grid-template: 'view' minmax(0, 1fr) 'section' auto 'layers' auto 'legend' auto / minmax(0, 1fr);
    }
    .frame > .layers {
      width: auto;
      max-width: none;
      max-height: 45cqh;
      border-width: 1px 0 0;
    }
  }
  .stage {
    ${cover};
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
    ${stretch};
  }
  .readout {
    position: absolute;
    left: calc(64 * var(--px));
    bottom: 10px;
    display: flex;
    gap: 10px;
    padding: 3px 8px;
    border-radius: 6px;
    background: color-mix(in srgb, var(--surface) 88%, transparent);
    ${small};
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
  :host([bare]) :is(.controls, .section) {
    display: none;
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
    grid-area: layers;
    display: grid;
    align-content: start;
    gap: 6px;
    width: calc(230 * var(--px));
    margin: 0;
    padding: 10px 14px;
    overflow: auto;
    border: solid var(--line);
    border-width: 0 0 0 1px;
    background: var(--surface);
    font-size: calc(13 * var(--px));
  }
  .layers label {
    ${row};
    gap: 8px;
    cursor: pointer;
    min-height: 24px;
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
