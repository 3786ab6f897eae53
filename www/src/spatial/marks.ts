/** Lines in space: the two paths, the cameras, the grid on the floor. All in the map's world. */
import {
  BufferAttribute,
  BufferGeometry,
  DoubleSide,
  Group,
  LinearFilter,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  Texture,
} from 'three';
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';
import { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';
import type { Rgb } from '../views/palette.js';
import type { FloorLines } from './floor.js';
import { added, type Mat3, type Vec3 } from '../views/vectors.js';

/** A line of a width in pixels, over everything, optionally with an outline that sets it off from what is behind. */
export class Lines {
  readonly group = new Group();
  #layers: { line: LineSegments2; material: LineMaterial; width: number }[];

  constructor(width: number, outline: number, order: number) {
    const widths = outline > 0 ? [width + 2 * outline, width] : [width];
    this.#layers = widths.map((linewidth, i) => {
      const material = new LineMaterial({ linewidth, depthTest: false, depthWrite: false, transparent: true });
      const line = new LineSegments2(new LineSegmentsGeometry(), material);
      line.renderOrder = order + i;
      line.frustumCulled = false;
      line.visible = false;
      this.group.add(line);
      return { line, material, width: linewidth };
    });
  }

  /** Each two points make a piece. */
  set(segments: readonly (readonly [Vec3, Vec3])[]): void {
    const geometry = new LineSegmentsGeometry();
    if (segments.length > 0) geometry.setPositions(segments.flat(2));
    for (const [i, { line }] of this.#layers.entries()) {
      if (i === 0) line.geometry.dispose();
      line.geometry = geometry;
      line.visible = segments.length > 0;
    }
  }

  /** Colours from the outermost to the innermost; `scale`: pixels of the picture to one of the screen. */
  paint(colors: readonly Rgb[], opacity: number, scale: number): void {
    const last = this.#layers.length - 1;
    for (const [i, { material, width }] of this.#layers.entries()) {
      const [red, green, blue] = colors[colors.length - 1 - (last - i)] ?? [0, 0, 0];
      material.color.setRGB(red / 255, green / 255, blue / 255);
      material.opacity = i === last ? opacity : opacity * 0.9;
      material.linewidth = width * scale;
    }
  }

  dispose(): void {
    this.#layers[0]?.line.geometry.dispose();
    for (const { material } of this.#layers) material.dispose();
  }
}

/** The selected frame's picture, hung where its camera saw it. */
export class PictureFrame {
  readonly mesh: Mesh<BufferGeometry, MeshBasicMaterial>;
  isThere = false;
  #texture: Texture | null = null;

  constructor(order: number) {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(12), 3));
    geometry.setAttribute('uv', new BufferAttribute(new Float32Array([0, 1, 1, 1, 1, 0, 0, 0]), 2));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    this.mesh = new Mesh(geometry, new MeshBasicMaterial({ side: DoubleSide, transparent: true, opacity: 0.92 }));
    this.mesh.renderOrder = order;
    this.mesh.frustumCulled = false;
    this.mesh.visible = false;
  }

  set(rim: readonly Vec3[], image: HTMLImageElement | null): void {
    this.isThere = image !== null && rim.length === 4;
    if (!image || !this.isThere) return;
    const position = this.mesh.geometry.getAttribute('position') as BufferAttribute;
    position.array.set(rim.flat());
    position.needsUpdate = true;
    if (this.#texture?.image === image) return;
    this.#texture?.dispose();
    this.#texture = new Texture(image);
    this.#texture.minFilter = LinearFilter;
    this.#texture.generateMipmaps = false;
    this.#texture.needsUpdate = true;
    this.mesh.material.map = this.#texture;
    this.mesh.material.needsUpdate = true;
  }

  dispose(): void {
    this.#texture?.dispose();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}

/** Squares on the floor. */
export class FloorGrid {
  readonly object = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ transparent: true }));
  #key = '';

  constructor() {
    this.object.frustumCulled = false;
  }

  /** `floor`: its height; `azimuth`: how it is turned in the picture's world; `R_view_map`: the way there. */
  set({ x0, x1, z0, z1, step }: FloorLines, floor: number, azimuth: number, R_view_map: Mat3): void {
    const [cos, sin] = [Math.cos(azimuth), Math.sin(azimuth)];
    const key = [x0, x1, z0, z1, floor.toFixed(2), ...[azimuth, ...R_view_map.flat()].map((v) => v.toFixed(4))].join(
      ' ',
    );
    if (key === this.#key) return;
    this.#key = key;
    const ends: Vec3[] = [];
    for (let x = x0; x <= x1; x += step) ends.push([x, floor, z0], [x, floor, z1]);
    for (let z = z0; z <= z1; z += step) ends.push([x0, floor, z], [x1, floor, z]);
    const [r, u, b] = R_view_map;
    const coordinates = ends.flatMap(([a, y, c]) => {
      const [x, z] = [a * cos + c * sin, c * cos - a * sin];
      return added(added(added([0, 0, 0], r, x), u, y), b, z);
    });
    this.object.geometry.dispose();
    this.object.geometry = new BufferGeometry();
    this.object.geometry.setAttribute('position', new BufferAttribute(new Float32Array(coordinates), 3));
  }

  paint([red, green, blue]: Rgb, opacity: number): void {
    this.object.material.color.setRGB(red / 255, green / 255, blue / 255);
    this.object.material.opacity = opacity;
  }

  dispose(): void {
    this.object.geometry.dispose();
    this.object.material.dispose();
  }
}
