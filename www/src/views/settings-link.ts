/**
 * The settings that a page begins with, and a link that carries them: `#name=value`, in space `#spatial&name=value`. In the
 * plane it may say as well what the columns of tables are: `#table=ranges=2:542,...`.
 */
import { settingFaults } from './setting-faults.js';
import { type LabelledField, parseSettings, writeSettings } from './setting-fields.js';

export type Settable = 'planar' | 'spatial';

/** The engine's description of its settings. */
export interface SettingsFacts<S extends object> {
  presets: readonly { name: string; settings: S }[];
  descriptions: readonly LabelledField<S>[];
}

/** Views that a fragment may name. */
const NAMED = ['spatial', 'bev', 'icp', 'evaluate', 'strategies', 'localize'] as const;

/** Which view a fragment is of. */
export function ownerOf(fragment: string): Settable | (typeof NAMED)[number] {
  const names = new URLSearchParams(fragment.replace(/^#/, ''));
  return NAMED.find((name) => names.has(name)) ?? 'planar';
}

/** Those of the preset, then what is given as text, then what the page's fragment holds for this view. */
export function settingsToBegin<S extends object>(
  view: Settable,
  { presets, descriptions }: SettingsFacts<S>,
  preset: string,
  given: string,
  fragment: string,
): S {
  const base = presets.find(({ name }) => name === preset)?.settings ?? presets[0]?.settings;
  if (!base) throw new Error('The engine names no preset.');
  const settings = parseSettings(given, base, descriptions);
  return ownerOf(fragment) === view ? parseSettings(fragment.replace(/^#/, ''), settings, descriptions) : settings;
}

/** What is wrong with the preset and the settings that `settingsToBegin` is given, in sentences. */
export function faultsToBegin<S extends object>(
  view: Settable,
  { presets, descriptions }: SettingsFacts<S>,
  preset: string,
  given: string,
  fragment: string,
): string[] {
  const names = presets.map(({ name }) => name);
  const wrongPreset =
    preset === '' || names.includes(preset) ? [] : [`“${preset}” is not a preset: ${names.join(', ')}`];
  // A fragment without a value is a place in the page, or the mark of a view; what tables are like is not a setting.
  const linked = ownerOf(fragment) === view ? [...new URLSearchParams(fragment.replace(/^#/, ''))] : [];
  const own = new URLSearchParams(linked.filter(([name, value]) => value !== '' && name !== 'table')).toString();
  return [...wrongPreset, ...settingFaults(given, descriptions), ...settingFaults(own, descriptions)];
}

/** Writes what differs from the default into the page's address; nothing is there before the engine is ready. */
export function rememberSettings<S extends object>(
  view: Settable,
  facts: SettingsFacts<S> | null,
  settings: S | null,
): void {
  const first = facts?.presets[0];
  const settingsText = first && settings ? writeSettings(settings, first.settings) : '';
  const table = view === 'planar' ? new URLSearchParams(location.hash.replace(/^#/, '')).get('table') : null;
  const text = [settingsText, ...(table === null ? [] : [`table=${table}`])].filter((part) => part !== '').join('&');
  const fragment = view === 'planar' ? `#${text}` : `#${view}&${text}`;
  history.replaceState(history.state, '', text === '' ? location.pathname + location.search : fragment);
}
