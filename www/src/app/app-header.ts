/** The page's header: what is on the page, the views that can be opened, files in and out. */
import { html, nothing, type TemplateResult } from 'lit';
import '../components/menu.js';
import { baseName } from '../views/format.js';
import { iconButton } from '../components/icon-button.js';
import { icon, logo } from '../components/icons.js';
import type { MenuItem } from '../components/menu.js';
import { fullScreenButton, type Layout } from '../run/run-parts.js';
import type { ViewFacts } from '../run/run-kind.js';
import { type Run, type Tool, TOOLS, type View } from '../components/tools.js';

/** What the header shows, and what its buttons do. */
export interface Header {
  view: View;
  /** The view of a run that is shown, or lies behind one beside it. */
  run: Run;
  facts: ViewFacts;
  exports: readonly MenuItem[];
  openItems: readonly MenuItem[];
  layout: Layout;
  isDark: boolean;
  /** Whether it fills the screen; null where the browser does not allow that. */
  fullScreen: boolean | null;
  go(tool: Tool): void;
  open(id: string): void;
  /** Someone is about to choose files. */
  expectFiles(): void;
  runExport(id: string): void;
  removeReference(): void;
  toggleTheme(): void;
  toggleFullScreen(): void;
}

/** `styles`: appStyles. */
export function appHeader(has: Header): TemplateResult {
  const shown: Tool = has.view === 'planar' || has.view === 'spatial' ? 'map' : has.view;
  const isAside = shown !== 'map';
  const isWide = has.layout === 'wide';
  return html`<header class="bar ${isAside ? 'aside' : ''}" part="header">
    <div class="brand">
      <slot name="title">${logo()}<span>Scanstitch</span></slot>
    </div>
    <nav class="tools" aria-label="Tools">
      ${TOOLS.map(
        ({ tool, label, short, about }) =>
          html`<button aria-current=${tool === shown ? 'page' : nothing} title=${about} @click=${() => has.go(tool)}>
            ${isWide ? label : (short ?? label)}
          </button>`,
      )}
    </nav>
    <div class="dataset">${isAside ? nothing : dataset(has)}</div>
    <nav class="actions" aria-label="Actions">
      <scanstitch-menu
        ?hidden=${isAside}
        label="Open"
        icon="open"
        .items=${has.openItems}
        ?compact=${!isWide}
        @menu-opened=${has.expectFiles}
        @menu-chosen=${({ detail }: CustomEvent<string>) => has.open(detail)}
      ></scanstitch-menu>
      <scanstitch-menu
        ?hidden=${isAside}
        label="Export"
        icon="download"
        .items=${has.exports}
        ?compact=${!isWide}
        ?disabled=${!has.facts.canExport}
        @menu-chosen=${({ detail }: CustomEvent<string>) => has.runExport(detail)}
      ></scanstitch-menu>
      ${iconButton(has.isDark ? 'sun' : 'moon', has.isDark ? 'Light colours' : 'Dark colours', has.toggleTheme, { hint: has.isDark ? 'Light colours' : 'Dark colours' })}
      ${has.fullScreen === null ? nothing : fullScreenButton(has.fullScreen, has.toggleFullScreen)}
    </nav>
  </header>`;
}

/** What is open, and the ground truth beside it. */
function dataset({ facts, run, layout, removeReference }: Header): TemplateResult | typeof nothing {
  const { title, count, reference } = facts;
  if (title === '') return nothing;
  const name = baseName(reference);
  return html`<span class="named"
      ><span class="title" title=${title}>${title}</span> <span class="muted count">${count}</span></span
    >${
      reference && layout !== 'narrow'
        ? html`<span class="chip" title="Ground truth: ${reference}"
            ><i class="dash ${run}"></i><span>${name}</span
            ><button
              class="quiet"
              @click=${removeReference}
              aria-label="Remove the ground truth ${name}"
              title="Remove the ground truth"
            >
              ${icon('close', 12)}
            </button></span
          >`
        : nothing
    }`;
}
