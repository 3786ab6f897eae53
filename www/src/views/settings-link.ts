/**
 * The settings that a page begins with, and a link that carries them: `#name=value`, in space `#spatial&name=value`. In the
 * plane it may say as well what the columns of tables are: `#table=ranges=2:542,...`.
 */
import type { Address } from './address.js';
import { type LabelledField, parseSettings, writeSettings } from './setting-fields.js';

export type Settable = 'planar' | 'spatial';

/** The engine's description of its settings. */
export interface SettingsFacts<S extends object> {
  presets: readonly { name: string; settings: S }[];
  descriptions: readonly LabelledField<S>[];
}

/** Views that a fragment may name. */
const NAMED = ['spatial', 'bev', 'icp', 'evaluate', 'strategies', 'localize', 'live'] as const;

/** Which view a fragment is of. */
export function ownerOf(fragment: string): Settable | (typeof NAMED)[number] {
  const names = new URLSearchParams(fragment.replace(/^#/, ''));
  return NAMED.find((name) => names.has(name)) ?? 'planar';
}

/**
 * The settings to begin with: those of the preset, then what is given as text, then what the page's fragment holds for this view.
 * `faults`: what is wrong with them, in sentences; null where nothing is given.
 */
export function beginning<S extends object>(
  view: Settable,
  { presets, descriptions }: SettingsFacts<S>,
  preset: string,
  given: string,
  fragment: string,
): { settings: S; faults: Promise<string[]> | null } {
  const base = presets.find(({ name }) => name === preset)?.settings ?? presets[0]?.settings;
  if (!base) throw new Error('The engine names no preset.');
  const names = presets.map(({ name }) => name);
  const wrongPreset =
    preset === '' || names.includes(preset) ? [] : [`“${preset}” is not a preset: ${names.join(', ')}`];
  const linked = ownerOf(fragment) === view ? fragment.replace(/^#/, '') : '';
  // A fragment without a value is a place in the page, or the mark of a view; what tables are like is not a setting.
  const named = [...new URLSearchParams(linked)].filter(([name, value]) => value !== '' && name !== 'table');
  const own = new URLSearchParams(named).toString();
  return {
    settings: parseSettings(linked, parseSettings(given, base, descriptions), descriptions),
    faults: preset + given + own === '' ? null : faultsOf([given, own], descriptions, wrongPreset),
  };
}

async function faultsOf<S extends object>(
  texts: readonly string[],
  descriptions: SettingsFacts<S>['descriptions'],
  others: readonly string[],
): Promise<string[]> {
  const { settingFaults } = await import('./setting-faults.js');
  return [...others, ...texts.flatMap((text) => settingFaults(text, descriptions))];
}

/** Writes what differs from the default into the address; nothing is there before the engine is ready. */
export function rememberSettings<S extends object>(
  address: Address,
  view: Settable,
  facts: SettingsFacts<S> | null,
  settings: S | null,
): void {
  const first = facts?.presets[0];
  const settingsText = first && settings ? writeSettings(settings, first.settings) : '';
  const table = view === 'planar' ? new URLSearchParams(address.fragment.replace(/^#/, '')).get('table') : null;
  const text = [settingsText, ...(table === null ? [] : [`table=${table}`])].filter((part) => part !== '').join('&');
  address.write(view === 'planar' || text === '' ? text : `${view}&${text}`);
}
