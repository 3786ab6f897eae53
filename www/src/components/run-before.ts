/** The result that a changed setting has replaced: it stays beside the new one until it is dismissed. */
import { html, type TemplateResult } from 'lit';
import { changeWords, type LabelledField } from '../views/setting-fields.js';
import type { Measure } from './before-after.js';

/** `overlay`: what the map draws of it. */
export interface Before<Settings, Overlay> {
  settings: Settings;
  measures: readonly Measure[];
  overlay: Overlay;
  isShown: boolean;
}

export interface BeforeHooks {
  show(isShown: boolean): void;
  goBack(): void;
  dismiss(): void;
}

/** `after`: null while it is computed. */
export function beforeAfter<Settings extends object>(
  { settings, measures, isShown }: Before<Settings, unknown>,
  now: Settings,
  after: readonly Measure[] | null,
  descriptions: readonly LabelledField<Settings>[],
  { show, goBack, dismiss }: BeforeHooks,
): TemplateResult {
  void import('./before-after.js');
  return html`<scanstitch-before-after
    .changes=${changeWords(descriptions, settings, now)}
    .earlier=${measures}
    .later=${after}
    ?shown=${isShown}
    @before-shown=${({ detail }: CustomEvent<boolean>) => show(detail)}
    @before-wanted=${goBack}
    @before-dismissed=${dismiss}
  ></scanstitch-before-after>`;
}
