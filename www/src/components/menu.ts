import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { icon, type Sign } from './icons.js';
import { column, panel, shared, small } from './theme.js';
import { fire } from './fire.js';

/** Room left between the list and the edge of the window, CSS pixels. */
const EDGE = 8;
/** Three items, however low the window is. */
const LEAST_HEIGHT = 150;

export interface MenuItem {
  id: string;
  label: string;
  detail: string;
}

/**
 * A button that opens a short list. Arrow keys move in it, Escape and a click elsewhere close it.
 *
 * Fires `menu-opened`, and `menu-chosen` with the id of the item.
 */
@customElement('scanstitch-menu')
export class ScanstitchMenu extends LitElement {
  @property() label = '';
  @property() icon: Sign = 'chevron';
  @property({ attribute: false }) items: readonly MenuItem[] = [];
  @property({ type: Boolean }) disabled = false;
  @property({ type: Boolean }) primary = false;
  /** The button shows its sign alone. */
  @property({ type: Boolean }) compact = false;
  @state() private isOpen = false;
  @query('.list') private list!: HTMLElement;

  private get entries(): HTMLElement[] {
    return [...this.renderRoot.querySelectorAll<HTMLElement>('[role=menuitem]')];
  }

  private onOutside = (event: Event): void => {
    if (!event.composedPath().includes(this)) this.close(false);
  };

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    document.removeEventListener('pointerdown', this.onOutside, true);
  }

  protected override render(): TemplateResult {
    return html`<div @keydown=${this.onKey} @focusout=${this.onFocusOut}>
      <button
        class="${this.primary ? 'primary' : ''} ${this.compact ? 'icon' : ''}"
        aria-haspopup="menu"
        aria-expanded=${this.isOpen}
        aria-label=${this.label}
        title=${this.compact ? this.label : nothing}
        ?disabled=${this.disabled}
        @click=${() => (this.isOpen ? this.close(true) : this.open())}
      >
        ${icon(this.icon)}${this.compact ? nothing : html`${this.label}${icon('chevron', 12)}`}
      </button>
      ${
        this.isOpen
          ? html`<div class="list" role="menu" aria-label=${this.label}>
              ${this.items.map(
                ({ id, label, detail }) =>
                  html`<button role="menuitem" tabindex="-1" @click=${() => this.choose(id)}>
                    <span>${label}</span><small>${detail}</small>
                  </button>`,
              )}
            </div>`
          : nothing
      }
    </div>`;
  }

  private async open(): Promise<void> {
    this.isOpen = true;
    document.addEventListener('pointerdown', this.onOutside, true);
    fire(this, 'menu-opened');
    await this.updateComplete;
    this.keepOnScreen();
    this.entries[0]?.focus();
  }

  /** The list hangs from the button's right edge; where that is too far left for it, it is pushed to the right. It scrolls where
   * the window is too low. */
  private keepOnScreen(): void {
    const { left, top } = this.list.getBoundingClientRect();
    const overhang = EDGE - left;
    this.list.style.maxHeight = `${Math.max(innerHeight - top - EDGE, LEAST_HEIGHT)}px`;
    if (overhang > 0) this.list.style.right = `${-overhang}px`;
  }

  private close(giveFocusBack: boolean): void {
    this.isOpen = false;
    document.removeEventListener('pointerdown', this.onOutside, true);
    if (giveFocusBack) this.renderRoot.querySelector('button')?.focus();
  }

  private choose(id: string): void {
    this.close(true);
    fire(this, 'menu-chosen', id);
  }

  private onFocusOut(event: FocusEvent): void {
    const to = event.relatedTarget;
    if (this.isOpen && to instanceof Node && !this.renderRoot.contains(to)) this.close(false);
  }

  private onKey(event: KeyboardEvent): void {
    if (!this.isOpen) return;
    const { entries } = this;
    const at = entries.indexOf(this.shadowRoot?.activeElement as HTMLElement);
    const targets: Record<string, number> = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: -1 };
    const to = targets[event.key];
    if (to !== undefined) entries.at(to % entries.length)?.focus();
    else if (event.key === 'Escape') this.close(true);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  static override styles = [
    shared,
    css`
      :host {
        position: relative;
        display: inline-block;
      }
      button[aria-haspopup] > svg {
        display: var(--menu-icon, block);
      }
      .list {
        position: absolute;
        top: calc(100% + 4px);
        right: 0;
        z-index: 20;
        ${column};
        width: max-content;
        max-width: min(320px, 90vw);
        padding: 4px;
        overflow-y: auto;
        ${panel};
        box-shadow: var(--shadow);
      }
      .list button {
        flex-shrink: 0;
        flex-direction: column;
        align-items: flex-start;
        gap: 0;
        padding: 6px 12px;
        border: 0;
        text-align: left;
        white-space: normal;
      }
      small {
        ${small};
      }
    `,
  ];
}
