/** Files dragged over an element and dropped on it. */
import { html, nothing, type ReactiveController, type ReactiveControllerHost, type TemplateResult } from 'lit';
import { icon } from './icons.js';

type Host = ReactiveControllerHost & { readonly renderRoot: EventTarget };

/**
 * A counter distinguishes leaving the element from entering one of its children. A target inside another one keeps what it takes to
 * itself.
 */
export class DropTarget implements ReactiveController {
  isOver = false;
  #depth = 0;
  #host: Host;
  #take: (transfer: DataTransfer, event: DragEvent) => void;
  #expect: (transfer: DataTransfer) => void;

  /** `expect` is called whenever files come over the element. */
  constructor(
    host: Host,
    take: (transfer: DataTransfer, event: DragEvent) => void,
    expect: (transfer: DataTransfer) => void = () => undefined,
  ) {
    this.#host = host;
    this.#take = take;
    this.#expect = expect;
    host.addController(this);
  }

  hostConnected(): void {
    const listeners = { dragenter: this.#enter, dragover: this.#over, dragleave: this.#leave, drop: this.#drop };
    for (const [type, listener] of Object.entries(listeners)) {
      this.#host.renderRoot.addEventListener(type, listener as (event: Event) => void);
    }
  }

  hostDisconnected(): void {
    this.#become(0);
  }

  #enter = (event: DragEvent): void => {
    if (!event.dataTransfer || !hasFiles(event)) return;
    keep(event);
    if (this.#depth === 0) this.#expect(event.dataTransfer);
    this.#become(this.#depth + 1);
  };

  #over = (event: DragEvent): void => {
    if (!hasFiles(event) || !event.dataTransfer) return;
    keep(event);
    event.dataTransfer.dropEffect = 'copy';
  };

  #leave = (event: DragEvent): void => {
    if (!hasFiles(event)) return;
    event.stopPropagation();
    this.#become(Math.max(0, this.#depth - 1));
  };

  #drop = (event: DragEvent): void => {
    this.#become(0);
    if (!event.dataTransfer || !hasFiles(event)) return;
    keep(event);
    this.#take(event.dataTransfer, event);
  };

  /** Over all of the element, while files are over it. `styles`: dropStyles. */
  hint(words: string): TemplateResult | typeof nothing {
    if (!this.isOver) return nothing;
    return html`<div class="drop-hint" aria-hidden="true">
      <div>${icon('download', 28)}${words}</div>
    </div>`;
  }

  #become(depth: number): void {
    this.#depth = depth;
    this.isOver = depth > 0;
    this.#host.requestUpdate();
  }
}

function keep(event: DragEvent): void {
  event.preventDefault();
  event.stopPropagation();
}

/** Whether it brings files that nobody has taken yet, as the host's content beside the map may. */
function hasFiles(event: DragEvent): boolean {
  return !event.defaultPrevented && (event.dataTransfer?.types.includes('Files') ?? false);
}
