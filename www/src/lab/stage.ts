/** What the stages in the plane and in space share: the element, its keys, its tools, and when it is painted. */
import { html, LitElement, type PropertyValues, svg, type TemplateResult } from 'lit';
import { property, query, state } from 'lit/decorators.js';
import { type DrawingHost, DrawingSurface } from '../drawing/drawing-surface.js';
import { mapButton } from '../drawing/map-toolbar.js';
import { PAN_STEP, ZOOM_STEP } from '../views/map-keys.js';
import type { PlaneScene } from './plane-painter.js';
import type { Pose } from './protocol.js';
import type { Size } from '../views/viewport.js';
import { pressStageKey } from './stage-keys.js';

/** Translation of the source per press of an arrow key (pixels), and rotation per bracket key (rad); both less with Shift. */
const KEY_PIXELS = 4;
const KEY_TURN = Math.PI / 180;
const FINE = 0.125;
const HAND = svg`<path d="M8 1.8v12.4M1.8 8h12.4M6 3.6l2-1.8 2 1.8M6 12.4l2 1.8 2-1.8M3.6 6 1.8 8l1.8 2M12.4 6l1.8 2-1.8 2" />`;

/**
 * Shows two clouds; the source can be dragged.
 *
 * Fires `source-dragged` with a pose, `source-released`, and `stage-key` with what a key means for the run.
 */
export abstract class LabStage extends LitElement implements DrawingHost {
  @property({ attribute: false }) scene: PlaneScene | null = null;
  /** Changes with the clouds, so that the view is fitted again. */
  @property({ attribute: false }) fitKey: unknown = null;
  @property() description = '';
  /** Whether every drag moves the source: for fingers, which do not hit points. */
  @state() protected holds = false;
  @query('canvas') readonly canvas!: HTMLCanvasElement;
  @query('.stage') readonly stage!: HTMLElement;

  protected surface = new DrawingSurface(this);

  abstract fit(): void;
  abstract shift(right: number, down: number): void;
  abstract release(): void;
  abstract zoom(x: number, y: number, factor: number): void;
  abstract hover(x: number, y: number): void;
  abstract resized(wasEmpty: boolean): void;
  /** Draws the scene; the stage has a size. */
  protected abstract draw(scene: PlaneScene): void;
  protected abstract panBy(right: number, down: number): void;
  protected abstract shiftSource(right: number, down: number): void;
  /** Counter-clockwise on the screen, rad. */
  protected abstract turnSource(angle: number): void;

  protected override firstUpdated(): void {
    this.surface.begin();
  }

  protected override updated(changed: PropertyValues<this>): void {
    if (changed.has('fitKey')) this.fit();
    this.surface.requestPaint();
  }

  /** `keys`: what the keys do, for screen readers; `own`: tools that this stage alone has. */
  protected renderStage(canvas: unknown, keys: string, holdHint: string, own: unknown): TemplateResult {
    return html`<div
        class="stage"
        tabindex="0"
        role="application"
        aria-roledescription="registration"
        aria-label="The two clouds"
        aria-describedby="description keys"
        @keydown=${this.onKey}
      >
        ${canvas}
        <p id="description" class="visually-hidden">${this.description}</p>
        <p id="keys" class="visually-hidden">${keys}</p>
      </div>
      <div class="controls" role="toolbar" aria-label="View">
        ${mapButton('plus', 'Zoom in', 'Zoom in (+)', () => this.surface.zoomBy(ZOOM_STEP))}
        ${mapButton('minus', 'Zoom out', 'Zoom out (−)', () => this.surface.zoomBy(1 / ZOOM_STEP))}
        ${mapButton('fit', 'Show both clouds', 'Show both clouds (F)', () => this.fit())}
        ${mapButton(
          HAND,
          'Drag the source',
          holdHint,
          () => {
            this.holds = !this.holds;
          },
          { pressed: this.holds },
        )}
        ${own}
      </div>`;
  }

  protected get size(): Size {
    return this.surface.size;
  }

  paint(): void {
    if (this.scene) this.draw(this.scene);
  }

  tap(): void {
    this.stage.focus();
  }

  leave(): void {
    this.stage.style.cursor = '';
  }

  protected tell(name: 'source-dragged' | 'source-released' | 'stage-key', detail: Pose | string | null): void {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  private onKey(event: KeyboardEvent): void {
    const fine = event.shiftKey ? FINE : 1;
    pressStageKey(event, {
      shift: (right, down) => this.shiftSource(right * KEY_PIXELS * fine, down * KEY_PIXELS * fine),
      turn: (direction) => this.turnSource(direction * KEY_TURN * fine),
      zoom: (direction) => this.surface.zoomBy(ZOOM_STEP ** direction),
      fit: () => this.fit(),
      pan: (right, down) => this.panBy(-right * PAN_STEP, -down * PAN_STEP),
      tell: (what) => this.tell('stage-key', what),
    });
  }
}
