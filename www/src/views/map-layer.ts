/** What is laid over the flat map by a part of the page that is loaded later. */
import type { TemplateResult } from 'lit';
import type { Context } from './map-painter.js';
import type { Size, Viewport } from './viewport.js';

export interface MapLayer {
  paint(ctx: Context, size: Size, view: Viewport, dark: boolean): void;
  /** Whether it takes the tap. */
  tap(x: number, y: number, reach: number, size: Size, view: Viewport): boolean;
  /** Whether it takes the drag (m); the map is moved otherwise. */
  drag?(x: number, y: number): boolean;
  /** A finger or button goes down in the world (m), which `reach` (m) means about. */
  press?(x: number, y: number, reach: number): void;
  /** The drag has ended. */
  release?(): void;
  /** What was begun is a zoom. */
  cancel?(): void;
  /** Whether it is laid over the occupancy grid in place of the points. */
  showsGrid?: boolean;
  /** What keys mean while it is there. */
  keys?: Record<string, () => void>;
}

/** What is drawn on the map beside what it is made of, with a box of its own in the list of what is drawn. */
export interface MapExtra {
  label: string;
  /** The class of what stands for it in the list. */
  sign: string;
  /** Whether it lies behind the points. */
  isBehind: boolean;
  paint(ctx: Context, size: Size, view: Viewport, dark: boolean): void;
  /** What it means, below the map. */
  legend?: TemplateResult;
}
