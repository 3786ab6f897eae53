/** Line icons that only panels and views loaded after the map show; each is given to `icon` and `iconButton` in place of a name. */
import { svg } from 'lit';

export const PREVIOUS = svg`<path d="M10 3.5 5.5 8l4.5 4.5" />`;
export const NEXT = svg`<path d="M6 3.5 10.5 8 6 12.5" />`;
export const FILE = svg`<path d="M4 1.8h5l3 3v9.4H4zM9 1.8v3h3" />`;
export const RESET = svg`<path d="M3 8a5 5 0 1 0 1.6-3.7M4.6 1.8v2.6h2.6" />`;
export const BOTH_WAYS = svg`<path d="M1.5 8h13M4.5 5l-3 3 3 3M11.5 5l3 3-3 3" stroke-width="2" />`;
export const TRASH = svg`<path d="M3 4.5h10M6.5 4.5v-2h3v2M4.5 4.5l.6 9h5.8l.6-9" />`;

/** Of a status: a tick, the sign of a warning, a cross in a circle. */
export const STATUS_ICONS = {
  good: svg`<path d="m3.5 8.5 3 3 6-7" stroke-width="2" />`,
  doubtful: 'doubtful',
  lost: svg`<circle cx="8" cy="8" r="5.8" /><path d="m5.8 5.8 4.4 4.4M10.2 5.8l-4.4 4.4" />`,
} as const;
