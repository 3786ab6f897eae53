/**
 * The map on a canvas. Points are painted into a layer of their own, which is kept while only the marks over it change.
 * While the user moves a map that is slow to paint, the layer is moved instead of painted again; while the slider moves, fewer of
 * its points are painted.
 */
import { context2d } from './canvas.js';
import {
  type BeforeMap,
  DARK_MAP,
  type Layers,
  LIGHT_MAP,
  type MapMarks,
  paintAxes,
  paintBefore,
  paintGrid,
  paintReference,
  paintScaleBar,
} from './map-painter.js';
import type { MapExtra } from './map-layer.js';
import { paintTrajectory } from './path-painter.js';
import { memoizeLast } from './memoize-last.js';
import { type OccupancyPicture, paintOccupancy } from './occupancy.js';
import { packColor, type Rgb } from './palette.js';
import { paintPoints, pointDiameter, type PointSet } from './point-layer.js';
import { type Size, toScreenX, toScreenY, type Viewport } from './viewport.js';

export interface MapContent {
  points: PointSet;
  marks: MapMarks;
  /** One for each frame, or more. */
  colors: readonly Rgb[];
  layers: Layers;
  /** The map that this one replaces; null: none is shown. */
  before: BeforeMap | null;
  /** The frames that alone are shown, in ascending order; null: all. */
  only: readonly number[] | null;
  occupancy: OccupancyPicture | null;
  extras: readonly MapExtra[];
  dark: boolean;
}

/** All points are painted afresh for every picture while that takes at most this long. */
const PAINT_BUDGET_MS = 7;

/** Once a scan has had marks of its own; null: they could not be loaded. */
let selectedMarks: typeof import('./selected-marks.js') | null | undefined;

export class MapCanvas {
  readonly canvas: HTMLCanvasElement;
  #size: Size = { width: 0, height: 0 };
  #pixelRatio = 1;
  #layer = document.createElement('canvas');
  /** The path, for the same view, once the layer is moved. */
  #path = document.createElement('canvas');
  #isPathStale = true;
  #layerImage: ImageData | null = null;
  #layerView: Viewport | null = null;
  #isLayerStale = true;
  /** Of so many points of the layer one is painted, ... */
  #stride = 1;
  /** ... and so long all would take. */
  #layerMs = 0;
  #packed = memoizeLast((colors: readonly Rgb[]) => Uint32Array.from(colors, (color) => packColor(color)));

  constructor(canvas: HTMLCanvasElement = document.createElement('canvas')) {
    this.canvas = canvas;
  }

