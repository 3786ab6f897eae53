/** The page's header: what is on the page, the views that can be opened, files in and out. */
import { html, nothing, type TemplateResult } from 'lit';
import './menu.js';
import { baseName } from '../views/format.js';
import { icon, logo } from './icons.js';
import type { MenuItem } from './menu.js';
import type { ViewFacts } from './run-view.js';

/** Views of a run, and views beside it. */
export type Run = 'planar' | 'spatial';
export type View = Run | 'evaluation' | 'bev' | 'strategies' | 'icp';

/** What the header shows, and what its buttons do. */
export interface Header {
  view: View;
  /** The view of a run that is shown, or lies behind one beside it. */
  run: Run;
  facts: ViewFacts;
  exports: readonly MenuItem[];
  open_items: readonly MenuItem[];
  is_narrow: boolean;
  is_dark: boolean;
  /** Opens a view beside the run, or goes back to the run. */
  toggle(view: Exclude<View, Run>): void;
  open(id: string): void;
  /** Someone is about to choose files. */
  expectFiles(): void;
  runExport(id: string): void;
  removeReference(): void;
  toggleTheme(): void;
}

const TITLES: Partial<Record<View, string>> = {
  bev: "Bird's-eye view",
  strategies: 'Strategy comparison',
  evaluation: 'Trajectory evaluation',
  icp: 'ICP lab',
};

/** `styles`: app_styles. */
export function appHeader(has: Header): TemplateResult {
  const { title, count, reference, can_export } = has.facts;
  const is_evaluating = has.view === 'evaluation';
  const is_bev = has.view === 'bev';
  const is_comparing = has.view === 'strategies';
  const is_lab = has.view === 'icp';
  const is_aside = is_evaluating || is_bev || is_comparing || is_lab;
  return html`<header class="bar" part="header">
    <div class="brand">
      <slot name="title">${logo()}<span>Scanstitch</span></slot>
    </div>
    <div class="dataset">
      ${
        is_aside
          ? html`<span class="title">${TITLES[has.view]}</span>`
          : title
            ? html`<span class="title" title=${title}>${title}</span> <span class="muted count">${count}</span> ${
                  reference && !has.is_narrow
                    ? html`<span class="chip" title="Ground truth: ${reference}"
                        ><i class="dash ${has.run}"></i>${baseName(reference)}<button
                          class="quiet"
                          @click=${() => has.removeReference()}
                          aria-label="Remove the ground truth ${baseName(reference)}"
                          title="Remove the ground truth"
                        >
                          ${icon('close', 12)}
                        </button></span
                      >`
                    : nothing
                }`
            : nothing
      }
    </div>
    <nav aria-label="Actions">
      <button
        ?hidden=${is_evaluating || is_bev || is_lab || has.run !== 'spatial' || title === ''}
        aria-pressed=${is_comparing}
        title="Compare strategies: what a map costs in memory and time, and gains in accuracy"
        @click=${() => has.toggle('strategies')}
      >
        ${is_comparing ? 'Back to the map' : has.is_narrow ? 'Strategies' : 'Compare strategies'}
      </button>
      <button
        ?hidden=${is_evaluating || is_comparing || is_bev}
        aria-pressed=${is_lab}
        title="ICP lab: step through a registration, from any start, by any method"
        @click=${() => has.toggle('icp')}
      >
        ${is_lab ? 'Back to the map' : 'ICP'}
      </button>
      <button
        ?hidden=${is_evaluating || is_comparing || is_lab}
        aria-pressed=${is_bev}
        title="Bird's-eye view: project points of a top view into a front view"
        @click=${() => has.toggle('bev')}
      >
        ${is_bev ? 'Back to the map' : has.is_narrow ? 'BEV' : "Bird's-eye view"}
      </button>
      <button
        ?hidden=${is_bev || is_comparing || is_lab}
        aria-pressed=${is_evaluating}
        title="Compare trajectories with ground truth"
        @click=${() => has.toggle('evaluation')}
      >
        ${is_evaluating ? 'Back to the map' : 'Evaluate'}
      </button>
      <scanstitch-menu
        ?hidden=${is_aside}
        label="Open"
        icon="open"
        .items=${has.open_items}
        ?compact=${has.is_narrow}
        @menu-opened=${has.expectFiles}
        @menu-chosen=${({ detail }: CustomEvent<string>) => has.open(detail)}
      ></scanstitch-menu>
      <scanstitch-menu
        ?hidden=${is_aside}
        label="Export"
        icon="download"
        .items=${has.exports}
        ?compact=${has.is_narrow}
        ?disabled=${!can_export}
        @menu-chosen=${({ detail }: CustomEvent<string>) => has.runExport(detail)}
      ></scanstitch-menu>
      <button
        class="icon quiet"
        @click=${has.toggleTheme}
        aria-label=${has.is_dark ? 'Light colours' : 'Dark colours'}
        title=${has.is_dark ? 'Light colours' : 'Dark colours'}
      >
        ${icon(has.is_dark ? 'sun' : 'moon')}
      </button>
    </nav>
  </header>`;
}
