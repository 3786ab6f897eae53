/** The views that were opened, in the browser's history: back and forward move between them. */
import type { ReactiveController, ReactiveControllerHost } from 'lit';

interface State {
  scanstitch_view?: string;
}

export interface ViewHistoryHooks {
  /** Whether the page is ours: an element on the page of a host leaves its history alone. */
  is_own_page(): boolean;
  /** Shows a view that was opened before; empty: the one that the page began with. */
  show(view: string): void;
}

export class ViewHistory implements ReactiveController {
  readonly #hooks: ViewHistoryHooks;

  constructor(host: ReactiveControllerHost, hooks: ViewHistoryHooks) {
    this.#hooks = hooks;
    host.addController(this);
  }

  hostConnected(): void {
    window.addEventListener('popstate', this.#onPop);
  }

  hostDisconnected(): void {
    window.removeEventListener('popstate', this.#onPop);
  }

  /** A view was opened. The address is as it was: a view that keeps something in it sees to that itself. */
  push(view: string): void {
    if (!this.#hooks.is_own_page()) return;
    const state: State = { ...(history.state as State | null), scanstitch_view: view };
    history.pushState(state, '');
  }

  #onPop = ({ state }: PopStateEvent): void => {
    if (this.#hooks.is_own_page()) this.#hooks.show((state as State | null)?.scanstitch_view ?? '');
  };
}
