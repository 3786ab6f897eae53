/** Fires an event of the page's own, which the elements around this one hear. */
export function fire(from: EventTarget, type: string, detail: unknown = null): void {
  from.dispatchEvent(new CustomEvent(type, { detail, bubbles: true }));
}
