/** What belongs to the surface on the page: the button that makes it, and, below the map, what of it is shown. */
import { css, html, nothing, svg, type TemplateResult } from 'lit';
import { HOLE_VOXELS, MEMORY_MB, VOXEL_SIZE } from '../../../package/mesh/frames.js';
import { check } from '../components/fields.js';
import { list } from '../components/list-field.js';
import { mapButton } from '../drawing/map-toolbar.js';
import type { SurfaceMesh } from '../engine/surface-protocol.js';
import { formatCount, formatFixed, plural } from '../views/format.js';
import { memoizeLast } from '../views/memoize-last.js';
import { cssColor, type Rgb } from '../views/palette.js';
import { row, wrap } from '../components/theme.js';

/** Of a run: the surface, where it is there, and of how many of its frames it is or can be made. */
export interface SurfaceState {
  mesh: SurfaceMesh | null;
  /** 0: the run has none. */
  numPlaced: number;
  num_frames: number;
  isMaking: boolean;
  /** Side of the voxels that were asked for (m). */
  voxelSize: number;
  /** Triangles at most; 0: all. */
  maxTriangles: number;
  /** Holes are filled up to so many voxels; 0: none. */
  holeVoxels: number;
}

/** What is made of the same field in another way. */
export type SurfaceChange = Partial<Pick<SurfaceState, 'maxTriangles' | 'holeVoxels'>>;

export const NO_SURFACE: SurfaceState = {
  mesh: null,
  numPlaced: 0,
  num_frames: 0,
  isMaking: false,
  voxelSize: VOXEL_SIZE,
  maxTriangles: 0,
  holeVoxels: 0,
};

/** What is drawn of a map that has a surface. */
export interface SurfaceChoices {
  shown: 'points' | 'surface' | 'both';
  /** Coloured by the standard deviation of its vertices. */
  byDeviation: boolean;
}

export const FIRST_SURFACE_CHOICES: SurfaceChoices = { shown: 'surface', byDeviation: false };

const SHOWN: readonly { shown: SurfaceChoices['shown']; label: string }[] = [
  { shown: 'points', label: 'Points' },
  { shown: 'surface', label: 'Surface' },
  { shown: 'both', label: 'Both' },
];

/** Sides of voxels to choose from (m). */
const VOXEL_SIZES = [0.005, 0.01, VOXEL_SIZE, 0.05, 0.1, 0.2, 0.5].map((side) => [side, `${100 * side} cm`] as const);
/** Numbers of triangles to choose from. */
const TRIANGLES = [
  [0, 'all'],
  [500_000, '500 000'],
  [100_000, '100 000'],
  [20_000, '20 000'],
] as const;

/** Sizes of holes to choose from, in voxels; 0: they stay. */
const HOLES = [0, HOLE_VOXELS, 25, 50] as const;

/** Of what fills holes, where the colours tell the deviation. */
export const FILLED_COLOR: Rgb = [214, 40, 160];

const FACETS = svg`<path d="M8 1.8 14 5.4v5.2L8 14.2 2 10.6V5.4zM2 5.4 8 9l6-3.6M8 9v5.2" />`;

/** Most vertices that are looked at for the range of the colours. */
const NUM_SAMPLED = 20_000;

/** Standard deviation (m) that nineteen of twenty vertices stay below: the end of the colours. */
export const deviationTop = memoizeLast(({ deviations, filled }: SurfaceMesh): number => {
  const stride = Math.ceil(deviations.length / NUM_SAMPLED);
  const sampled = deviations.filter((_, i) => i % stride === 0 && !filled[i]).sort();
  return Math.max(sampled[Math.floor(0.95 * (sampled.length - 1))] ?? 0, 1e-4);
});

/** Makes the surface; once it is there, shows it or the points. Nothing where the run can have none. */
export function surfaceButton(
  { mesh, numPlaced, isMaking }: SurfaceState,
  { shown }: SurfaceChoices,
  press: () => void,
): TemplateResult | typeof nothing {
  if (numPlaced === 0 && !mesh) return nothing;
  const hint = mesh ? 'Surface or points (M)' : `Make a surface of triangles of ${plural(numPlaced, 'frame')} (M)`;
  return mapButton(FACETS, 'Surface', hint, press, { pressed: isMaking || (mesh !== null && shown !== 'points') });
}

