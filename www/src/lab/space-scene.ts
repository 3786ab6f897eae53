/**
 * Two clouds in space and the pairs between them, drawn with three.js: each cloud is one buffer, all pairs are one. The source is
 * moved by a matrix on the card, so that nothing is sent to it while the source moves.
 */
import { BufferAttribute, BufferGeometry, Group, LineSegments, Matrix4, Points, Scene, ShaderMaterial } from 'three';
import type { Orbit, Size } from '../views/orbit.js';
import type { Rgb } from '../views/palette.js';
import { SpaceRenderer } from '../views/space-renderer.js';
import type { Mat3 } from '../views/vectors.js';
import type { Pose } from './protocol.js';

/** Of a vertex that moves with the source, `moves` is 1. */
const VERTEX = /* glsl */ `
  attribute vec3 color;
  attribute float moves;
  uniform mat4 u_pose;
  uniform float u_size;
  varying vec3 v_color;

  void main() {
    vec4 at = moves > 0.5 ? u_pose * vec4(position, 1.0) : vec4(position, 1.0);
    gl_Position = projectionMatrix * modelViewMatrix * at;
    gl_PointSize = u_size;
    v_color = color;
  }
`;
const FRAGMENT = /* glsl */ `
  uniform float u_opacity;
  varying vec3 v_color;

  void main() {
    gl_FragColor = vec4(v_color, u_opacity);
  }
`;

/** Vertices of a buffer: x y z ..., red green blue ... (0..255), and whether each moves with the source. */
export interface Vertices {
  positions: Float32Array;
  colors: Uint8Array;
  moves: Uint8Array;
}

class Batch {
  readonly object: Points | LineSegments;
  readonly material: ShaderMaterial;

  constructor(kind: 'points' | 'lines', pose: Matrix4, opacity: number) {
    this.material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      transparent: opacity < 1,
      uniforms: { u_pose: { value: pose }, u_size: { value: 2 }, u_opacity: { value: opacity } },
    });
    const geometry = new BufferGeometry();
    this.object = kind === 'points' ? new Points(geometry, this.material) : new LineSegments(geometry, this.material);
    this.object.frustumCulled = false; // the bounds do not know of the pose
  }

  set({ positions, colors, moves }: Vertices): void {
    this.object.geometry.dispose();
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(positions, 3));
    geometry.setAttribute('color', new BufferAttribute(colors, 3, true));
    geometry.setAttribute('moves', new BufferAttribute(moves, 1));
    this.object.geometry = geometry;
  }

  dispose(): void {
    this.object.geometry.dispose();
    this.material.dispose();
  }
}

export type Layer = 'target' | 'source' | 'pairs' | 'rejected' | 'marks';

export class SpaceScene {
  readonly #renderer: SpaceRenderer;
  readonly #scene = new Scene();
  readonly #world = new Group();
  readonly #pose = new Matrix4();
  readonly #layers: Record<Layer, Batch>;

  /** Throws where the browser gives no graphics context. */
  constructor(canvas: HTMLCanvasElement) {
    this.#renderer = new SpaceRenderer(canvas);
    this.#layers = {
      target: new Batch('points', this.#pose, 1),
      source: new Batch('points', this.#pose, 1),
      pairs: new Batch('lines', this.#pose, 0.7),
      rejected: new Batch('lines', this.#pose, 0.35),
      marks: new Batch('lines', this.#pose, 1),
    };
    this.#world.matrixAutoUpdate = false;
    this.#world.add(...Object.values(this.#layers).map(({ object }) => object));
    this.#scene.add(this.#world);
  }

  resize(size: Size, pixelRatio: number): void {
    this.#renderer.resize(size, pixelRatio);
    const ratio = this.#renderer.pixelRatio;
    this.#layers.target.material.uniforms.u_size = { value: 1.6 * ratio };
    this.#layers.source.material.uniforms.u_size = { value: 2.2 * ratio };
  }

  set(layer: Layer, vertices: Vertices): void {
    this.#layers[layer].set(vertices);
  }

  /** `reach`: at least twice the largest distance of anything from the origin, m. */
  render(orbit: Orbit, R_view_cloud: Mat3, pose: Pose, background: Rgb, reach: number): void {
    const rows = (T: Pose, i: number): [number, number, number, number] => [
      T[4 * i] ?? 0,
      T[4 * i + 1] ?? 0,
      T[4 * i + 2] ?? 0,
      T[4 * i + 3] ?? 0,
    ];
    this.#pose.set(...rows(pose, 0), ...rows(pose, 1), ...rows(pose, 2), 0, 0, 0, 1);
    const [right, up, back] = R_view_cloud;
    this.#world.matrix.set(...right, 0, ...up, 0, ...back, 0, 0, 0, 0, 1);
    this.#world.matrixWorldNeedsUpdate = true;
    this.#renderer.render(this.#scene, orbit, background, reach);
  }

  /** The canvas with what was rendered last; within the same task. */
  get canvas(): HTMLCanvasElement {
    return this.#renderer.canvas;
  }

  dispose(): void {
    for (const layer of Object.values(this.#layers)) layer.dispose();
    this.#renderer.dispose();
  }
}