  /** The canvas gets this size, in CSS pixels, and is empty. */
  resize(size: Size, pixelRatio: number): void {
    this.#size = size;
    this.#pixelRatio = pixelRatio;
    for (const canvas of [this.canvas, this.#layer, this.#path]) {
      canvas.width = Math.max(Math.round(size.width * pixelRatio), 1);
      canvas.height = Math.max(Math.round(size.height * pixelRatio), 1);
    }
    this.#layerImage = null;
    this.#isLayerStale = true;
  }

  /** Points, their colours, or which of them are shown have changed. */
  invalidate(): void {
    this.#isLayerStale = true;
  }

  /**
   * Paints the map. `isInMotion`: another picture follows at once; if the points are slow to paint, their last picture is
   * moved instead, or some are left out. Returns whether all was painted for this view.
   */
  paint(content: MapContent, view: Viewport, isInMotion: boolean): boolean {
    if (content.points.offsets.length <= 1) {
      this.#clear(content.dark);
      return true;
    }
    const shown = this.#layerView;
    const isMovable = shown !== null && !this.#isLayerStale && shown.turns === view.turns;
    const isSlow = isInMotion && this.#layerMs > PAINT_BUDGET_MS;
    const isKept = isMovable && (isSlow || (this.#stride === 1 && sameView(shown, view)));
    if (!isKept) this.#paintLayer(content, view, isSlow ? Math.ceil(this.#layerMs / PAINT_BUDGET_MS) : 1);
    const isMoved = !sameView(this.#layerView ?? view, view);
    const isWhole = (!content.marks.undetermined && !content.marks.pairs) || selectedMarks !== undefined;
    if (!isWhole)
      import('./selected-marks.js').then((loaded) => (selectedMarks = loaded)).catch(() => (selectedMarks = null));
    this.#compose(content, view, isMoved);
    return isWhole && this.#stride === 1 && !isMoved;
  }

  /** Without frames there are no grid and no axes. */
  #clear(dark: boolean): void {
    const ctx = context2d(this.canvas);
    ctx.fillStyle = (dark ? DARK_MAP : LIGHT_MAP).background;
    ctx.fillRect(0, 0, this.canvas.width, this.canvas.height);
    this.#isLayerStale = true;
  }

  #paintLayer(
    { points, marks, colors: frameColors, before, only, dark }: MapContent,
    view: Viewport,
    stride: number,
  ): void {
    const start = performance.now();
    const { width, height } = this.#layer;
    this.#layerImage ??= new ImageData(width, height);
    const pixels = new Uint32Array(this.#layerImage.data.buffer);
    pixels.fill(0);
    const diameter = pointDiameter(points.points.length / 2, this.#size) * this.#pixelRatio;
    const colors = this.#packed(frameColors);
    const device = { width, height };
    if (before) {
      const numBefore = before.points.offsets.length - 1;
      const grey = new Uint32Array(numBefore).fill(packColor((dark ? DARK_MAP : LIGHT_MAP).before));
      const style = { colors: grey, diameter, stride };
      paintPoints(pixels, device, view, this.#pixelRatio, before.points, 0, numBefore, style);
    }
    const paint = (first: number, last: number, diameter: number, stride: number): void =>
      paintPoints(pixels, device, view, this.#pixelRatio, points, first, last, { colors, diameter, stride });
    const until = Math.min(marks.until, points.offsets.length - 1);
    if (!only) paint(0, until, diameter, stride);
    for (const frame of only ?? []) if (frame < until) paint(frame, frame + 1, diameter, stride);
    const { selected } = marks;
    if (selected !== null && selected < marks.until) {
      const own = colors[selected] as number;
      colors[selected] = packColor((dark ? DARK_MAP : LIGHT_MAP).selected);
      paint(selected, selected + 1, Math.max(diameter * 1.25, diameter + this.#pixelRatio), 1);
      colors[selected] = own;
    }
    context2d(this.#layer).putImageData(this.#layerImage, 0, 0);
    this.#layerView = view;
    this.#isLayerStale = false;
    this.#stride = stride;
    this.#layerMs = stride * (performance.now() - start);
  }

  #compose(
    { marks, colors, layers, before, only, occupancy, extras, dark }: MapContent,
    view: Viewport,
    isMoved: boolean,
  ): void {
    const size = this.#size;
    const theme = dark ? DARK_MAP : LIGHT_MAP;
    const ctx = context2d(this.canvas);
    ctx.setTransform(this.#pixelRatio, 0, 0, this.#pixelRatio, 0, 0);
    ctx.fillStyle = theme.background;
    ctx.fillRect(0, 0, size.width, size.height);
    if (layers.grid) paintGrid(ctx, size, view, theme);

    // Points and path may show a moment ago: they are moved and scaled to where they belong now.
    const shown = this.#layerView ?? view;
    const factor = view.scale / shown.scale;
    const left = toScreenX(view, size, shown.centerX, shown.centerY) - (size.width / 2) * factor;
    const top = toScreenY(view, size, shown.centerX, shown.centerY) - (size.height / 2) * factor;
    const drawKept = (kept: HTMLCanvasElement): void => {
      ctx.imageSmoothingEnabled = factor !== 1;
      ctx.drawImage(kept, left, top, size.width * factor, size.height * factor);
    };
    const hasGrid = layers.occupancy && occupancy !== null;
    if (hasGrid) paintOccupancy(ctx, size, view, occupancy);
    for (const extra of extras) if (extra.isBehind) extra.paint(ctx, size, view, dark);
    if (!hasGrid) drawKept(this.#layer);
    for (const extra of extras) if (!extra.isBehind) extra.paint(ctx, size, view, dark);

    if (before && layers.path) paintBefore(ctx, size, view, before, theme);
    if (layers.reference && !only) paintReference(ctx, size, view, marks, theme);
    if (marks.pairs) selectedMarks?.paintPairs(ctx, size, view, marks.pairs, theme);
    if (layers.path) {
      if (isMoved && this.#isPathStale) {
        const path = context2d(this.#path);
        path.setTransform(ctx.getTransform());
        path.clearRect(0, 0, size.width, size.height);
        paintTrajectory(path, size, shown, marks, colors, theme, only);
      }
      if (isMoved) drawKept(this.#path);
      else paintTrajectory(ctx, size, view, marks, colors, theme, only);
      this.#isPathStale = !isMoved;
    }
    const selected = marks.selected === null ? undefined : marks.poses[marks.selected];
    if (selected && marks.undetermined)
      selectedMarks?.paintUndetermined(ctx, size, view, selected, marks.undetermined, theme);
    paintScaleBar(ctx, size, view, theme);
    paintAxes(ctx, size, view, theme);
  }
}

function sameView(a: Viewport, b: Viewport): boolean {
  return a.centerX === b.centerX && a.centerY === b.centerY && a.scale === b.scale && a.turns === b.turns;
}
