/** The panels around the map of a run: which of them are unfolded, and what unfolds them. */
import { html, LitElement, nothing, type TemplateResult } from 'lit';
import { property, state } from 'lit/decorators.js';
import type { Status } from '../views/map-painter.js';
import type { Rgb } from '../views/palette.js';
import type { Controls } from './controls.js';
import { type Fold, type FoldChange, NONE_OPEN } from './folds.js';
import type { Panel, RunKind } from './run-kind.js';
import { fullScreenButton, type Layout, tabs } from './run-parts.js';
import '../drawing/timeline.js';
import { fire } from '../components/fire.js';

interface TimelineFacts {
  count: number;
  until: number;
  statuses: readonly Status[];
  colors: readonly Rgb[] | null;
  dark: boolean;
}

/** Fires `panel-folded` where one is to be unfolded or folded. */
export abstract class RunPanels extends LitElement {
  @property({ attribute: false }) layout: Layout = 'wide';
  /** Whether there is little height. */
  @property({ attribute: false }) isLow = false;
  @property({ attribute: false }) controls: Controls = 'full';
  /** Those that are unfolded. */
  @property({ attribute: false }) folds: ReadonlySet<Fold> = NONE_OPEN;
  /** Whether it fills the screen; null where that is not possible, or where the header has the button. */
  @property({ attribute: false }) fullScreen: boolean | null = null;
  /** The one whose tab is chosen, below a narrow map. */
  @state() private panel: Panel = 'figures';

  abstract readonly of: RunKind;
  protected abstract renderFigures(): TemplateResult | typeof nothing;
  protected abstract renderTable(): TemplateResult | typeof nothing;
  protected abstract renderDetails(): TemplateResult | typeof nothing;
  protected abstract renderSettings(): TemplateResult;

  /** What the panels are made of, with the first one that is unfolded. */
  protected loadPanels(): void {
    void import('./panels.js');
  }

  /** Whether the figures have one line. */
  protected get isCompact(): boolean {
    return this.controls !== 'full' || (this.layout !== 'narrow' && !this.folds.has('figures'));
  }

  /** Whether a panel stands around the map; in the medium layout two of them side by side would leave it no room. */
  protected shows(panel: Panel): boolean {
    const { layout, folds } = this;
    if (layout === 'narrow' || this.controls !== 'full' || !folds.has(panel)) return false;
    if (panel !== 'figures') this.loadPanels();
    return layout === 'wide' || panel !== 'settings' || !folds.has('details');
  }

  /** What was selected on the map or in the table is explained beside it, where there is room. */
  protected unfoldDetails(): void {
    const hasRoom = this.layout !== 'narrow' && this.controls === 'full';
    if (hasRoom && !this.folds.has('details')) this.fold({ fold: 'details', isOpen: true, isLasting: false });
  }

  /** Buttons beside the slider; a narrow map has tabs instead. */
  private renderFolds(): TemplateResult | typeof nothing {
    const { of, layout } = this;
    if (layout === 'narrow' || this.controls !== 'full') return nothing;
    return html`<div class="folds" role="group" aria-label="Panels">
      ${of.order.map((panel) => {
        const isOpen = this.shows(panel);
        const toggle = (): void => {
          const isInTheWay = layout === 'medium' && panel === 'settings' && !isOpen && this.folds.has('details');
          if (isInTheWay) this.fold({ fold: 'details', isOpen: false, isLasting: true });
          this.fold({ fold: panel, isOpen: !isOpen, isLasting: true });
        };
        return html`<button class="quiet" aria-expanded=${isOpen} @click=${toggle}>${of.panels[panel]}</button>`;
      })}
    </div>`;
  }

  /** Below a narrow map. */
  protected renderTabs(): TemplateResult {
    const { panels, order } = this.of;
    const contents: Record<Panel, () => TemplateResult | typeof nothing> = {
      figures: () => this.renderFigures(),
      table: () => this.renderTable(),
      details: () => this.renderDetails(),
      settings: () => this.renderSettings(),
    };
    const isOpen = this.folds.has('tabs');
    if (isOpen) this.loadPanels();
    const toggle = (): void => this.fold({ fold: 'tabs', isOpen: !isOpen, isLasting: true });
    const choose = (panel: Panel): void => {
      this.panel = panel;
      if (!isOpen) toggle();
    };
    const names = order.map((tab) => ({ tab, label: panels[tab] }));
    return tabs(names, this.panel, isOpen ? contents[this.panel]() : nothing, choose, { isOpen, toggle });
  }

  /** Below the map: what is being done, the slider that builds it, and what unfolds the panels around it. */
  protected renderBelow(
    { count, until, statuses, colors, dark }: TimelineFacts,
    onUntil: (event: CustomEvent<number>) => void,
    activity: unknown,
  ): TemplateResult {
    const { fullScreen } = this;
    return html`<div class="below">
      ${activity}
      <scanstitch-timeline
        .count=${count}
        .until=${until}
        .statuses=${statuses}
        .colors=${colors}
        noun=${this.of.noun}
        ?dark=${dark}
        @until-changed=${onUntil}
      ></scanstitch-timeline>
      ${this.renderFolds()}
      ${fullScreen === null ? nothing : fullScreenButton(fullScreen, () => this.want('full-screen'))}
    </div>`;
  }

  /** Asks the page's frame to open something. */
  protected want(detail: string): void {
    fire(this, 'files-wanted', detail);
  }

  private fold(detail: FoldChange): void {
    fire(this, 'panel-folded', detail);
  }
}
