/** What points and the surface have in common on the graphics card: colours along a ramp, and where the map is cut. */
import {
  DataTexture,
  LinearFilter,
  RGBAFormat,
  ShaderMaterial,
  type ShaderMaterialParameters,
  Vector3,
  Vector4,
} from 'three';
import type { Rgb } from '../views/palette.js';
import type { Vec3 } from '../views/vectors.js';
import { type Plane, planeUniform } from './section.js';

export interface Shade {
  /** Highest height shown, m above the first camera. */
  section: number;
  /** What lies beyond this plane is cut away; null: nothing. */
  plane: Plane | null;
  /** Up, in the map's world. */
  up: Vec3;
  /** Heights that have the first and the last colour of the ramp, m. */
  low: number;
  high: number;
  ramp: readonly Rgb[];
}

const RAMP_STEPS = 256;

/** A material whose uniforms are set by what is to be seen. */
export class Shading {
  readonly material: ShaderMaterial;
  #ramp: readonly Rgb[] | null = null;

  constructor({ uniforms, ...parameters }: ShaderMaterialParameters) {
    this.material = new ShaderMaterial({
      ...parameters,
      uniforms: {
        u_up: { value: new Vector3(0, -1, 0) },
        u_section: { value: 1e9 },
        u_plane: { value: new Vector4(0, 0, 0, 1) },
        u_low: { value: 0 },
        u_high: { value: 1 },
        u_mode: { value: 0 },
        u_ramp: { value: rampTexture([[128, 128, 128]]) },
        ...uniforms,
      },
    });
  }

  /** `values` and `colors`: the other uniforms, by name. */
  set(
    { section, plane, up, low, high, ramp }: Shade,
    values: Record<string, number | boolean>,
    colors: Record<string, Rgb>,
  ): void {
    const { uniforms } = this.material;
    const all = { ...values, u_section: section, u_low: low, u_high: high };
    for (const [name, value] of Object.entries(all)) Object.assign(uniforms[name] ?? {}, { value });
    for (const [name, color] of Object.entries(colors)) uniforms[name]?.value.set(...color.map((value) => value / 255));
    uniforms.u_up?.value.set(...up);
    uniforms.u_plane?.value.set(...planeUniform(plane));
    if (ramp === this.#ramp || !uniforms.u_ramp) return;
    this.#ramp = ramp;
    uniforms.u_ramp.value.dispose();
    uniforms.u_ramp.value = rampTexture(ramp);
  }

  dispose(): void {
    this.material.uniforms.u_ramp?.value.dispose();
    this.material.dispose();
  }
}

function rampTexture(colors: readonly Rgb[]): DataTexture {
  const data = new Uint8Array(4 * RAMP_STEPS);
  for (let i = 0; i < RAMP_STEPS; i++) {
    const color = colors[Math.round((i / (RAMP_STEPS - 1)) * (colors.length - 1))] ?? [0, 0, 0];
    data.set([...color, 255], 4 * i);
  }
  const texture = new DataTexture(data, RAMP_STEPS, 1, RGBAFormat);
  texture.minFilter = LinearFilter;
  texture.magFilter = LinearFilter;
  texture.needsUpdate = true;
  return texture;
}
