/** Colours, type and the few controls every component shares. Colours come in pairs, for light and for dark. */
import { css } from 'lit';

/** Declarations that many rules have in common: `${row};` within a rule. */
export const row = css`
  display: flex;
  align-items: center;
`;
export const wrap = css`
  display: flex;
  flex-wrap: wrap;
  align-items: center;
`;
export const column = css`
  display: flex;
  flex-direction: column;
`;
export const fill = css`
  flex: 1;
  min-height: 0;
`;
export const stretch = css`
  width: 100%;
  height: 100%;
`;
export const cover = css`
  position: absolute;
  inset: 0;
`;
/** What does not fit ends in dots. */
export const cut = css`
  overflow: hidden;
  text-overflow: ellipsis;
  white-space: nowrap;
`;
export const panel = css`
  border: 1px solid var(--line);
  border-radius: var(--radius);
  background: var(--surface);
`;
export const field = css`
  border: 1px solid var(--line-strong);
  border-radius: 7px;
  background: var(--surface);
`;
export const small = css`
  color: var(--muted);
  font-size: calc(12 * var(--px));
`;
/** Only for those who hear the page. */
export const heard = css`
  position: absolute;
  width: 1px;
  height: 1px;
  overflow: hidden;
  clip-path: inset(50%);
`;

export const tokens = css`
  :host {
    --background: var(--scanstitch-background, light-dark(#f3f5f8, #0e1217));
    --surface: var(--scanstitch-surface, light-dark(#ffffff, #151b23));
    --sunken: light-dark(#f3f5f8, #10161d);
    --line: var(--scanstitch-line, light-dark(#dde3ea, #27303b));
    --line-strong: light-dark(#8391a3, #66758a);
    --text: var(--scanstitch-text, light-dark(#17202c, #e5eaf1));
    --muted: var(--scanstitch-muted, light-dark(#536070, #9dabbc));
    --accent: var(--scanstitch-accent, light-dark(#2356c7, #8ab0ff));
    --accent-soft: light-dark(#e6edfb, #1d2b47);
    --on-accent: var(--scanstitch-on-accent, light-dark(#ffffff, #0b1626));
    --selected: light-dark(#c4126a, #ff6fb1);
    --selected-soft: light-dark(#fbe7f1, #3a1a2b);
    --good: light-dark(#19703e, #6fd7a0);
    --good-soft: light-dark(#e3f4ea, #14301f);
    --doubtful: light-dark(#8a4f08, #f2b862);
    --doubtful-soft: light-dark(#fdf0dc, #35270f);
    --lost: light-dark(#ad2219, #ff938a);
    --lost-soft: light-dark(#fce8e6, #3b1a18);
    --shadow: 0 1px 2px rgb(16 24 40 / 0.06), 0 6px 20px rgb(16 24 40 / 0.08);
    --radius: var(--scanstitch-radius, 8px);
    --px: 1px; /* a unit of type, which grows with the element */
    --mono: ui-monospace, 'SF Mono', 'Cascadia Mono', Menlo, Consolas, monospace;
    font: 14px / 1.45 var(--scanstitch-font, system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif);
    color: var(--text);
    accent-color: var(--accent);
    -webkit-tap-highlight-color: transparent;
  }
`;

export const shared = css`
  *,
  *::before,
  *::after {
    box-sizing: border-box;
  }
  :host {
    display: block;
  }
  :host([hidden]),
  [hidden] {
    display: none !important;
  }
  h2,
  h3,
  p,
  ul,
  ol,
  dl,
  dd {
    margin: 0;
    padding: 0;
  }
  ul,
  ol {
    list-style: none;
  }
  h2 {
    font-size: calc(14 * var(--px));
    font-weight: 650;
    letter-spacing: -0.005em;
  }
  h3 {
    font-size: calc(12 * var(--px));
    font-weight: 600;
    color: var(--muted);
  }
  button,
  input,
  select {
    font: inherit;
    color: inherit;
  }
  input:is([type='checkbox'], [type='radio'], [type='range']) {
    margin: 0;
  }
  :where(select, textarea, input:not([type='checkbox'], [type='radio'], [type='range'], [type='file'])) {
    min-height: 32px;
    padding: 0 8px;
    ${field};
  }
  summary {
    cursor: pointer;
  }
  button {
    display: inline-flex;
    align-items: center;
    justify-content: center;
    gap: 6px;
    min-height: calc(32 * var(--px));
    padding: 0 12px;
    border: 1px solid var(--line);
    border-radius: 7px;
    background: var(--surface);
    cursor: pointer;
    white-space: nowrap;
    transition:
      background-color 120ms,
      border-color 120ms;
  }
  button:hover:not(:disabled) {
    background: var(--sunken);
    border-color: var(--line-strong);
  }
  button:disabled {
    opacity: 0.5;
    cursor: default;
  }
  button.primary {
    background: var(--accent);
    border-color: var(--accent);
    color: var(--on-accent);
    font-weight: 550;
  }
  button.primary:hover:not(:disabled) {
    background: color-mix(in oklab, var(--accent), var(--text) 14%);
    border-color: transparent;
  }
  button.quiet {
    border-color: transparent;
    background: transparent;
  }
  button.quiet:hover:not(:disabled) {
    background: var(--sunken);
  }
  button.icon {
    width: calc(32 * var(--px));
    padding: 0;
  }
  button.link {
    min-height: 0;
    padding: 0;
    border: 0;
    background: none;
    color: var(--accent);
    text-decoration: underline;
    text-underline-offset: 2px;
  }
  :focus-visible {
    outline: 2px solid var(--accent);
    outline-offset: 2px;
  }
  svg {
    display: block;
    flex: none;
  }
  .muted {
    color: var(--muted);
  }
  .number {
    font-variant-numeric: tabular-nums;
  }
  .visually-hidden {
    ${heard};
    white-space: nowrap;
  }
  @media (pointer: coarse) {
    button {
      min-height: 40px;
    }
    button.icon {
      width: 40px;
    }
  }
  @media (prefers-reduced-motion: reduce) {
    *,
    *::before,
    *::after {
      transition: none !important;
      animation: none !important;
    }
  }
`;

/** Over all of a view, while files are dragged over it. */
export const dropStyles = css`
  .drop-hint {
    position: absolute;
    inset: 0;
    z-index: 30;
    display: grid;
    padding: 14px;
    background: color-mix(in srgb, var(--background) 82%, transparent);
    pointer-events: none;
  }
  .drop-hint > div {
    display: grid;
    place-content: center;
    justify-items: center;
    gap: 12px;
    border: 2px dashed var(--accent);
    border-radius: 14px;
    color: var(--accent);
    font-size: calc(20 * var(--px));
    font-weight: 600;
  }
`;

/** Of the card that a view without files shows. */
export const emptyStyles = css`
  section.empty,
  .empty section {
    padding: 32px 28px;
    border: 1.5px dashed var(--line-strong);
    border-radius: 14px;
    background: var(--surface);
    text-align: center;
  }
  .empty h2 {
    font-size: calc(18 * var(--px));
  }
  .empty .actions {
    display: flex;
    flex-wrap: wrap;
    justify-content: center;
    gap: 8px;
  }
`;
