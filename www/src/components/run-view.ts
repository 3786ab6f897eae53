/** What the page's frame (header, menus) and the views of a run say to each other. */
import { html, nothing, type TemplateResult } from 'lit';
import './messages.js';
import type { SpatialInputs } from '../engine/spatial-client.js';
import type { SpatialSettings } from '../engine/spatial-protocol.js';
import type { MenuItem } from './menu.js';
import type { Message } from './messages.js';

/** What the header shows of a run. */
export interface ViewFacts {
  title: string;
  /** "10 scans"; empty before anything is there. */
  count: string;
  /** Path of the reference trajectory; empty without. */
  reference: string;
  can_export: boolean;
  /** Another object for every new result. */
  result: unknown;
}

export const NO_FACTS: ViewFacts = { title: '', count: '', reference: '', can_export: false, result: null };

/**
 * One way to look at a run: scans in the plane, or depth images and clouds in space. It fires `facts-changed` whenever
 * the header has something new to show, `files-wanted` ('files', 'folder' or 'sample') where it offers to open some,
 * and `scanstitch-stitched` when a computation is over.
 */
export interface RunView extends HTMLElement {
  readonly facts: ViewFacts;
  readonly exports: readonly MenuItem[];
  clear(): void;
  removeReference(): void;
  runExport(id: string): Promise<void>;
  /** What the evaluation takes over from a run that is done; null before. */
  filesToEvaluate(): Promise<GivenFiles | null>;
}

/** A run of the reconstruction, to be compared with its reference. */
export interface GivenFiles {
  /** Null: the truth is still to be dropped. */
  reference: { name: string; bytes: ArrayBuffer } | null;
  estimate: { name: string; text: string };
  /** The run's map, as PLY. */
  readMap: () => Promise<Uint8Array>;
}

/** A recording to compare strategies on. */
export interface GivenRecording {
  title: string;
  inputs: SpatialInputs;
  /** How its frames are read. */
  settings: Partial<SpatialSettings>;
}

export function sameFacts(a: ViewFacts, b: ViewFacts): boolean {
  return (Object.keys(a) as (keyof ViewFacts)[]).every((key) => a[key] === b[key]);
}

export type Layout = 'wide' | 'medium' | 'narrow';

/** Tabs beside or below the map, with the panel of the one that is chosen. `styles`: layout_styles. */
export function tabs<T extends string>(
  names: readonly { tab: T; label: string }[],
  chosen: T,
  panel: unknown,
  choose: (tab: T) => void,
): TemplateResult {
  const onKey = (event: KeyboardEvent): void => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    const list = event.currentTarget as HTMLElement;
    const at = names.findIndex(({ tab }) => tab === chosen);
    const next = names.at((at + step) % names.length)?.tab ?? chosen;
    choose(next);
    requestAnimationFrame(() => list.querySelector<HTMLElement>(`#tab-${next}`)?.focus());
  };
  return html`<aside class="side tabs" aria-label="Details">
    <div role="tablist" aria-label="Details" @keydown=${onKey}>
      ${names.map(
        ({ tab, label }) =>
          html`<button
            role="tab"
            id="tab-${tab}"
            aria-controls="panel"
            aria-selected=${tab === chosen}
            tabindex=${tab === chosen ? 0 : -1}
            @click=${() => choose(tab)}
          >
            ${label}
          </button>`,
      )}
    </div>
    <div id="panel" role="tabpanel" aria-labelledby="tab-${chosen}">${panel}</div>
  </aside>`;
}

/** What both kinds of run say of themselves while they go on. */
export interface ActiveSession {
  readonly phase: string;
  readonly activity: string;
  readonly progress: number | null;
  readonly messages: readonly Message[];
  stop(): void;
  resume(): void;
  dismissMessages(): void;
}

/** What goes on at the moment, over the map, with what can be done about it. */
export function activity(session: ActiveSession): TemplateResult | typeof nothing {
  switch (session.phase) {
    case 'reading':
    case 'running':
      return activityBox(session.activity, session.progress, 'Stop', () => session.stop());
    case 'stopped':
      return activityBox('Stopped: the map so far', null, 'Go on', () => session.resume());
    case 'crashed':
      return activityBox('Not computed since the crash', null, 'Compute again', () => session.resume());
    default:
      return nothing;
  }
}

/** What the session has to tell, until it is dismissed. */
export function messages(session: ActiveSession): TemplateResult {
  return html`<scanstitch-messages
    .messages=${session.messages}
    @messages-dismissed=${() => session.dismissMessages()}
  ></scanstitch-messages>`;
}

function activityBox(words: string, progress: number | null, action: string, act: () => void): TemplateResult {
  return html`<div class="activity">
    <div class="activity-words">
      <span>${words}</span><button class=${progress === null ? 'primary' : ''} @click=${act}>${action}</button>
    </div>
    ${progress === null ? '' : html`<progress max="1" .value=${progress} aria-label=${words}></progress>`}
  </div>`;
}
