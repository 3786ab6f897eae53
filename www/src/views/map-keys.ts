/** What keys do on the flat map and on the map in space, and which input belongs to the page. */

export const ZOOM_STEP = 1.3;
export const PAN_STEP = 60; // CSS pixels

export interface KeyedMap {
  zoomBy(factor: number): void;
  fit(): void;
  select(frame: number | null): void;
  readonly marks: { readonly selected: number | null; readonly poses: readonly unknown[] };
}

/** Does what a key means on a map. `own`: what it means on this one alone; letters are small. */
export function pressKey(event: KeyboardEvent, map: KeyedMap, own: Record<string, () => void>): void {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const { selected, poses } = map.marks;
  const last = poses.length - 1;
  const actions: Record<string, () => void> = {
    '+': () => map.zoomBy(ZOOM_STEP),
    '=': () => map.zoomBy(ZOOM_STEP),
    '-': () => map.zoomBy(1 / ZOOM_STEP),
    f: () => map.fit(),
    '.': () => map.select(last < 0 ? null : Math.min((selected ?? -1) + 1, last)),
    ',': () => map.select(last < 0 ? null : Math.max((selected ?? poses.length) - 1, 0)),
    Escape: () => map.select(null),
    ...own,
  };
  const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!action) return;
  event.preventDefault();
  action();
}

/** In a page that scrolls, wheel and single fingers belong to the page until the map has been clicked. */
export function belongsToPage(stage: Element): boolean {
  const page = document.scrollingElement;
  const scrolls = page !== null && page.scrollHeight > page.clientHeight + 1;
  return scrolls && (stage.getRootNode() as ShadowRoot).activeElement !== stage;
}
