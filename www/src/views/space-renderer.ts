/**
 * What every picture in space is drawn with: three.js on a canvas, from where an orbit looks. The library is loaded with the
 * scenes that import this module.
 */
import {
  ColorManagement,
  LinearSRGBColorSpace,
  OrthographicCamera,
  PerspectiveCamera,
  type Scene,
  WebGLRenderer,
} from 'three';
import { axes, eye, type Orbit, type Size, tanHalfView } from './orbit.js';
import type { Rgb } from './palette.js';

// Colours are given as the screen shows them; nothing is lit.
ColorManagement.enabled = false;

/** Of device pixels per CSS pixel: beyond it, more pixels cost more than the eye sees. */
const MAX_PIXEL_RATIO = 2;

export class SpaceRenderer {
  size: Size = { width: 1, height: 1 };
  pixelRatio = 1;
  #renderer: WebGLRenderer;
  #perspective = new PerspectiveCamera();
  #orthographic = new OrthographicCamera();

  /** Throws where the browser gives no graphics context. */
  constructor(canvas: HTMLCanvasElement) {
    this.#renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: 'high-performance' });
    this.#renderer.outputColorSpace = LinearSRGBColorSpace;
  }

  /** With what was rendered last; within the same task. */
  get canvas(): HTMLCanvasElement {
    return this.#renderer.domElement;
  }

  resize(size: Size, pixelRatio: number): void {
    this.size = size;
    this.pixelRatio = Math.min(pixelRatio, MAX_PIXEL_RATIO);
    this.#renderer.setPixelRatio(this.pixelRatio);
    this.#renderer.setSize(size.width, size.height, false);
  }

  /** `reach`: at least twice the largest distance of anything from the origin, m. */
  render(scene: Scene, orbit: Orbit, background: Rgb, reach: number): void {
    this.#renderer.setClearColor((background[0] << 16) | (background[1] << 8) | background[2]);
    this.#renderer.render(scene, this.#place(orbit, reach));
  }

  dispose(): void {
    this.#renderer.dispose();
  }

  #place(orbit: Orbit, reach: number): PerspectiveCamera | OrthographicCamera {
    const aspect = this.size.width / Math.max(this.size.height, 1);
    const isFlat = orbit.projection === 'orthographic';
    const camera = isFlat ? this.#orthographic : this.#perspective;
    if (isFlat) {
      const half = orbit.distance * tanHalfView(orbit);
      Object.assign(this.#orthographic, { top: half, bottom: -half, left: -half * aspect, right: half * aspect });
      // The eye may stand inside the map there: what lies behind it is seen as well.
      camera.near = orbit.distance - 2 * reach;
    } else {
      this.#perspective.aspect = aspect;
      this.#perspective.fov = (2 * Math.atan(tanHalfView(orbit)) * 180) / Math.PI;
      camera.near = Math.max(0.02, Math.min(0.2, orbit.distance / 50));
    }
    camera.far = orbit.distance + 2 * reach;
    camera.up.set(...axes(orbit).up);
    camera.position.set(...eye(orbit));
    camera.lookAt(...orbit.target);
    camera.updateProjectionMatrix();
    return camera;
  }
}
