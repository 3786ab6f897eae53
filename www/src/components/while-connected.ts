import type { ReactiveControllerHost } from 'lit';

/** What the browser tells of the window, the document or the system, which a host hears while it is on the page. */
interface Heard extends WindowEventMap, DocumentEventMap {
  change: Event;
}

/** `capture`: before what is inside the target hears of it. */
export function whileConnected<K extends keyof Heard>(
  host: ReactiveControllerHost,
  target: EventTarget,
  type: K,
  listener: (event: Heard[K]) => void,
  capture = false,
): void {
  host.addController({
    hostConnected: () => target.addEventListener(type, listener as EventListener, capture),
    hostDisconnected: () => target.removeEventListener(type, listener as EventListener, capture),
  });
}
