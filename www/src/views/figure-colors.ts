/** Colours of the figures, on the screen and on paper. */
import { cssColor, frameColor } from './palette.js';
import type { Colors } from './axes.js';

export const RAMP_STEPS = 32;

export function makeColors(dark: boolean): Colors {
  return {
    text: dark ? '#e5eaf1' : '#17202c',
    muted: dark ? '#9dabbc' : '#536070',
    line: dark ? '#27303b' : '#e3e8ee',
    background: dark ? '#151b23' : '#ffffff',
    reference: dark ? '#9dabbc' : '#6b7888',
    selected: dark ? '#ff6fb1' : '#c4126a',
    // Okabe and Ito's hues, which differ in lightness as well, so that colour-blind users can distinguish them.
    estimates: dark
      ? ['#56b4e9', '#e69f00', '#2fc08f', '#f0e442', '#d988b7', '#f0793d', '#8fa8ff', '#c0c8d2']
      : ['#0072b2', '#c77700', '#00845f', '#8a7400', '#a8457e', '#c24a00', '#4a5fd0', '#5b6470'],
    ramp: Array.from({ length: RAMP_STEPS }, (_, i) => cssColor(frameColor(i / (RAMP_STEPS - 1), dark))),
  };
}
