import { css, html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query } from 'lit/decorators.js';
import { facts } from '../run/facts.js';
import { badList, frameStyles, frameBars, frameHeader, numBad } from '../run/frame-parts.js';
import { figureStyles, numberTable } from '../components/number-table.js';
import { row, shared } from '../components/theme.js';
import { doubt, panelStyles, statusStyles } from '../components/panel-theme.js';
import type { SizedMap, SpatialResult } from '../engine/spatial-protocol.js';
import {
  baseName,
  formatCount,
  formatDuration,
  formatFixed,
  formatLength,
  formatPercent,
  plural,
  sentence,
} from '../views/format.js';
import { formatAngle, formatCoordinate } from '../views/pose-format.js';
import type { Rgb } from '../views/palette.js';
import { frameSummary } from '../views/frame-words.js';
import { type DepthPicture, depthLegend } from './depth-picture.js';
import { formatBytes } from './headline.js';
import { heading } from './rows.js';
import { fire } from '../components/fire.js';
import { BOUND_95, positionBound } from '../../../package/report/bounds.js';

/** The images of a frame; null where there is none, or not yet. */
export interface FrameImages {
  color: HTMLImageElement | null;
  depth: DepthPicture | null;
  /** Why there is no depth picture. */
  problem: string;
}

export const NO_IMAGES: FrameImages = { color: null, depth: null, problem: '' };

/**
 * Beside the map: the two images of a frame, what its registration found, and all frames in charts, which select one.
 *
 * Fires `frame-selected` with a frame number or null, `look-inside` with a frame number, and `sizes-wanted`.
 */
@customElement('scanstitch-frame-panel')
export class ScanstitchFramePanel extends LitElement {
  @property({ attribute: false }) result: SpatialResult | null = null;
  @property({ attribute: false }) ms: readonly number[] = [];
  @property({ attribute: false }) colors: readonly Rgb[] = [];
  @property({ attribute: false }) selected: number | null = null;
  /** Of the selected frame, or of the last one. */
  @property({ attribute: false }) images: FrameImages = NO_IMAGES;
  /** The frame the images belong to. */
  @property({ attribute: false }) pictured: number | null = null;
  /** The map in voxels of other sizes; null before it was asked for. */
  @property({ attribute: false }) sizes: readonly SizedMap[] | null = null;
  /** Whether the map can be measured now. */
  @property({ type: Boolean }) measurable = false;
  @query('canvas') private canvas!: HTMLCanvasElement | null;

  protected override updated(changed: PropertyValues<this>): void {
    const picture = this.images.depth;
    if (!changed.has('images') || !picture || !this.canvas) return;
    this.canvas.width = picture.image.width;
    this.canvas.height = picture.image.height;
    this.canvas.getContext('2d')?.putImageData(picture.image, 0, 0);
  }

  protected override render(): TemplateResult {
    const { result, selected } = this;
    if (!result || result.frames.length === 0) {
      return html`<p class="muted">Each frame and its result appear here once frames are registered.</p>`;
    }
    return html`
      ${selected === null ? this.renderAll(result) : this.renderFrame(result, selected)} ${this.renderImages()}
      ${selected === null ? nothing : this.renderFacts(result, selected)} ${this.renderCharts(result)}
      ${this.selected === null ? this.renderSizes() : nothing}
      ${result.notes.map((note) => html`<p class="explanation">${note}</p>`)}
      ${result.comparison?.convention ? html`<p class="explanation">${sentence(result.comparison.convention)}</p>` : nothing}
    `;
  }

  private renderAll({ frames }: SpatialResult): TemplateResult {
    const badCount = numBad(frames);
    const assessment =
      badCount > 0
        ? `${plural(badCount, 'frame')} of ${frames.length} to check:`
        : frames.length === 1
          ? 'A single frame: it is the origin of the map.'
          : `All ${frames.length} frames were registered. Select one in a chart, in the table or on the map to see its images.`;
    return html`
      <header><h2>All frames</h2></header>
      <p>${assessment}</p>
      ${badCount > 0 ? badList(frames, this.colors, this.select) : nothing}
    `;
  }

  private renderFrame({ frames }: SpatialResult, index: number): TemplateResult {
    const frame = frames[index];
    if (!frame) return html``;
    return html`${frameHeader('frame', frames, index, this.colors[index], this.select)}
    ${frame.reason ? html`<p class="reason ${frame.status}">${sentence(frame.reason)}</p>` : nothing}
    ${
      index > 0
        ? html`<p>
            <button
              title="Step through the registration of this frame, in the ICP lab"
              @click=${() => fire(this, 'look-inside', index)}
            >
              Look inside
            </button>
          </p>`
        : nothing
    }`;
  }

  private renderImages(): TemplateResult | typeof nothing {
    const { color, depth, problem } = this.images;
    if (!color && !depth && !problem) return nothing;
    const name = baseName(this.result?.frames[this.pictured ?? -1]?.name ?? '');
    return html`<div class="images">
      ${
        color
          ? html`<figure>
              <img src=${color.src} alt="What the camera saw in frame ${name}" />
              <figcaption>colour of ${name}</figcaption>
            </figure>`
          : nothing
      }
      <figure>
        ${
          depth
            ? html`<canvas
                  role="img"
                  aria-label="Depth image of frame ${name}, from ${formatFixed(depth.near, 1)} to ${formatFixed(depth.far, 1)} metres"
                ></canvas>
                <figcaption class="number">
                  <span>${formatFixed(depth.near, 1)}</span
                  ><i style="background: linear-gradient(to right, ${depthLegend()})"></i
                  ><span>${formatFixed(depth.far, 1)} m</span>
                </figcaption>`
            : html`<p class="muted">${problem === '' ? '' : sentence(problem)}</p>`
        }
      </figure>
    </div>`;
  }

