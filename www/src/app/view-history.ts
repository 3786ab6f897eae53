/** The views that were opened, in the browser's history: back and forward move between them. */
import type { ReactiveControllerHost } from 'lit';
import { whileConnected } from '../components/while-connected.js';

interface State {
  scanstitch_view?: string;
}

export interface ViewHistoryHooks {
  /** Whether the page is ours: an element on the page of a host leaves its history alone. */
  isOwnPage(): boolean;
  /** Shows a view that was opened before; empty: the one that the page began with, or that its address names now. */
  show(view: string): void;
}

export class ViewHistory {
  readonly #hooks: ViewHistoryHooks;

  constructor(host: ReactiveControllerHost, hooks: ViewHistoryHooks) {
    this.#hooks = hooks;
    whileConnected(host, window, 'popstate', ({ state }) => {
      if (hooks.isOwnPage()) hooks.show((state as State | null)?.scanstitch_view ?? '');
    });
  }

  /** A view was opened. The address is as it was: a view that keeps something in it sees to that itself. */
  push(view: string): void {
    const state = history.state as State | null;
    if (!this.#hooks.isOwnPage() || state?.scanstitch_view === view) return;
    history.pushState({ ...state, scanstitch_view: view }, '');
  }

  /** The present entry is of this view, which is about to be opened: that needs no entry of its own. */
  mark(view: string): void {
    history.replaceState({ ...(history.state as State | null), scanstitch_view: view }, '');
  }
}
