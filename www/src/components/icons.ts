/** Line icons, 16 units a side, drawn for this page. All are decoration: the button beside them says what they mean. */
import { html, type SVGTemplateResult, svg, type TemplateResult } from 'lit';

const SHAPES = {
  play: svg`<path d="M5 3.5v9l7.5-4.5z" fill="currentColor" stroke-linejoin="round" />`,
  pause: svg`<path d="M5.5 3.5v9M10.5 3.5v9" stroke-width="2.2" />`,
  plus: svg`<path d="M8 3v10M3 8h10" />`,
  minus: svg`<path d="M3 8h10" />`,
  fit: svg`<path d="M2.5 6V2.5H6M10 2.5h3.5V6M13.5 10v3.5H10M6 13.5H2.5V10" />`,
  expand: svg`<path d="M9.5 2.5h4v4M13.2 2.8 9 7M6.5 13.5h-4v-4M2.8 13.2 7 9" />`,
  shrink: svg`<path d="M9 3v4h4M9.2 6.8l4-4M7 13V9H3M6.8 9.2l-4 4" />`,
  turn: svg`<path d="M13 7.5A5 5 0 1 0 11 12M13.2 3.6v4H9.3" />`,
  layers: svg`<path d="m8 2 6 3.2-6 3.2-6-3.2zM2.2 8.4 8 11.5l5.8-3.1M2.2 11 8 14.1l5.8-3.1" />`,
  open: svg`<path d="M2 12.5v-9h4l1.5 2H14v7z" />`,
  download: svg`<path d="M8 2v8M4.8 7 8 10.2 11.2 7M2.5 13.5h11" />`,
  sun: svg`<circle cx="8" cy="8" r="2.8" /><path d="M8 1.5v1.6M8 12.9v1.6M1.5 8h1.6M12.9 8h1.6M3.4 3.4l1.1 1.1M11.5 11.5l1.1 1.1M12.6 3.4l-1.1 1.1M4.5 11.5l-1.1 1.1" />`,
  moon: svg`<path d="M13 9.6A5.6 5.6 0 0 1 6.4 3a5.6 5.6 0 1 0 6.6 6.6z" />`,
  close: svg`<path d="m4 4 8 8M12 4l-8 8" />`,
  doubtful: svg`<path d="M8 2.6 14 13H2zM8 6.6v3M8 11.2v.1" />`,
  info: svg`<circle cx="8" cy="8" r="5.8" /><path d="M8 7.4v3.4M8 5.1v.1" />`,
  loops: svg`<path d="M2 13c1-9 11-9 12 0" /><circle cx="2.2" cy="13" r=".8" /><circle cx="13.8" cy="13" r=".8" />`,
  chevron: svg`<path d="m4 6 4 4 4-4" />`,
} satisfies Record<string, SVGTemplateResult>;

type IconName = keyof typeof SHAPES;
/** An icon: by its name, or, of one that only a view loaded later shows, by its shape, which keeps it out of the first load. */
export type Sign = IconName | SVGTemplateResult;

export function icon(shape: Sign, size = 16): TemplateResult {
  return html`<svg
    style="width: calc(${size} * var(--px)); height: calc(${size} * var(--px))"
    viewBox="0 0 16 16"
    fill="none"
    stroke="currentColor"
    stroke-width="1.5"
    stroke-linecap="round"
    stroke-linejoin="round"
    aria-hidden="true"
  >
    ${typeof shape === 'string' ? SHAPES[shape] : shape}
  </svg>`;
}

/** The mark: scan points over a path. */
export function logo(size = 26): TemplateResult {
  return html`<svg
    style="width: calc(${size} * var(--px)); height: calc(${size} * var(--px))"
    viewBox="0 0 26 26"
    fill="none"
    stroke-linecap="round"
    aria-hidden="true"
  >
    <path d="M4 19c4.5-11 7.5-11 9.5-5.5s5 5.5 8.5-7" stroke="var(--accent)" stroke-width="2.6" />
    <path
      d="M3 9.5v.01M6.5 5.5v.01M11 4v.01M16 4.5v.01M9 22v.01M14 22.5v.01M19 20v.01M22.5 15.5v.01"
      stroke="var(--selected)"
      stroke-width="2.4"
    />
  </svg>`;
}