  private renderFacts({ frames, comparison, camera }: SpatialResult, index: number): TemplateResult {
    const frame = frames[index];
    if (!frame) return html``;
    const pose = frame.T_world_sensor;
    const error = comparison?.errors[index] ?? null;
    const turned = comparison?.rotation_errors[index] ?? null;
    const isMatched = frame.history.length > 0 || index > 0;
    const invalid = this.images.depth?.invalid ?? 0;
    return facts([
      ['Position', `x ${formatCoordinate(pose.x)}, y ${formatCoordinate(pose.y)}, z ${formatCoordinate(pose.z)} m`],
      frame.std &&
        index > 0 && [
          'Known to',
          `±${formatLength(positionBound(frame.std))}, ±${formatAngle(BOUND_95 * frame.std.rotation)}`,
          'So far its position, along the least certain direction, and its rotation may be off against the first frame (95 %), if the numbers of the camera are right',
        ],
      camera && ['Heading', `${formatAngle(heading(pose), 1)} to the right of the first frame`],
      error !== null && [
        'Error',
        `${formatLength(error)}${turned === null ? '' : `, ${formatAngle(turned)}`}`,
        'Distance and angle to ground truth',
      ],
      isMatched && [
        'Agreement',
        `${formatPercent(frame.agreement)}; ${formatPercent(frame.overlap)} seen before`,
        'Share of its points that agree with the map before it',
      ],
      isMatched && ['Registration', frameSummary(frame, index)],
      invalid > 0.0005 && ['Pixels without depth', `${formatPercent(invalid)} of the pixels`],
      ['Time', formatDuration(this.ms[index] ?? 0)],
    ]);
  }

  private renderCharts({ frames, comparison }: SpatialResult): TemplateResult | typeof nothing {
    if (frames.length < 2) return nothing;
    const matched = (value: (index: number) => number): (number | null)[] =>
      frames.map((frame, index) => (index > 0 || frame.history.length > 0 ? value(index) : null));
    return html`
      ${
        comparison
          ? this.renderBars(`Distance to ${baseName(comparison.name)}`, comparison.errors, formatLength)
          : nothing
      }
      ${
        frames.some(({ std }) => std)
          ? this.renderBars(
              'Position known to (95 %)',
              frames.map(({ std, status }) => (std && status === 'good' ? positionBound(std) : null)),
              formatLength,
            )
          : nothing
      }
      ${this.renderBars(
        'Matched points (inliers)',
        matched((i) => frames[i]?.num_inliers ?? 0),
        formatCount,
      )}
      ${this.renderBars(
        'Residual (rmse)',
        matched((i) => frames[i]?.inlier_rmse ?? 0),
        formatLength,
      )}
      ${this.renderBars(
        'Time of each frame',
        frames.map((_, i) => this.ms[i] ?? 0),
        formatDuration,
      )}
    `;
  }

  private renderBars(
    title: string,
    values: readonly (number | null)[],
    format: (value: number) => string,
  ): TemplateResult | typeof nothing {
    const { colors, selected, select } = this;
    const frames = this.result?.frames ?? [];
    return frameBars({
      noun: 'frame',
      ...{ frames, colors, selected, select, title, values, format },
      ends: ['first frame', 'last'],
    });
  }

  private renderSizes(): TemplateResult {
    const { sizes } = this;
    return html`<section>
      <h3>Map size by voxel size</h3>
      ${
        sizes === null
          ? html`<p>
              <button ?disabled=${!this.measurable} @click=${() => fire(this, 'sizes-wanted')}>Measure</button>
            </p>`
          : numberTable(
              ['voxel', 'points', 'size', 'time'],
              sizes.map(({ voxel_size, num_points, num_bytes, ms }) => [
                `${formatFixed(voxel_size * 100, 0)} cm`,
                formatCount(num_points),
                formatBytes(num_bytes),
                formatDuration(ms),
              ]),
            )
      }
    </section>`;
  }

  private select = (frame: number | null): void => {
    fire(this, 'frame-selected', frame);
  };

  static override styles = [
    shared,
    statusStyles,
    panelStyles,
    frameStyles,
    figureStyles,
    css`
      .reason {
        padding: 8px 10px;
        border-radius: var(--radius);
        background: var(--sunken);
      }
      .reason.doubtful {
        ${doubt};
      }
      .reason.lost {
        background: var(--lost-soft);
        color: var(--lost);
      }
      .images {
        display: grid;
        grid-template-columns: repeat(auto-fit, minmax(120px, 1fr));
        gap: 8px;
      }
      figure {
        display: grid;
        align-content: start;
        gap: 3px;
        min-width: 0;
        margin: 0;
      }
      img,
      canvas {
        display: block;
        width: 100%;
        height: auto;
        border-radius: 6px;
        background: light-dark(#e7ebf0, #1c242e);
      }
      figcaption {
        ${row};
        gap: 5px;
        overflow: hidden;
        color: var(--muted);
        font-size: calc(11.5 * var(--px));
        white-space: nowrap;
      }
      figcaption i {
        flex: 1;
        height: 6px;
        border-radius: 3px;
      }
    `,
  ];
}
