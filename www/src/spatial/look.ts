/** How the map in space is painted, in the page's two themes. */
import { frameColor, type Rgb } from '../views/palette.js';
import { memoizeLast } from '../views/memoize-last.js';
import type { Heights } from './leveling.js';
import type { ColorMode } from './point-cloud.js';
import { deviationTop, FIRST_SURFACE_CHOICES, type SurfaceChoices } from './surface-bar.js';
import type { SurfaceColors } from './surface-layer.js';
import type { SurfaceMesh } from '../engine/surface-protocol.js';
import type { LayerName, SceneColors, SceneLook } from './scene.js';

const ON_LIGHT: SceneColors = {
  background: [252, 253, 254],
  estimate: [214, 32, 28],
  reference: [10, 12, 16],
  halo: [255, 255, 255],
  selected: [196, 18, 106],
  before: [120, 130, 143],
  grid: [205, 213, 223],
  back: [88, 98, 110],
};
const ON_DARK: SceneColors = {
  background: [11, 15, 20],
  estimate: [255, 72, 62],
  reference: [6, 8, 11],
  halo: [214, 224, 236],
  selected: [255, 111, 177],
  before: [130, 141, 155],
  grid: [42, 52, 64],
  back: [122, 133, 147],
};

const sceneColors = (dark: boolean): SceneColors => (dark ? ON_DARK : ON_LIGHT);

/** From low to high, from the first to the last: the colours of the timeline. */
export const ramp = memoizeLast((dark: boolean): Rgb[] =>
  Array.from({ length: 64 }, (_, i) => frameColor(i / 63, dark)),
);

export const COLOR_MODES: readonly (readonly [ColorMode, string])[] = [
  ['image', 'Image'],
  ['height', 'Height'],
  ['frame', 'Frame'],
  ['normal', 'Surface direction'],
];

/** What the user chooses of how the map is drawn. */
export interface LookChoices {
  /** Null: as the data suggest it, as for `section`. */
  mode: ColorMode | null;
  /** Of a point, in sides of a voxel. */
  sizeFactor: number;
  /** Where the map is cut, m above the first camera. */
  section: number | null;
  surface: SurfaceChoices;
  shows: Record<LayerName, boolean>;
}

export const FIRST_CHOICES: LookChoices = {
  mode: null,
  sizeFactor: 1.6,
  section: null,
  surface: FIRST_SURFACE_CHOICES,
  shows: { points: true, estimate: true, reference: true, cameras: true, grid: true },
};

/** What of a run the look depends on. */
export interface LookFacts {
  hasColors: boolean;
  /** Edge of the map's voxels, m. */
  voxel_size: number;
  heights: Heights;
  num_frames: number;
  /** Frames shown, from the first on. */
  until: number;
  selected: number | null;
  /** Null: there is none. */
  mesh: SurfaceMesh | null;
  dark: boolean;
}

export const chosenMode = ({ mode }: LookChoices, hasColors: boolean): ColorMode =>
  mode ?? (hasColors ? 'image' : 'height');

/** The surface is of all frames: where some are hidden, the points are drawn. */
const isSurfaceShown = ({ surface }: LookChoices, { mesh, until, num_frames }: LookFacts): boolean =>
  mesh !== null && surface.shown !== 'points' && until >= num_frames;

function surfaceColors({ surface, mode }: LookChoices, { colors }: SurfaceMesh): SurfaceColors {
  if (surface.byDeviation) return 'deviation';
  if (mode === 'frame') return 'plain';
  return mode ?? (colors.length > 0 ? 'image' : 'plain');
}

export const chosenSection = ({ section }: LookChoices, heights: Heights): number => section ?? heights.section;

/** How the scene is to be drawn. */
export function sceneLook(choices: LookChoices, facts: LookFacts): SceneLook {
  const { heights, num_frames, until, selected, mesh, dark } = facts;
  const section = chosenSection(choices, heights);
  const colors = sceneColors(dark);
  const hasSurface = isSurfaceShown(choices, facts);
  return {
    mode: chosenMode(choices, facts.hasColors),
    pointSize: choices.sizeFactor * facts.voxel_size,
    section: section >= heights.top ? 1e9 : section,
    until,
    selected: selected ?? -1,
    low: heights.floor,
    high: Math.min(section, heights.top),
    num_frames,
    ramp: ramp(dark),
    highlight: colors.selected,
    colors,
    shows: { ...choices.shows, points: choices.shows.points && !(hasSurface && choices.surface.shown === 'surface') },
    surface: hasSurface && mesh ? { colors: surfaceColors(choices, mesh), deviation: deviationTop(mesh) } : null,
  };
}
