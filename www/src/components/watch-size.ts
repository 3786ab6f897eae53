import type { ReactiveControllerHost } from 'lit';

/**
 * Tells an element when one of its boxes is drawn for the first time, and whenever its size changes, while it is on the page.
 * `box` is null before it is drawn; `onSize` is given its width without padding (CSS pixels).
 */
export function watchSize(
  host: ReactiveControllerHost,
  box: () => Element | null,
  onSize: (width: number) => void,
): void {
  let is_watched = false;
  const observer = new ResizeObserver(([entry]) => {
    if (entry) onSize(entry.contentRect.width);
  });
  const watch = (): void => {
    const drawn = is_watched ? null : box();
    if (!drawn) return;
    is_watched = true;
    observer.observe(drawn);
  };
  host.addController({
    hostConnected: watch,
    hostUpdated: watch,
    hostDisconnected: () => {
      observer.disconnect();
      is_watched = false;
    },
  });
}
