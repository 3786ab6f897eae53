/**
 * The map in space, drawn with three.js: the one module, with those it imports, that the library is loaded for. Plain
 * data in, a picture out; it draws on request and keeps no clock.
 */
import { Group, Matrix4, Scene } from 'three';
import { pngOf } from '../views/canvas.js';
import type { Rgb } from '../views/palette.js';
import type { MapPoints } from '../engine/spatial-protocol.js';
import type { SurfaceMesh } from '../engine/surface-protocol.js';
import { floorLines } from './floor.js';
import { FloorGrid, Lines, PictureFrame } from './marks.js';
import type { Orbit, Size } from '../views/orbit.js';
import { SpaceRenderer } from '../views/space-renderer.js';
import { PointCloud, type PointLook } from './point-cloud.js';
import { type Plane, seesBacks } from './section.js';
import { type SurfaceLook, SurfaceLayer } from './surface-layer.js';
import { type Camera, corners, frustumSegments, type Pose, pathSegments, positionOf } from './poses.js';
import type { Mat3, Vec3 } from '../views/vectors.js';

export interface SceneLook extends Omit<PointLook, 'size' | 'smallest' | 'up' | 'plane'> {
  pointSize: number;
  colors: SceneColors;
  shows: Record<LayerName, boolean>;
  /** Null: the surface is not shown. */
  surface: Pick<SurfaceLook, 'colors' | 'deviation'> | null;
  /** What lies beyond it is cut away. */
  plane?: Plane | null;
  /** The eye stands in the map: what it sees from behind is drawn. */
  isInside?: boolean;
}

export type LayerName = 'points' | 'estimate' | 'reference' | 'cameras' | 'grid';

export interface SceneColors {
  background: Rgb;
  estimate: Rgb;
  reference: Rgb;
  halo: Rgb;
  selected: Rgb;
  before: Rgb;
  grid: Rgb;
  /** Of surfaces seen from behind. */
  back: Rgb;
}

/** Most cameras that are drawn, so that they do not hide the map; of more, evenly spread ones. */
const MAX_CAMERAS = 400;

export class MapScene {
  #renderer: SpaceRenderer;
  #scene = new Scene();
  #world = new Group();
  #points = new PointCloud();
  #surface = new SurfaceLayer();
  #grid = new FloorGrid();
  #reference = new Lines(4.5, 1.5, 10);
  #estimate = new Lines(2.4, 0, 14);
  #before = new Lines(2.4, 1.2, 12);
  #cameras = new Lines(1.1, 0, 20);
  #selected = new Lines(2.4, 1.2, 31);
  #picture = new PictureFrame(30);
  #measured = new Lines(2.4, 1.2, 40);
  #reach = 10;

