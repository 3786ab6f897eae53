/**
 * The points on the graphics card: one buffer for each property, drawn in one call. A map that grows uploads what is
 * new; room is made by doubling, and given back when there are no points any more.
 */
import { BufferAttribute, BufferGeometry, DynamicDrawUsage, Points, type ShaderMaterial, Vector3 } from 'three';
import type { Rgb } from '../views/palette.js';
import type { MapPoints } from '../engine/spatial-protocol.js';
import { type Shade, Shading } from './shading.js';

export type ColorMode = 'image' | 'height' | 'frame' | 'normal';
const MODE_NUMBER: Record<ColorMode, number> = { image: 0, height: 1, frame: 2, normal: 3 };

const VERTEX = /* glsl */ `
  attribute vec3 color;
  attribute vec3 surface_normal;
  attribute float frame;
  uniform vec3 u_up;
  uniform float u_section, u_until, u_selected, u_size, u_half_height, u_smallest, u_low, u_high, u_last;
  uniform int u_mode;
  uniform sampler2D u_ramp;
  uniform vec3 u_highlight;
  uniform vec4 u_plane;
  varying vec3 v_color;
  varying float v_size;

  void main() {
    float height = dot(position, u_up);
    if (height > u_section || frame >= u_until || dot(position, u_plane.xyz) > u_plane.w) {
      gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
      gl_PointSize = 0.0;
      return;
    }
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    // A disc of u_size metres, at least large enough to be seen.
    v_size = clamp(u_size * projectionMatrix[1][1] * u_half_height / gl_Position.w, u_smallest, 64.0);
    gl_PointSize = v_size;
    if (u_mode == 0) {
      v_color = color;
    } else if (u_mode == 3) {
      v_color = 0.5 + 0.5 * vec3(surface_normal.x, -surface_normal.y, -surface_normal.z);
    } else {
      float t = u_mode == 1 ? (height - u_low) / max(u_high - u_low, 1e-3) : frame / max(u_last, 1.0);
      // A light from above and aside, so that edges show where the colour is even.
      float light = 0.72 + 0.28 * abs(dot(surface_normal, normalize(u_up + vec3(0.5, 0.0, 0.35))));
      v_color = texture2D(u_ramp, vec2(clamp(t, 0.0, 1.0), 0.5)).rgb * light;
      if (u_mode == 2 && abs(frame - u_selected) < 0.5) v_color = u_highlight;
    }
  }
`;

const FRAGMENT = /* glsl */ `
  varying vec3 v_color;
  varying float v_size;

  void main() {
    // Corners matter only where a point is large enough to have them.
    vec2 from_middle = gl_PointCoord - 0.5;
    if (v_size > 3.5 && dot(from_middle, from_middle) > 0.25) discard;
    gl_FragColor = vec4(v_color, 1.0);
  }
`;

export interface PointLook extends Shade {
  mode: ColorMode;
  /** Diameter, m. */
  size: number;
  /** Smallest diameter, pixels of the device. */
  smallest: number;
  /** Frames from this one on are not shown. */
  until: number;
  selected: number;
  num_frames: number;
  highlight: Rgb;
}

export class PointCloud {
  readonly object: Points<BufferGeometry, ShaderMaterial>;
  #capacity = 0;
  #shading = new Shading({
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    uniforms: {
      u_until: { value: 1e9 },
      u_selected: { value: -1 },
      u_size: { value: 0.02 },
      u_half_height: { value: 400 },
      u_smallest: { value: 1 },
      u_last: { value: 1 },
      u_highlight: { value: new Vector3(1, 0, 0.5) },
    },
  });

  constructor() {
    this.object = new Points(new BufferGeometry(), this.#shading.material);
    this.object.frustumCulled = false; // bounds of a million points are not worth what they cost at every growth
  }

  /** Takes the map as it is now. Points that are where they were before are not sent to the card again. */
  set({ positions, colors, normals, frames }: MapPoints): void {
    const count = positions.length / 3;
    const isNew = count > this.#capacity;
    if (isNew) this.#makeRoom(Math.max(count, 2 * this.#capacity, 65_536));
    else if (count === 0 && this.#capacity > 0) this.#makeRoom(0);
    const { geometry } = this.object;
    geometry.setDrawRange(0, count);
    if (count === 0) return;
    const position = attribute(geometry, 'position');
    const first = isNew ? 0 : firstDifference(position.array as Float32Array, positions) / 3;
    if (first >= count) return;
    (position.array as Float32Array).set(positions.subarray(3 * first), 3 * first);
    const color = attribute(geometry, 'color');
    const normal = attribute(geometry, 'surface_normal');
    for (let i = first; i < count; i++) {
      for (let k = 0; k < 3; k++) {
        color.array[4 * i + k] = colors[3 * i + k] ?? 128;
        normal.array[4 * i + k] = (normals[3 * i + k] ?? 0) >> 8; // a byte's worth
      }
    }
    const frame = attribute(geometry, 'frame');
    frame.array.set(frames.subarray(first), first);
    for (const changed of [position, color, normal, frame]) {
      changed.clearUpdateRanges();
      changed.addUpdateRange(first * changed.itemSize, (count - first) * changed.itemSize);
      changed.needsUpdate = true;
    }
  }

  look(look: PointLook, halfHeight: number): void {
    const values = {
      u_mode: MODE_NUMBER[look.mode],
      u_size: look.size,
      u_smallest: look.smallest,
      u_until: look.until,
      u_selected: look.selected,
      u_last: look.num_frames - 1,
      u_half_height: halfHeight,
    };
    this.#shading.set(look, values, { u_highlight: look.highlight });
  }

  dispose(): void {
    this.object.geometry.dispose();
    this.#shading.dispose();
  }

  #makeRoom(capacity: number): void {
    this.#capacity = capacity;
    this.object.geometry.dispose();
    const geometry = new BufferGeometry();
    const add = (name: string, made: BufferAttribute): void => {
      made.setUsage(DynamicDrawUsage);
      geometry.setAttribute(name, made);
    };
    add('position', new BufferAttribute(new Float32Array(3 * capacity), 3));
    // Four bytes each, of which three are used: cards want their data aligned.
    add('color', new BufferAttribute(new Uint8Array(4 * capacity), 4, true));
    add('surface_normal', new BufferAttribute(new Int8Array(4 * capacity), 4, true));
    add('frame', new BufferAttribute(new Float32Array(capacity), 1));
    this.object.geometry = geometry;
  }
}

function attribute(geometry: BufferGeometry, name: string): BufferAttribute {
  return geometry.getAttribute(name) as BufferAttribute;
}

/** Index of the first coordinate that is another one, to whole points. */
function firstDifference(before: Float32Array, now: Float32Array): number {
  let i = 0;
  while (i < now.length && before[i] === now[i]) i++;
  return i - (i % 3);
}
