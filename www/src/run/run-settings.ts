/** The settings that a run begins with: of the host's attributes and of the page's address, which holds them from then on. */
import { property } from 'lit/decorators.js';
import type { Address } from '../views/address.js';
import { beginning, ownerOf, rememberSettings, type SettingsFacts } from '../views/settings-link.js';
import { RunEvents } from './run-events.js';
import { RunPanels } from './run-panels.js';
import { whileConnected } from '../components/while-connected.js';

/** The part of a session that has settings. */
interface Configured<Settings extends object> {
  facts: SettingsFacts<Settings> | null;
  settings: Settings | null;
  beginWith(initialSettings: (facts: SettingsFacts<Settings>) => Settings): void;
  configure(settings: Settings): void;
}

/** Fires `settings-refused` with sentences about settings that cannot be taken. */
export abstract class RunSettings<Settings extends object> extends RunPanels {
  @property({ attribute: false }) initialSettings = '';
  @property({ attribute: false }) preset = '';
  /** Where settings are kept; null: nowhere. */
  @property({ attribute: false }) address: Address | null = null;

  abstract session: Configured<Settings>;
  protected readonly events = new RunEvents(this);

  constructor() {
    super();
    whileConnected(this, window, 'hashchange', () => this.onHash());
  }

  override connectedCallback(): void {
    super.connectedCallback();
    this.session.beginWith((facts) => this.settingsToBegin(facts));
  }

  protected settingsToBegin(facts: SettingsFacts<Settings>): Settings {
    const fragment = this.address?.fragment ?? '';
    const begun = beginning(this.of.kind, facts, this.preset, this.initialSettings, fragment);
    begun.faults?.then(
      (faults) => {
        this.events.settingFaults = faults;
        this.requestUpdate();
      },
      () => undefined, // what is right of them is used all the same
    );
    return begun.settings;
  }

  /** Writes its settings into the page's address, where that holds those of this element. */
  writeAddress(): void {
    const { facts, settings } = this.session;
    if (this.address) rememberSettings(this.address, this.of.kind, facts, settings);
  }

  private onHash(): void {
    const { facts } = this.session;
    if (!this.address || !facts || ownerOf(this.address.fragment) !== this.of.kind) return;
    const settings = this.settingsToBegin(facts);
    // Back and forward come here, too, and a run is not to be computed again for them.
    if (JSON.stringify(settings) !== JSON.stringify(this.session.settings)) this.session.configure(settings);
  }
}
