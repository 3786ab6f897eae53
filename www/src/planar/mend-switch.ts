/** Opens and closes what a map is mended with, and draws what lies on the map beside it; its code is loaded with the first use. */
import { html, nothing, type ReactiveControllerHost, type TemplateResult } from 'lit';
import { Fetched } from '../run/fetched.js';
import { memoizeLast } from '../views/memoize-last.js';
import type { MapExtra } from '../views/map-layer.js';
import type { Mending } from './mending.js';
import type { PlanarSession } from './session.js';

type PlanLayers = typeof import('./plan-layer.js');
type LaidPlan = Awaited<ReturnType<PlanLayers['laidPlan']>>;

/** Of a plan, before somebody says otherwise. */
const OPACITY = 0.5;

export class MendSwitch {
  #mending: Mending | null = null;
  #isOpen = false;
  #layers: PlanLayers | null = null;
  readonly #plan: Fetched<LaidPlan>;
  readonly #changes: Fetched<MapExtra | null>;
  readonly #planExtra = memoizeLast((layers: PlanLayers, ...laid: Parameters<PlanLayers['planExtra']>) =>
    layers.planExtra(...laid),
  );
  readonly #listed = memoizeLast((...extras: (MapExtra | null)[]) => extras.filter((extra) => extra !== null));

  constructor(readonly host: ReactiveControllerHost & { readonly session: PlanarSession }) {
    this.#plan = new Fetched<LaidPlan>(host, null);
    this.#changes = new Fetched<MapExtra | null>(host, null);
  }

  /** Null while the map is not mended; another session has another map. */
  get mending(): Mending | null {
    return this.#isOpen ? this.#kept : null;
  }

  /** Closed and opened again, it is as it was. */
  get #kept(): Mending | null {
    return this.#mending?.session === this.host.session ? this.#mending : null;
  }

  /** Looks at a map that has changed. */
  follow(): void {
    const { session } = this.host;
    this.mending?.follow();
    // While a step is taken, what was there before is better than nothing.
    if (session.phase !== 'done' && session.snapshot) return;
    const { snapshot } = session;
    const hasPlan = session.client?.steps.some(({ action }) => action === 'lay_plan') === true;
    this.#plan.want(session, [snapshot], hasPlan ? () => this.#askPlan(session) : null);
    const isJoined = snapshot !== null && (session.dataset?.scans.filter(({ isLog }) => isLog).length ?? 0) > 1;
    this.#changes.want(session, [snapshot], isJoined ? () => askChanges(session) : null);
  }

  async #askPlan(session: PlanarSession): Promise<LaidPlan> {
    this.#layers = await import('./plan-layer.js');
    return this.#layers.laidPlan(await session.ask('plan'), session.pictures);
  }

  /** What is drawn on the map beside its own: a plan as the points have it that are being given, and what moved. */
  get extras(): readonly MapExtra[] {
    const plan = this.mending?.part === 'plan' ? this.mending.plan : null;
    const laid = plan ? plan.placed && plan.sheet && { placed: plan.placed, sheet: plan.sheet } : this.#plan.value;
    const opacity = this.#kept?.plan.opacity ?? OPACITY;
    const extra = laid && this.#layers ? this.#planExtra(this.#layers, laid.placed, laid.sheet, opacity) : null;
    return this.#listed(extra, this.#changes.value);
  }

  readonly toggle = async (): Promise<void> => {
    const { host } = this;
    const [{ mendLayer, Mending }, layers] = await Promise.all([import('./mend-panel.js'), import('./plan-layer.js')]);
    this.#layers = layers;
    this.#isOpen = this.mending === null;
    this.#mending = this.#kept ?? new Mending(host.session, () => host.requestUpdate(), mendLayer);
    host.requestUpdate();
  };

  /** Beside the map, with the scan that is selected. */
  panel(selected: number | null): TemplateResult | typeof nothing {
    return this.mending
      ? html`<scanstitch-mend .mending=${this.mending} .selected=${selected} @closed=${this.toggle}></scanstitch-mend>`
      : nothing;
  }
}

async function askChanges(session: PlanarSession): Promise<MapExtra | null> {
  const [{ changesExtra }, changes] = await Promise.all([import('./changes-layer.js'), session.ask('changes')]);
  return changesExtra(changes);
}
