/** Gestures by mouse, touch and wheel, reported as rotations, translations and zooms. */
import type { ReactiveController, ReactiveControllerHost } from 'lit';

export interface GestureTarget {
  /** The first finger or button went down here; what follows until `release` may mean what lies there. */
  press?(x: number, y: number, reach: number): void;
  /** The last one is up again. */
  release?(): void;
  /** Pixels moved since the last call. */
  shift(right: number, down: number): void;
  /** Where there is a turn, a plain drag means it: shifting takes another button, Shift, or two fingers. */
  turn?(right: number, down: number): void;
  zoom(x: number, y: number, factor: number): void;
  /** Fingers turned about each other, rad. */
  twist?(angle: number): void;
  tap(x: number, y: number, reach: number): void;
  hover(x: number, y: number): void;
  leave(): void;
}

interface Place {
  x: number;
  y: number;
}

/** A hand that moved less than this has tapped, pixels. */
const TAP = { mouse: 4, touch: 10 };

export class Gestures implements ReactiveController {
  #target: GestureTarget;
  #isGuarded: () => boolean;
  #scale: () => number;
  #stage: HTMLElement | null = null;
  #fingers = new Map<number, Place & { shifts: boolean }>();
  #distance = 0;

  /** `isGuarded`: whether wheel and single fingers belong to the page around; `scale`: CSS pixels per pixel of the target. */
  constructor(host: ReactiveControllerHost, target: GestureTarget, isGuarded: () => boolean, scale = (): number => 1) {
    this.#target = target;
    this.#isGuarded = isGuarded;
    this.#scale = scale;
    host.addController(this);
  }

  hostConnected(): void {
    this.#fingers.clear();
  }

  listen(stage: HTMLElement): void {
    this.#stage = stage;
    stage.addEventListener('pointerdown', (event) => this.#down(event));
    stage.addEventListener('pointermove', (event) => this.#move(event));
    stage.addEventListener('pointerup', (event) => this.#up(event));
    stage.addEventListener('pointercancel', (event) => this.#up(event));
    stage.addEventListener('pointerleave', () => this.#target.leave());
    if (this.#target.turn) stage.addEventListener('contextmenu', (event) => event.preventDefault());
    // Lit's own listener would be passive where the browser decides so.
    stage.addEventListener('wheel', (event) => this.#wheel(event), { passive: false });
  }

  #place(event: MouseEvent): Place {
    const box = this.#stage?.getBoundingClientRect();
    const scale = this.#scale();
    return { x: (event.clientX - (box?.left ?? 0)) / scale, y: (event.clientY - (box?.top ?? 0)) / scale };
  }

  #wheel(event: WheelEvent): void {
    if (this.#isGuarded() && !event.ctrlKey) return;
    event.preventDefault();
    const { x, y } = this.#place(event);
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
    // A pinch on a trackpad arrives as a wheel with the control key and small steps.
    const speed = event.ctrlKey ? 0.01 : 0.0016;
    this.#target.zoom(x, y, Math.exp(-event.deltaY * lines * speed));
    this.#target.hover(x, y);
  }

  #down(event: PointerEvent): void {
    if (event.button !== 0 && !this.#target.turn) return;
    if (this.#isGuarded() && event.pointerType === 'touch') return;
    this.#stage?.setPointerCapture(event.pointerId);
    this.#fingers.set(event.pointerId, { ...this.#place(event), shifts: event.button !== 0 || event.shiftKey });
    if (this.#fingers.size > 1) return;
    this.#distance = 0;
    const { x, y } = this.#place(event);
    this.#target.press?.(x, y, event.pointerType === 'touch' ? 24 : 12);
  }

  #move(event: PointerEvent): void {
    const now = this.#place(event);
    const before = this.#fingers.get(event.pointerId);
    if (!before) {
      if (event.pointerType !== 'touch') this.#target.hover(now.x, now.y);
      return;
    }
    this.#fingers.set(event.pointerId, { ...now, shifts: before.shifts });
    this.#distance += Math.hypot(now.x - before.x, now.y - before.y);
    const other = [...this.#fingers].find(([id]) => id !== event.pointerId)?.[1];
    if (!other) {
      if (this.#distance <= TAP.mouse) return;
      const [right, down] = [now.x - before.x, now.y - before.y];
      if (this.#target.turn && !before.shifts) this.#target.turn(right, down);
      else this.#target.shift(right, down);
      return;
    }
    // Each of two fingers moves the view by half of its own movement.
    const [oldX, oldY] = [before.x - other.x, before.y - other.y];
    const [newX, newY] = [now.x - other.x, now.y - other.y];
    this.#target.shift((now.x - before.x) / 2, (now.y - before.y) / 2);
    const factor = Math.hypot(newX, newY) / Math.max(Math.hypot(oldX, oldY), 1);
    this.#target.zoom((now.x + other.x) / 2, (now.y + other.y) / 2, factor);
    const angle = Math.atan2(newY, newX) - Math.atan2(oldY, oldX);
    this.#target.twist?.(Math.atan2(Math.sin(angle), Math.cos(angle)));
  }

  #up(event: PointerEvent): void {
    const wasPressed = this.#fingers.delete(event.pointerId);
    if (wasPressed && this.#fingers.size === 0) this.#target.release?.();
    const isTouch = event.pointerType === 'touch';
    const isTap = event.type === 'pointerup' && this.#distance <= (isTouch ? TAP.touch : TAP.mouse);
    if (!isTap || event.button !== 0 || this.#fingers.size > 0) return;
    if (!wasPressed && !this.#isGuarded()) return;
    const { x, y } = this.#place(event);
    this.#target.tap(x, y, isTouch ? 24 : 12);
  }
}
