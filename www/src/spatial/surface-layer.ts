/** The surface on the graphics card: lit from the eye and from above, so that shape shows without lights to place. */
import { BufferAttribute, BufferGeometry, DoubleSide, Mesh, type ShaderMaterial, Vector3 } from 'three';
import type { SurfaceMesh } from '../engine/surface-protocol.js';
import type { Rgb } from '../views/palette.js';
import { FILLED_COLOR } from './surface-bar.js';
import { type Shade, Shading } from './shading.js';

/** What the colours are: of the pictures, none, or each vertex' standard deviation, height or direction. */
export type SurfaceColors = 'image' | 'plain' | 'deviation' | 'height' | 'normal';
const MODE_NUMBER: Record<SurfaceColors, number> = { image: 0, plain: 1, deviation: 2, height: 3, normal: 4 };

const VERTEX = /* glsl */ `
  attribute vec3 color;
  attribute float deviation;
  attribute float filled;
  uniform vec3 u_filled;
  uniform vec3 u_up;
  uniform float u_low, u_high, u_deviation;
  uniform int u_mode;
  uniform sampler2D u_ramp;
  varying vec3 v_color, v_normal, v_position;
  varying float v_height, v_upward, v_beyond;
  uniform vec4 u_plane;

  void main() {
    vec4 seen = modelViewMatrix * vec4(position, 1.0);
    gl_Position = projectionMatrix * seen;
    v_position = seen.xyz;
    v_normal = normalMatrix * normal;
    v_height = dot(position, u_up);
    v_beyond = dot(position, u_plane.xyz) - u_plane.w;
    v_upward = dot(normal, u_up);
    if (u_mode == 0) v_color = color;
    else if (u_mode == 1) v_color = vec3(0.78);
    else if (u_mode == 4) v_color = 0.5 + 0.5 * vec3(normal.x, -normal.y, -normal.z);
    else {
      float t = u_mode == 2 ? deviation / u_deviation : (v_height - u_low) / max(u_high - u_low, 1e-3);
      v_color = texture2D(u_ramp, vec2(clamp(t, 0.0, 1.0), 0.5)).rgb;
      if (u_mode == 2 && filled > 0.5) v_color = u_filled;
    }
  }
`;

const FRAGMENT = /* glsl */ `
  uniform float u_section;
  uniform int u_mode;
  uniform bool u_has_backs;
  uniform vec3 u_back;
  varying vec3 v_color, v_normal, v_position;
  varying float v_height, v_upward, v_beyond;

  void main() {
    if (v_height > u_section || v_beyond > 0.0) discard;
    if (!gl_FrontFacing) {
      // A ceiling is looked through from above.
      if (!u_has_backs || v_upward < -0.7) discard;
      gl_FragColor = vec4(u_back, 1.0);
      return;
    }
    vec3 eye = isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(-v_position);
    float light = 0.6 * abs(dot(normalize(v_normal), eye)) + 0.4 * (0.5 + 0.5 * v_upward);
    // Pictures are lit already, and colours that stand for a value are to be found in the legend.
    float dark = u_mode == 1 ? 0.35 : 0.7;
    gl_FragColor = vec4(v_color * mix(dark, 1.05, light), 1.0);
  }
`;

export interface SurfaceLook extends Shade {
  colors: SurfaceColors;
  /** Standard deviation that has the last colour, m. */
  deviation: number;
  /** Whether what is seen from behind is drawn; otherwise a room is looked into through its walls. */
  hasBacks: boolean;
  back: Rgb;
}

export class SurfaceLayer {
  readonly object: Mesh<BufferGeometry, ShaderMaterial>;
  #shading = new Shading({
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    side: DoubleSide,
    // Points that lie on the surface are in front of it.
    polygonOffset: true,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
    uniforms: {
      u_has_backs: { value: false },
      u_back: { value: new Vector3() },
      u_filled: { value: new Vector3(...FILLED_COLOR.map((value) => value / 255)) },
      u_deviation: { value: 1 },
    },
  });

  constructor() {
    this.object = new Mesh(new BufferGeometry(), this.#shading.material);
    this.object.visible = false;
    this.object.frustumCulled = false;
  }

  /** Null: there is none. */
  set(mesh: SurfaceMesh | null): void {
    this.object.geometry.dispose();
    const geometry = new BufferGeometry();
    if (mesh) {
      const { positions, normals, colors, deviations, filled, triangles } = mesh;
      geometry.setAttribute('position', new BufferAttribute(positions, 3));
      geometry.setAttribute('normal', new BufferAttribute(normals, 3));
      if (colors.length > 0) geometry.setAttribute('color', new BufferAttribute(colors, 3, true));
      geometry.setAttribute('deviation', new BufferAttribute(deviations, 1));
      if (filled.length > 0) geometry.setAttribute('filled', new BufferAttribute(filled, 1));
      geometry.setIndex(new BufferAttribute(triangles, 1));
    }
    this.object.geometry = geometry;
  }

  look(look: SurfaceLook): void {
    const { colors, deviation, hasBacks, back } = look;
    const values = { u_mode: MODE_NUMBER[colors], u_deviation: deviation, u_has_backs: hasBacks };
    this.#shading.set(look, values, { u_back: back });
  }

  dispose(): void {
    this.object.geometry.dispose();
    this.#shading.dispose();
  }
}