  /** Throws where the browser gives no graphics context. */
  constructor(canvas: HTMLCanvasElement) {
    this.#renderer = new SpaceRenderer(canvas);
    this.#world.matrixAutoUpdate = false;
    this.#world.add(
      this.#points.object,
      this.#surface.object,
      this.#grid.object,
      this.#reference.group,
      this.#before.group,
      this.#estimate.group,
      this.#cameras.group,
      this.#selected.group,
      this.#picture.mesh,
      this.#measured.group,
    );
    this.#scene.add(this.#world);
  }

  resize(size: Size, pixelRatio: number): void {
    this.#renderer.resize(size, pixelRatio);
  }

  setPoints(points: MapPoints): void {
    this.#points.set(points);
  }

  setSurface(mesh: SurfaceMesh | null): void {
    this.#surface.set(mesh);
  }

  /** `points`: some of the map's, in the picture's world; `azimuth`: how the grid is turned there. */
  setGround(R_view_map: Mat3, points: readonly Vec3[], floor: number, azimuth: number): void {
    const [r, u, b] = R_view_map;
    this.#world.matrix = new Matrix4().set(...r, 0, ...u, 0, ...b, 0, 0, 0, 0, 1);
    this.#world.matrixWorldNeedsUpdate = true;
    this.#grid.set(floorLines(points, azimuth), floor, azimuth, R_view_map);
    this.#reach = points.reduce((reach, point) => Math.max(reach, Math.hypot(...point)), 0) * 2 + 4;
  }

  setPaths(poses: readonly Pose[], reference: readonly (Pose | null)[], camera: Camera | null, depth: number): void {
    this.#estimate.set(pathSegments(poses.map(positionOf)));
    this.#reference.set(pathSegments(reference.map((pose) => pose && positionOf(pose))));
    const stride = Math.ceil(poses.length / MAX_CAMERAS);
    const drawn = camera ? poses.filter((_, i) => i % stride === 0) : [];
    this.#cameras.set(camera ? drawn.flatMap((pose) => frustumSegments(pose, camera, depth)) : []);
  }

  /** The path that this one replaces. */
  setBefore(poses: readonly Pose[]): void {
    this.#before.set(pathSegments(poses.map(positionOf)));
  }

  setSelected(pose: Pose | null, camera: Camera | null, depth: number, image: HTMLImageElement | null): void {
    this.#selected.set(pose && camera ? frustumSegments(pose, camera, depth) : []);
    this.#picture.set(pose && camera ? corners(pose, camera, depth) : [], image);
  }

  /** What has been measured, in the map's world. */
  setMeasured(segments: readonly (readonly [Vec3, Vec3])[]): void {
    this.#measured.set(segments);
  }

  render(orbit: Orbit, look: SceneLook, up: Vec3): void {
    const { colors, shows, plane = null, isInside = false } = look;
    const { size, pixelRatio: ratio } = this.#renderer;
    this.#points.object.visible = shows.points;
    this.#points.look({ ...look, plane, up, size: look.pointSize, smallest: 1.2 * ratio }, (size.height / 2) * ratio);
    this.#surface.object.visible = look.surface !== null;
    const hasBacks = seesBacks(orbit, isInside);
    if (look.surface) this.#surface.look({ ...look, ...look.surface, plane, hasBacks, back: colors.back, up });
    this.#grid.object.visible = shows.grid;
    this.#grid.paint(colors.grid, 0.55);
    this.#reference.group.visible = shows.reference;
    this.#reference.paint([colors.halo, colors.reference], 1, 1);
    this.#estimate.group.visible = shows.estimate;
    this.#estimate.paint([colors.estimate], 1, 1);
    this.#before.group.visible = shows.estimate;
    this.#before.paint([colors.halo, colors.before], 1, 1);
    this.#cameras.group.visible = shows.cameras;
    this.#cameras.paint([colors.estimate], 0.5, 1);
    this.#selected.group.visible = shows.cameras;
    this.#selected.paint([colors.halo, colors.selected], 1, 1);
    this.#picture.mesh.visible = shows.cameras && this.#picture.isThere;
    this.#measured.paint([colors.halo, colors.selected], 1, 1);
    this.#renderer.render(this.#scene, orbit, colors.background, this.#reach);
  }

  /** What `render` would show, as a PNG of `scale` times the size. */
  async toPng(orbit: Orbit, look: SceneLook, up: Vec3, scale: number): Promise<Blob> {
    const { size, pixelRatio: ratio } = this.#renderer;
    this.resize(size, Math.max(scale, ratio));
    try {
      this.render(orbit, look, up);
      return await pngOf(this.#renderer.canvas);
    } finally {
      this.resize(size, ratio);
      this.render(orbit, look, up);
    }
  }

  dispose(): void {
    for (const part of [
      this.#points,
      this.#surface,
      this.#grid,
      this.#reference,
      this.#before,
      this.#estimate,
      this.#cameras,
      this.#selected,
      this.#picture,
      this.#measured,
    ]) {
      part.dispose();
    }
    this.#renderer.dispose();
  }
}
