/** What is laid over the flat map by a part of the page that is loaded later. */
import type { Context } from './map-painter.js';
import type { Size, Viewport } from './viewport.js';

export interface MapLayer {
  paint(ctx: Context, size: Size, view: Viewport, dark: boolean): void;
  /** Whether it takes the tap. */
  tap(x: number, y: number, reach: number, size: Size, view: Viewport): boolean;
  /** Whether it takes the drag (m); the map is moved otherwise. */
  drag?(x: number, y: number): boolean;
  /** The drag has ended. */
  release?(): void;
  /** What keys mean while it is there. */
  keys?: Record<string, () => void>;
}
