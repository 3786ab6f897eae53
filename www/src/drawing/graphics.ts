/** Keeps a scene in space and its graphics context alive: where the card drops it, a fresh canvas gets a fresh one. */
import type { ReactiveController, ReactiveControllerHost } from 'lit';

export type GraphicsState = 'starting' | 'there' | 'lost' | 'unavailable';

/** What is drawn with a graphics context of its own. */
interface GraphicsScene {
  dispose(): void;
}

export interface GraphicsUser<S extends GraphicsScene> {
  readonly canvas: HTMLCanvasElement;
  /** The scene's class, loaded when it is first needed; it throws where the browser gives no graphics context. */
  loadScene(): Promise<new (canvas: HTMLCanvasElement) => S>;
  /** A new scene wants its size and all there is to draw. */
  onScene(scene: S): void;
  onGraphics?(change: 'lost' | 'restored' | 'unavailable'): void;
}

/** A lost context is replaced after so long; again and again, ever later, where that fails. */
const RESTORE_MS = [250, 1000, 2000, 4000];

export class Graphics<S extends GraphicsScene> implements ReactiveController {
  /** Null while there is none. */
  scene: S | null = null;
  state: GraphicsState = 'starting';
  /** The canvas belongs to its context: the host makes another one for every number. */
  canvasNumber = 1;
  #started = 0;
  #numFailures = 0;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #host: ReactiveControllerHost;
  #user: GraphicsUser<S>;

  constructor(host: ReactiveControllerHost, user: GraphicsUser<S>) {
    this.#host = host;
    this.#user = user;
    host.addController(this);
  }

  hostConnected(): void {
    if (this.#started > 0 && !this.scene) this.restart();
  }

  hostDisconnected(): void {
    clearTimeout(this.#timer);
    this.scene?.dispose();
    this.scene = null;
  }

  hostUpdated(): void {
    if (this.#started === this.canvasNumber) return;
    this.#started = this.canvasNumber;
    void this.#start();
  }

  /** A fresh canvas with a fresh context. */
  restart(): void {
    this.canvasNumber++;
    this.#host.requestUpdate();
  }

  async #start(): Promise<void> {
    const canvas = this.#user.canvas;
    let scene: S;
    try {
      const Scene = await this.#user.loadScene();
      if (!canvas.isConnected) return;
      this.scene?.dispose();
      this.scene = null;
      scene = new Scene(canvas);
    } catch {
      this.#onFailed();
      return;
    }
    canvas.addEventListener('webglcontextlost', () => {
      if (this.scene === scene) this.#onLost();
    });
    const wasLost = this.state !== 'starting';
    this.scene = scene;
    this.#numFailures = 0;
    this.#enter('there');
    this.#user.onScene(scene);
    if (wasLost) this.#user.onGraphics?.('restored');
  }

  #onLost(): void {
    this.scene = null;
    this.#enter('lost');
    this.#user.onGraphics?.('lost');
    this.#timer = setTimeout(() => this.restart(), RESTORE_MS[0]);
  }

  #onFailed(): void {
    const wait = RESTORE_MS[++this.#numFailures];
    if (this.state !== 'starting' && wait !== undefined) {
      this.#timer = setTimeout(() => this.restart(), wait);
      return;
    }
    this.#enter('unavailable');
    this.#user.onGraphics?.('unavailable');
  }

  #enter(state: GraphicsState): void {
    this.state = state;
    this.#host.requestUpdate();
  }
}
