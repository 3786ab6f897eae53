/**
 * The map on a canvas. Points are painted into a layer of their own, which is kept while only the marks over it change.
 * While the user moves a map that is slow to paint, the layer is moved instead of painted again; while the slider moves, the points
 * of the frames that come or go are painted or taken off alone.
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
import { Journal } from './journal.js';
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
  /** Whether other frames are shown than in the layer. */
  #isSlid = false;
  /** Of the layer's points since the slider moved; null: there is none. */
  #journal: Journal | null = null;
  /** So many frames of it are those before the slider, without the selected one over them. */
  #numSlid = 0;
  /** Whether it would take too much room. */
  #isDense = false;
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
    this.invalidate();
  }

  /** Points or their colours have changed. */
  invalidate(): void {
    this.#isLayerStale = true;
    this.#isDense = false;
  }

  /** Other frames are shown, or another one is selected. */
  slide(): void {
    this.#isSlid = true;
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
    const isSame = shown !== null && !this.#isLayerStale && this.#stride === 1 && sameView(shown, view);
    const isMovable = shown !== null && !this.#isLayerStale && !this.#isSlid && shown.turns === view.turns;
    const isSlow = isInMotion && this.#layerMs > PAINT_BUDGET_MS;
    const isKept = isMovable && (isSlow || isSame);
    if (!isSame) this.#journal = null;
    const isOver = this.#isSlid && !this.#isLayerStale && this.#slideLayer(content, view);
    if (!isKept && !isOver) this.#paintLayer(content, view, isSlow ? Math.ceil(this.#layerMs / PAINT_BUDGET_MS) : 1);
    this.#isSlid = false;
    const isMoved = !sameView(this.#layerView ?? view, view);
    const isWhole = (!content.marks.undetermined && !content.marks.pairs) || selectedMarks !== undefined;
    if (!isWhole)
      import('./selected-marks.js').then((loaded) => (selectedMarks = loaded)).catch(() => (selectedMarks = null));
    this.#compose(content, view, isMoved);
    return isWhole && this.#stride === 1 && !isMoved;
  }

  /** Gets ready for the slider, where its first picture would be late. */
  prepare(content: MapContent, view: Viewport): void {
    const isLate = this.#layerMs > PAINT_BUDGET_MS && this.#journal === null;
    if (isLate && !this.#isLayerStale && this.#stride === 1) this.#slideLayer(content, view);
  }

  /** Without frames there are no grid and no axes. */
  #clear(dark: boolean): void {
    const ctx = context2d(this.canvas);
    ctx.fillStyle = (dark ? DARK_MAP : LIGHT_MAP).background;
    ctx.fillRect(0, 0, this.canvas.width, this.canvas.height);
    this.#isLayerStale = true;
  }

  /** Paints all points of the layer anew. */
  #paintLayer(content: MapContent, view: Viewport, stride: number): void {
    const start = performance.now();
    const image = this.#begin(content, view, stride);
    this.#paintFrames(content, view, image, [0, numShown(content)], stride);
    context2d(this.#layer).putImageData(image, 0, 0);
    this.#layerView = view;
    [this.#isLayerStale, this.#stride, this.#journal] = [false, stride, null];
    this.#layerMs = stride * (performance.now() - start);
  }

  /** Paints what has come and takes off what has gone since the slider moved; whether there is room to. */
  #slideLayer(content: MapContent, view: Viewport): boolean {
    if (content.only || this.#isDense) return false;
    const isFirst = this.#journal === null;
    const image = isFirst || !this.#layerImage ? this.#begin(content, view, 1) : this.#layerImage;
    const journal = this.#journal ?? new Journal(new Uint32Array(image.data.buffer));
    const until = numShown(content);
    journal.takeOff(Math.min(this.#numSlid, until, journal.num_frames));
    this.#paintFrames(content, view, image, [journal.num_frames, until], 1, journal);
    this.#numSlid = until;
    [this.#journal, this.#isDense] = journal.isFull ? [null, true] : [journal, false];
    context2d(this.#layer).putImageData(image, 0, 0);
    [this.#layerView, this.#stride] = [view, 1];
    return true;
  }

  /** The pixels of the layer, with nothing on them but the map before. */
  #begin({ points, before, dark }: MapContent, view: Viewport, stride: number): ImageData {
    const device = { width: this.#layer.width, height: this.#layer.height };
    this.#layerImage ??= new ImageData(device.width, device.height);
    const pixels = new Uint32Array(this.#layerImage.data.buffer);
    pixels.fill(0);
    if (before) {
      const numBefore = before.points.offsets.length - 1;
      const colors = new Uint32Array(numBefore).fill(packColor((dark ? DARK_MAP : LIGHT_MAP).before));
      const style = { colors, diameter: this.#diameterOf(points), stride };
      paintPoints(pixels, device, view, this.#pixelRatio, before.points, 0, numBefore, style);
    }
    return this.#layerImage;
  }

  #diameterOf({ points }: PointSet): number {
    return pointDiameter(points.length / 2, this.#size) * this.#pixelRatio;
  }

  /** Paints frames `first` to `last` (exclusive), then the selected one over them. `journal`: of the pixels of this image. */
  #paintFrames(
    { points, marks, colors: frameColors, only, dark }: MapContent,
    view: Viewport,
    image: ImageData,
    [first, last]: readonly [number, number],
    stride: number,
    journal: Journal | null = null,
  ): void {
    const pixels = journal?.pixels ?? new Uint32Array(image.data.buffer);
    const [colors, diameter] = [this.#packed(frameColors), this.#diameterOf(points)];
    const paint = (first: number, last: number, diameter: number, stride: number): void =>
      paintPoints(pixels, image, view, this.#pixelRatio, points, first, last, { colors, diameter, stride }, journal);
    if (!only) paint(first, last, diameter, stride);
    for (const frame of only ?? []) if (frame < last) paint(frame, frame + 1, diameter, stride);
    const { selected } = marks;
    if (selected === null || selected >= marks.until) return;
    const own = colors[selected] as number;
    colors[selected] = packColor((dark ? DARK_MAP : LIGHT_MAP).selected);
    paint(selected, selected + 1, Math.max(diameter * 1.25, diameter + this.#pixelRatio), 1);
    colors[selected] = own;
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

const numShown = ({ points, marks }: MapContent): number => Math.min(marks.until, points.offsets.length - 1);

function sameView(a: Viewport, b: Viewport): boolean {
  return a.centerX === b.centerX && a.centerY === b.centerY && a.scale === b.scale && a.turns === b.turns;
}
