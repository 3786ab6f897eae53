/**
 * Colours of the frames. Lightness rises evenly with the frame number while the hue runs from violet over blue, teal
 * and green to ochre, so the order can be read without telling hues apart, and on either background every colour keeps
 * a contrast of about 3 : 1 or more. Built in OKLCH: https://bottosson.github.io/posts/oklab/
 */

export type Rgb = readonly [red: number, green: number, blue: number];

interface Ramp {
  lightness: readonly [first: number, last: number];
  chroma: number;
}

const FIRST_HUE = 300;
const LAST_HUE = 88;
const ON_LIGHT: Ramp = { lightness: [0.36, 0.66], chroma: 0.17 };
const ON_DARK: Ramp = { lightness: [0.57, 0.9], chroma: 0.16 };

/** The colour at `t` of the way from the first frame (0) to the last (1). */
export function frameColor(t: number, dark: boolean): Rgb {
  const { lightness, chroma } = dark ? ON_DARK : ON_LIGHT;
  const hue = FIRST_HUE + (LAST_HUE - FIRST_HUE) * t;
  return oklchToRgb(lightness[0] + (lightness[1] - lightness[0]) * t, chroma, hue);
}

/** One colour for each of `count` frames. */
export function framePalette(count: number, dark: boolean): Rgb[] {
  return Array.from({ length: count }, (_, frame) => frameColor(count > 1 ? frame / (count - 1) : 0.3, dark));
}

/** A colour of this hue (degrees) that stands out from the background. */
export function hueColor(hue: number, dark: boolean): Rgb {
  return dark ? oklchToRgb(0.76, 0.14, hue) : oklchToRgb(0.52, 0.16, hue);
}

/** What is of no colour. */
export function grey(dark: boolean): Rgb {
  return dark ? oklchToRgb(0.62, 0, 0) : oklchToRgb(0.6, 0, 0);
}

export function cssColor([red, green, blue]: Rgb, alpha = 1): string {
  return `rgb(${red} ${green} ${blue} / ${alpha})`;
}

/** A pixel of ImageData seen as a 32-bit number; every platform with WebAssembly is little-endian here. */
export function packColor([red, green, blue]: Rgb, alpha = 255): number {
  return ((alpha << 24) | (blue << 16) | (green << 8) | red) >>> 0;
}

/** The nearest colour a screen can show: chroma gives way, hue and lightness stay. */
function oklchToRgb(lightness: number, chroma: number, hue: number): Rgb {
  for (let c = chroma; ; c -= 0.005) {
    const linear = oklchToLinearRgb(lightness, Math.max(c, 0), hue);
    if (c <= 0 || linear.every((v) => v >= -1e-4 && v <= 1 + 1e-4)) {
      const [r, g, b] = linear.map((v) => Math.round(255 * encodeGamma(Math.min(Math.max(v, 0), 1))));
      return [r ?? 0, g ?? 0, b ?? 0];
    }
  }
}

function oklchToLinearRgb(lightness: number, chroma: number, hue: number): [number, number, number] {
  const a = chroma * Math.cos((hue * Math.PI) / 180);
  const b = chroma * Math.sin((hue * Math.PI) / 180);
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  return [
    4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
    -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
    -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s,
  ];
}

function encodeGamma(v: number): number {
  return v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055;
}