/** Below the map, while there is a surface. */
export function surfaceBar(
  state: SurfaceState,
  choices: SurfaceChoices,
  ramp: readonly Rgb[],
  choose: (choices: SurfaceChoices) => void,
  makeOf: (voxelSize: number) => void,
  change: (change: SurfaceChange) => void,
): TemplateResult | typeof nothing {
  const { mesh } = state;
  if (!mesh) return nothing;
  return html`<div class="surface-bar">
    <fieldset>
      <legend class="visually-hidden">What is shown</legend>
      ${SHOWN.map(
        ({ shown, label }) =>
          html`<label
            ><input
              type="radio"
              name="shown"
              .checked=${choices.shown === shown}
              @change=${() => choose({ ...choices, shown })}
            />${label}</label
          >`,
      )}
    </fieldset>
    ${check('Standard deviation', choices.byDeviation, (byDeviation) => choose({ ...choices, byDeviation }))}
    ${choices.byDeviation ? deviationLegend(deviationTop(mesh), ramp, mesh.num_filled > 0) : nothing}
    <label>Voxels ${list(VOXEL_SIZES, state.voxelSize, makeOf)}</label>
    <label>Triangles ${list(TRIANGLES, state.maxTriangles, (maxTriangles) => change({ maxTriangles }))}</label>
    ${
      mesh.is_of_clouds
        ? nothing
        : html`<label
            >Holes
            ${list(holeChoices(state.voxelSize), state.holeVoxels, (holeVoxels) => change({ holeVoxels }))}</label
          >`
    }
    <span class="muted">${surfaceWords(state)}</span>
  </div>`;
}

const holeChoices = (voxelSize: number): [number, string][] =>
  HOLES.map((voxels) => [
    voxels,
    voxels === 0 ? 'open' : `filled up to ${Number((100 * voxels * voxelSize).toPrecision(2))} cm`,
  ]);

function deviationLegend(top: number, ramp: readonly Rgb[], hasFilled: boolean): TemplateResult {
  const stops = ramp.filter((_, i) => i % 7 === 0).map((color) => cssColor(color));
  return html`<span class="legend number"
    ><span>0</span><i style="background: linear-gradient(to right, ${stops.join(', ')})"></i
    ><span>${formatFixed(1000 * top, 1)} mm or more</span>${
      hasFilled
        ? html`<i class="filled" style="background: ${cssColor(FILLED_COLOR)}"></i><span>filled, not measured</span>`
        : nothing
    }</span
  >`;
}

/** How large it is, and what it is made of; empty without a surface. */
export function surfaceWords({ mesh, numPlaced, num_frames, voxelSize }: SurfaceState): string {
  if (!mesh) return '';
  const size = plural(mesh.triangles.length / 3, 'triangle');
  const of =
    num_frames === mesh.num_frames
      ? plural(num_frames, 'frame')
      : `${formatCount(mesh.num_frames)} of ${plural(num_frames, 'frame')}`;
  // While the run goes on, images near others wait for its end.
  const rest = mesh.num_frames < numPlaced ? ' so far' : ', those with a good pose';
  const leftOut = num_frames === mesh.num_frames ? '' : rest;
  const voxels = `voxels of ${Number((100 * mesh.voxel_size).toPrecision(2))} cm`;
  const isLarger = mesh.voxel_size > 1.2 * voxelSize;
  const limit = mesh.is_of_clouds
    ? 'as the points lie too far apart for smaller ones'
    : `as smaller ones do not fit into ${MEMORY_MB} MB`;
  const larger = isLarger ? `, ${limit}` : '';
  const moved = mesh.moved > 0 ? `; moved by up to ${formatFixed(1000 * mesh.moved, 1)} mm to have fewer` : '';
  const filled = mesh.num_filled > 0 ? `; ${formatCount(mesh.num_filled)} of them fill holes` : '';
  return `${size} of ${of}${leftOut}; ${voxels}${larger}${moved}${filled}`;
}

export const surfaceStyles = css`
  .bars {
    grid-area: legend;
  }
  .surface-bar {
    ${wrap};
    gap: 4px 16px;
    padding: 4px 12px;
    border-top: 1px solid var(--line);
    background: var(--surface);
    font-size: calc(13 * var(--px));
  }
  .surface-bar fieldset {
    display: flex;
    gap: 12px;
    margin: 0;
    padding: 0;
    border: 0;
  }
  .surface-bar label {
    ${row};
    gap: 6px;
    min-height: 28px;
    cursor: pointer;
  }
  @media (pointer: coarse) {
    .surface-bar label {
      min-height: 36px;
    }
  }
`;
