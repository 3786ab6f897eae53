/** What the stages in the plane and in space share: the element, its keys, its tools, and when it is painted. */
import { html, LitElement, type PropertyValues, type TemplateResult } from 'lit';
import { property, query, state } from 'lit/decorators.js';
import { mapButton } from '../components/map-toolbar.js';
import { Gestures, type GestureTarget } from '../views/gestures.js';
import { belongsToPage, PAN_STEP, ZOOM_STEP } from '../views/map-keys.js';
import type { PlaneScene } from './plane-painter.js';
import type { Pose } from './protocol.js';
import { pressStageKey } from './stage-keys.js';
import { watchSize } from '../components/watch-size.js';

/** Translation of the source per press of an arrow key (pixels), and rotation per bracket key (rad); both less with Shift. */
const KEY_PIXELS = 4;
const KEY_TURN = Math.PI / 180;
const FINE = 0.125;

/**
 * Shows two clouds; the source can be dragged.
 *
 * Fires `source-dragged` with a pose, `source-released`, and `stage-key` with what a key means for the run.
 */
export abstract class LabStage extends LitElement implements GestureTarget {
  @property({ attribute: false }) scene: PlaneScene | null = null;
  /** Changes with the clouds, so that the view is fitted again. */
  @property({ attribute: false }) fit_key: unknown = null;
  @property() description = '';
  /** Whether every drag moves the source: for fingers, which do not hit points. */
  @state() protected holds = false;
  @state() private guarded = false;
  @query('canvas') protected canvas!: HTMLCanvasElement;
  @query('.stage') protected stage!: HTMLElement;

  protected size = { width: 0, height: 0 };
  private frame = 0;
  private gestures = new Gestures(this, this);

  constructor() {
    super();
    watchSize(
      this,
      () => this.resize(),
      () => this.stage,
    );
  }

  abstract fit(): void;
  abstract shift(right: number, down: number): void;
  abstract release(): void;
  abstract zoom(x: number, y: number, factor: number): void;
  abstract hover(x: number, y: number): void;
  /** Draws the scene; the stage has a size. */
  protected abstract draw(scene: PlaneScene): void;
  /** `was_empty`: before, the stage had no size. */
  protected abstract resized(was_empty: boolean): void;
  protected abstract panBy(right: number, down: number): void;
  protected abstract shiftSource(right: number, down: number): void;
  /** Counter-clockwise on the screen, rad. */
  protected abstract turnSource(angle: number): void;

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    cancelAnimationFrame(this.frame);
    this.frame = 0;
  }

  protected override firstUpdated(): void {
    this.gestures.listen(this.stage);
    this.resize();
  }

  protected override updated(changed: PropertyValues<this>): void {
    if (changed.has('fit_key')) this.fit();
    this.requestPaint();
  }

  /** `keys`: what the keys do, for screen readers; `own`: tools that this stage alone has. */
  protected renderStage(canvas: unknown, keys: string, hold_hint: string, own: unknown): TemplateResult {
    return html`<div
        class="stage"
        tabindex="0"
        role="application"
        aria-roledescription="registration"
        aria-label="The two clouds"
        aria-describedby="description keys"
        ?data-guarded=${this.guarded}
        @keydown=${this.onKey}
        @dblclick=${() => this.fit()}
        @focus=${this.updateGuard}
        @blur=${this.updateGuard}
      >
        ${canvas}
        <p id="description" class="visually-hidden">${this.description}</p>
        <p id="keys" class="visually-hidden">${keys}</p>
      </div>
      <div class="controls" role="toolbar" aria-label="View">
        ${mapButton('plus', 'Zoom in', 'Zoom in (+)', () => this.zoomBy(ZOOM_STEP))}
        ${mapButton('minus', 'Zoom out', 'Zoom out (−)', () => this.zoomBy(1 / ZOOM_STEP))}
        ${mapButton('fit', 'Show both clouds', 'Show both clouds (F)', () => this.fit())}
        ${mapButton(
          'hand',
          'Drag the source',
          hold_hint,
          () => {
            this.holds = !this.holds;
          },
          { pressed: this.holds },
        )}
        ${own}
      </div>`;
  }

  protected resize(): void {
    const { clientWidth: width, clientHeight: height } = this.stage;
    const was_empty = this.size.width === 0;
    this.size = { width, height };
    this.updateGuard();
    this.resized(was_empty);
    cancelAnimationFrame(this.frame);
    this.paint();
  }

  protected requestPaint(): void {
    if (this.frame === 0) this.frame = requestAnimationFrame(() => this.paint());
  }

  protected paint(): void {
    this.frame = 0;
    const { scene, size } = this;
    if (scene && size.width > 0 && size.height > 0) this.draw(scene);
  }

  tap(): void {
    this.stage.focus();
  }

  leave(): void {
    this.stage.style.cursor = '';
  }

  isGuarded(): boolean {
    return this.guarded;
  }

  protected zoomBy(factor: number): void {
    this.zoom(this.size.width / 2, this.size.height / 2, factor);
  }

  protected tell(name: 'source-dragged' | 'source-released' | 'stage-key', detail: Pose | string | null): void {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  private updateGuard(): void {
    this.guarded = belongsToPage(this.stage);
  }

  private onKey(event: KeyboardEvent): void {
    const fine = event.shiftKey ? FINE : 1;
    pressStageKey(event, {
      shift: (right, down) => this.shiftSource(right * KEY_PIXELS * fine, down * KEY_PIXELS * fine),
      turn: (direction) => this.turnSource(direction * KEY_TURN * fine),
      zoom: (direction) => this.zoomBy(ZOOM_STEP ** direction),
      fit: () => this.fit(),
      pan: (right, down) => this.panBy(-right * PAN_STEP, -down * PAN_STEP),
      tell: (what) => this.tell('stage-key', what),
    });
  }
}
