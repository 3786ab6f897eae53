import type { LitElement } from 'lit';

/**
 * Tells an element when a box of it, or it itself, is drawn for the first time, and whenever its size changes, while it is on
 * the page. `onSize` is given its size without padding (CSS pixels); `box` is null before it is drawn.
 */
export function watchSize(
  host: LitElement,
  onSize: (width: number, height: number) => void,
  box: () => Element | null = () => host,
): void {
  let isWatched = false;
  const observer = new ResizeObserver(([entry]) => {
    if (entry) onSize(entry.contentRect.width, entry.contentRect.height);
  });
  const watch = (): void => {
    const drawn = isWatched ? null : box();
    if (!drawn) return;
    isWatched = true;
    observer.observe(drawn);
  };
  host.addController({
    hostConnected: watch,
    hostUpdated: watch,
    hostDisconnected: () => {
      observer.disconnect();
      isWatched = false;
    },
  });
}
