/** The map in space flattened to a grid for robots that drive: the band of heights is chosen by eye, for the map is cut to it. */
import { html, type TemplateResult } from 'lit';
import { slider } from '../components/fields.js';
import type { FloorGridFiles } from '../engine/spatial-protocol.js';
import { messageOf } from '../engine/message-of.js';
import { download } from '../export/download.js';
import { zip } from '../export/exports.js';
import { formatCount, formatFixed, formatLength } from '../views/format.js';
import { scaled } from '../views/vectors.js';
import type { MapTool, ToolHost } from './map-tool.js';
import type { Plane } from './section.js';

/** Heights are chosen in steps of a cell, and the band is at least so high (m). */
const STEP = 0.05;
/** The picture of a grid is enlarged to at least about this size (CSS pixels). */
const MIN_SHOWN = 240;

export class Flattening implements MapTool {
  readonly hidden = [] as const;
  readonly isInside = false;
  readonly help =
    'What stands in the band is occupied; where the floor was seen, or rays passed close over it, it is free.';
  #host: ToolHost;
  #files: FloorGridFiles | null = null;
  #picture: TemplateResult | null = null;
  #problem = '';
  #isMaking = false;

  constructor(host: ToolHost) {
    this.#host = host;
  }

  /** What lies above is cut away. */
  get section(): number {
    return this.#host.survey.heights.floor + this.#host.band[1];
  }

  /** And what lies below. */
  get plane(): Plane {
    const { survey, band } = this.#host;
    return { normal: scaled(survey.R_view_map[1], -1), offset: -(survey.heights.floor + band[0]) };
  }

  key(): boolean {
    return false;
  }

  renderBar(): TemplateResult {
    const { band, survey } = this.#host;
    const highest = Math.max(survey.heights.top - survey.heights.floor, band[1]);
    const [low, high] = band;
    const height = (
      label: string,
      value: number,
      [min, max]: readonly [number, number],
      take: (to: number) => void,
    ): TemplateResult =>
      html`<label>
        ${label} ${slider(value, { label: `${label} over the floor`, min, max, step: STEP, words: words(value) }, take)}
        <output class="number">${words(value)}</output>
      </label>`;
    return html`${height('From', low, [STEP, high - STEP], (to) => this.#choose([to, high]))}
      ${height('to', high, [low + STEP, highest], (to) => this.#choose([low, to]))} <span>over the floor</span>
      <button type="button" ?disabled=${this.#isMaking} @click=${() => void this.#make()}>Make the grid</button>
      <button type="button" ?disabled=${!this.#files} @click=${() => void this.#save()}>Save the grid</button>
      <span class="muted" role="status">${this.#words()}</span>`;
  }

  renderOver(): TemplateResult | null {
    return this.#picture;
  }

  #words(): string {
    if (this.#problem !== '') return this.#problem;
    if (this.#isMaking) return 'Making the grid';
    return this.#files ? gridWords(this.#files) : '';
  }

  #choose([low, high]: readonly [number, number]): void {
    this.#host.band = [rounded(low), rounded(high)];
    [this.#files, this.#picture, this.#problem] = [null, null, ''];
    this.#host.requestUpdate();
    this.#host.requestPaint();
  }

  async #make(): Promise<void> {
    const { band } = this.#host;
    this.#isMaking = true;
    this.#host.requestUpdate();
    try {
      const files = await this.#host.floorGrid(floorGridOf(this.#host));
      // Another band may have been chosen meanwhile.
      if (band === this.#host.band) [this.#files, this.#picture, this.#problem] = [files, pictureOf(files), ''];
    } catch (error) {
      this.#problem = messageOf(error);
    }
    this.#isMaking = false;
    this.#host.requestUpdate();
  }

  async #save(): Promise<void> {
    if (this.#files) download({ name: 'floor_grid.zip', blob: await zip(filesOf(this.#files)) });
  }
}

const rounded = (metres: number): number => Math.round(metres / STEP) / Math.round(1 / STEP);
const words = (metres: number): string => `${formatFixed(metres, 2)} m`;

/** The grid that a map is flattened to. */
export const floorGridOf = ({
  survey,
  band,
}: Pick<ToolHost, 'survey' | 'band'>): Parameters<ToolHost['floorGrid']>[0] => ({
  up: survey.R_view_map[1],
  floor: survey.heights.floor,
  band,
});

/** Its files. */
export const filesOf = ({ pgm, yaml }: FloorGridFiles): Record<string, Uint8Array> => ({
  'map.pgm': pgm,
  'map.yaml': new TextEncoder().encode(yaml),
});

const countOf = (greys: Uint8Array, grey: number): number =>
  greys.reduce((sum, value) => sum + Number(value === grey), 0);

function gridWords({ width, height, yaml, greys }: FloorGridFiles): string {
  const side = formatLength(Number(/^resolution: *(\S+)/m.exec(yaml)?.[1]));
  const [occupied, free] = [0, 254].map((grey) => formatCount(countOf(greys, grey)));
  return `${width} × ${height} cells of ${side}: ${occupied} occupied, ${free} free`;
}

function pictureOf({ width, height, greys }: FloorGridFiles): TemplateResult {
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [width, height];
  const pixels = new ImageData(width, height);
  const packed = new Uint32Array(pixels.data.buffer);
  greys.forEach((grey, index) => {
    packed[index] = (255 << 24) | (grey << 16) | (grey << 8) | grey;
  });
  canvas.getContext('2d')?.putImageData(pixels, 0, 0);
  const words = `The grid from above: ${countOf(greys, 0)} cells occupied, ${countOf(greys, 254)} free`;
  // A small one is seen with its cells as whole squares.
  const side = Math.max(1, Math.floor(MIN_SHOWN / Math.max(width, height)));
  return html`<img class="floor-grid" width=${side * width} src=${canvas.toDataURL()} alt=${words} />`;
}
