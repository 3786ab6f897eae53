/** How much of the element a host page shows around the map. */
export const CONTROLS = ['none', 'minimal', 'full'] as const;
export type Controls = (typeof CONTROLS)[number];
