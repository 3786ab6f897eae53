/** How the map in space is painted, in the page's two themes. */
import { frameColor, type Rgb } from '../views/palette.js';
import { remember } from '../views/remember.js';
import type { ColorMode } from './point-cloud.js';
import type { SceneColors } from './scene.js';

const ON_LIGHT: SceneColors = {
  background: [252, 253, 254],
  estimate: [214, 32, 28],
  reference: [10, 12, 16],
  halo: [255, 255, 255],
  selected: [196, 18, 106],
  grid: [205, 213, 223],
};
const ON_DARK: SceneColors = {
  background: [11, 15, 20],
  estimate: [255, 72, 62],
  reference: [6, 8, 11],
  halo: [214, 224, 236],
  selected: [255, 111, 177],
  grid: [42, 52, 64],
};

export const sceneColors = (dark: boolean): SceneColors => (dark ? ON_DARK : ON_LIGHT);

/** From low to high, from the first to the last: the colours of the timeline. */
export const ramp = remember((dark: boolean): Rgb[] => Array.from({ length: 64 }, (_, i) => frameColor(i / 63, dark)));

export const COLOR_MODES: readonly { mode: ColorMode; label: string }[] = [
  { mode: 'image', label: 'Image' },
  { mode: 'height', label: 'Height' },
  { mode: 'frame', label: 'Frame' },
  { mode: 'normal', label: 'Surface direction' },
];
