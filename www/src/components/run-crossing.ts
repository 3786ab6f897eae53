/** Replacement of a planar recording by one in space, or vice versa; the replaced one can be restored. */
import type { ReactiveControllerHost } from 'lit';
import type { Run } from './tools.js';
import type { Elsewhere } from './run-exchange.js';

type Crossing = Elsewhere & { shown: Run };

export class RunCrossing {
  readonly #host: ReactiveControllerHost;
  #crossing: Crossing | null = null;

  constructor(host: ReactiveControllerHost) {
    this.#host = host;
  }

  /** A recording replaces a run of the kind `from` by one of the kind `to`; `title`: that of the recording, or null. */
  cross(from: Run, to: Run, title: string | null): void {
    this.#change(from !== to && title !== null ? { shown: to, title, is_undone: false } : null);
  }

  /** Restores the run of the other kind, in place of the one with this title; null where there is none. */
  crossBack(title: string): Run | null {
    if (!this.#crossing) return null;
    const shown = this.#crossing.shown === 'planar' ? 'spatial' : 'planar';
    this.#change({ shown, title, is_undone: !this.#crossing.is_undone });
    return shown;
  }

  /** What the run can be exchanged for. */
  elsewhere(run: Run): Elsewhere | null {
    return this.#crossing?.shown === run ? this.#crossing : null;
  }

  forget(): void {
    this.#change(null);
  }

  #change(crossing: Crossing | null): void {
    this.#crossing = crossing;
    this.#host.requestUpdate();
  }
}
