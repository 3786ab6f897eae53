import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { list } from '../components/list-field.js';
import { iconButton } from '../components/icon-button.js';
import { shared } from '../components/theme.js';
import { download } from '../export/download.js';
import { orbited } from '../views/orbit.js';
import { memoizeLast } from '../views/memoize-last.js';
import { makeColors } from '../views/figure-colors.js';
import { pngFile, svgFile } from '../drawing/figure-files.js';
import '../drawing/figure-view.js';
import type { Marker, Painter, ScanstitchFigure } from '../drawing/figure-view.js';
import { sectionStyles } from '../components/section-styles.js';
import { figuresStyles } from './evaluate-styles.js';
import { nearestIndex, plotArea, type Size } from '../views/figures.js';
import { instantMarker, NO_MARKS, poseMarker } from './marks.js';
import { type FigureName, makePainter } from './painters.js';
import { type Camera, type Look, poseAt, type Projection, projection, widestLook } from './paths.js';
import type { Comparison } from './protocol.js';
import { type Abscissa, ABSCISSA_NAMES, makeAbscissas, poseAtInstant, possibleAbscissa, type Scene } from './scene.js';
import { formatValue } from './table.js';

const LOOKS: readonly [Look, string, string][] = [
  ['top', 'xy', 'x to the right, y up'],
  ['side', 'xz', 'x to the right, z up'],
  ['front', 'yz', 'y to the right, z up'],
  ['space', '3D', 'from any side: drag to turn'],
];
const ABSCISSAS: Record<Abscissa, string> = { seconds: 'time', distance: 'distance', number: 'number of the pose' };
const START_CAMERA: Camera = { look: 'top', azimuth: 0.8, elevation: 0.5, zoom: 1, panX: 0, panY: 0 };
/** The pointer takes a pose no further away than this (pixels). */
const REACH = 40;
const RADIANS_PER_PIXEL = 0.008;
const ZOOMS = { min: 0.2, max: 1e4 };
/** Of paper. */
const LIGHT = makeColors(false);

/** The figures of an evaluation; pointing at an instant in one marks it in all. */
@customElement('scanstitch-evaluation-figures')
export class ScanstitchEvaluationFigures extends LitElement {
  @property({ attribute: false }) comparisons: readonly Comparison[] = [];
  @property({ attribute: false }) selectedId = -1;
  /** Ids of all estimates, in the order in which they came: colours stay theirs. */
  @property({ attribute: false }) order: readonly number[] = [];
  @property({ type: Boolean }) dark = false;
  /** What the axis is to begin with; the user may choose another. */
  @property({ attribute: false }) firstAbscissa: Abscissa = 'seconds';
  /** Another value for other data: the view then turns to where they are seen best. */
  @property({ attribute: false }) dataKey = 0;

  @state() private abscissa: Abscissa = 'seconds';
  @state() private camera: Camera = START_CAMERA;
  /** The instant that all figures mark, on the common axis. */
  @state() private instant: number | null = null;
  @query('.paths scanstitch-figure') private pathFigure!: ScanstitchFigure;

  private scene!: Scene;
  private painters: Partial<Record<FigureName, Painter>> = {};
  private lookedAtKey = -1;
  private abscissasOf = memoizeLast(makeAbscissas);
  private colorsOf = memoizeLast(makeColors);
  /** Asked for at every move of the pointer: made again only for another size, camera or answer. */
  private rememberedProjection = memoizeLast(
    (width: number, height: number, camera: Camera, comparisons: readonly Comparison[]) => {
      const paths = comparisons.flatMap((c) => [c.estimate_positions, c.reference_positions]);
      return projection({ width, height }, paths, camera);
    },
  );

  /** Whether everything is on the screen. */
  async isDrawn(): Promise<void> {
    await this.updateComplete;
    const figures = this.renderRoot.querySelectorAll<ScanstitchFigure>('scanstitch-figure');
    await Promise.all([...figures].map((figure) => figure.updateComplete));
  }

  protected override willUpdate(changed: PropertyValues<this>): void {
    const has = (name: string) => (changed as Map<string, unknown>).has(name);
    if (has('firstAbscissa')) this.abscissa = this.firstAbscissa;
    if (this.lookedAtKey !== this.dataKey && this.comparisons.length > 0) {
      this.lookedAtKey = this.dataKey;
      const paths = this.comparisons.map(({ reference_positions }) => reference_positions);
      this.camera = { ...START_CAMERA, look: widestLook(paths) };
      this.instant = null;
    }
    if (['comparisons', 'selectedId', 'abscissa', 'dark', 'order'].some(has)) {
      this.scene = this.makeScene(this.dark);
      this.painters = {};
    }
    if (has('camera')) delete this.painters.paths;
  }

  private makeScene(dark: boolean): Scene {
    const { comparisons, order } = this;
    const colors = dark ? this.colorsOf(true) : LIGHT;
    const abscissa = possibleAbscissa(this.abscissa, comparisons);
    const { values, range } = this.abscissasOf(abscissa, comparisons);
    return {
      comparisons,
      selected: comparisons.find(({ id }) => id === this.selectedId) ?? null,
      colors,
      colorOf: ({ id }) => colors.estimates[Math.max(order.indexOf(id), 0) % colors.estimates.length] as string,
      abscissa,
      xOf: ({ id }) => values.get(id) ?? [],
      xRange: range,
    };
  }

  private project = ({ width, height }: Size): Projection =>
    this.rememberedProjection(width, height, this.camera, this.comparisons);

  private painter(name: FigureName): Painter {
    this.painters[name] ??= makePainter(name, this.scene, this.camera, this.project);
    return this.painters[name];
  }

  protected override render(): TemplateResult | typeof nothing {
    const { scene, instant } = this;
    const { selected } = scene;
    if (!selected) return nothing;
    const { statistics, unit } = selected.summary;
    const of = `of ${selected.name}: rmse ${formatValue(statistics.rmse)} ${unit}, largest ${formatValue(statistics.max)} ${unit}.`;
    const over = `Error over ${ABSCISSA_NAMES[scene.abscissa]} ${of}`;
    return html`<div class="grid">
      ${this.renderPaths(`Paths, coloured by the error ${of}`)}
      ${this.renderPlot('errors', 'Error', over, instantMarker(scene, instant, 1, true))}
      ${this.renderPlot('histogram', 'Histogram', `Histogram of the errors ${of}`, null)}
      ${this.renderPlot('positions', 'Position', 'x, y and z of ground truth and estimate.', instantMarker(scene, instant, 3, false))}
      ${
        selected.referenceAngles && selected.estimateAngles
          ? this.renderPlot(
              'angles',
              'Orientation',
              'Roll, pitch and yaw of ground truth and estimate.',
              instantMarker(scene, instant, 3, false),
            )
          : nothing
      }
    </div>`;
  }

  private renderPaths(description: string): TemplateResult {
    return html`<section class="paths" aria-label="Paths">
      <header>
        <h2>Paths</h2>
        <div class="looks" role="group" aria-label="View">
          ${LOOKS.map(
            ([look, label, title]) =>
              html`<button
                class="quiet"
                title=${title}
                aria-pressed=${this.camera.look === look}
                @click=${() => {
                  this.camera = { ...START_CAMERA, look };
                }}
              >
                ${label}
              </button>`,
          )}
        </div>
        <div class="looks" role="group" aria-label="Zoom">
          ${iconButton('plus', 'Zoom in', () => this.zoom(1.5), { size: 14 })}
          ${iconButton('minus', 'Zoom out', () => this.zoom(1 / 1.5), { size: 14 })}
          ${iconButton(
            'fit',
            'Show all',
            () => {
              this.camera = { ...START_CAMERA, look: this.camera.look };
            },
            { hint: 'Show all', size: 14 },
          )}
        </div>
        ${this.renderSave('paths')}
      </header>
      <scanstitch-figure
        movable
        label="Paths"
        .painter=${this.painter('paths')}
        .marker=${poseMarker(this.scene, this.instant, this.project)}
        .description=${description}
        @figure-pointer=${this.onPathPointer}
        @figure-dragged=${this.onPathDragged}
        @figure-zoomed=${({ detail }: CustomEvent<{ factor: number }>) => this.zoom(detail.factor)}
      ></scanstitch-figure>
      ${this.readout()}
    </section>`;
  }

  private renderPlot(name: FigureName, title: string, description: string, marker: Marker | null): TemplateResult {
    return html`<section class=${name} aria-label=${title}>
      <header>
        <h2>${title}</h2>
        ${name === 'errors' ? this.renderAbscissa() : nothing} ${this.renderSave(name)}
      </header>
      <scanstitch-figure
        label=${title}
        ?steppable=${marker !== null}
        .painter=${this.painter(name)}
        .marker=${marker ?? NO_MARKS}
        .description=${description}
        @figure-pointer=${marker ? this.onPlotPointer : nothing}
        @figure-stepped=${marker ? this.onStep : nothing}
      ></scanstitch-figure>
    </section>`;
  }

  private renderAbscissa(): TemplateResult {
    const choose = (abscissa: Abscissa): void => {
      this.abscissa = abscissa;
      this.instant = null;
    };
    return html`<label class="over">over ${list(ABSCISSAS, this.scene.abscissa, choose)}</label>`;
  }

  private renderSave(name: FigureName): TemplateResult {
    return html`<span class="save">
      ${(['PNG', 'SVG'] as const).map(
        (form) =>
          html`<button
            class="quiet"
            aria-label="Save ${name} as ${form}"
            @click=${(event: Event) => this.save(event, name, form)}
          >
            ${form}
          </button>`,
      )}
    </span>`;
  }

  private readout(): TemplateResult | typeof nothing {
    const { instant, scene } = this;
    const found = instant === null || !scene.selected ? null : poseAtInstant(scene, scene.selected, instant);
    if (!found || !scene.selected) return nothing;
    const name = ABSCISSA_NAMES[scene.abscissa].replace(/ \(.*/, '');
    const error = found.error === null ? '–' : Number(found.error.toPrecision(4));
    return html`<output class="readout number"
      >${name} ${Number(found.x.toPrecision(6))}, error ${error} ${scene.selected.summary.unit}</output
    >`;
  }

  private async save(event: Event, name: FigureName, form: 'PNG' | 'SVG'): Promise<void> {
    const section = (event.currentTarget as HTMLElement).closest('section');
    const { size } = section?.querySelector<ScanstitchFigure>('scanstitch-figure') ?? this.pathFigure;
    // In the colours for paper, regardless of the theme.
    const painter = makePainter(name, this.makeScene(false), this.camera, this.project);
    const blob = await (form === 'SVG' ? svgFile : pngFile)(painter, size, LIGHT.background);
    download({ name: `${name}.${form.toLowerCase()}`, blob });
  }

  // The pointer and the keys.

  private zoom(factor: number): void {
    const zoom = Math.min(Math.max(this.camera.zoom * factor, ZOOMS.min), ZOOMS.max);
    this.camera = { ...this.camera, zoom };
  }

  private onPathPointer({ detail, currentTarget }: CustomEvent<{ x: number; y: number } | null>): void {
    const { selected } = this.scene;
    if (!detail || !selected) {
      this.instant = null;
      return;
    }
    const view = this.project((currentTarget as ScanstitchFigure).size);
    const pose = poseAt(view, selected.estimate_positions, detail.x, detail.y, REACH);
    this.instant = pose === null ? null : (this.scene.xOf(selected)[pose] ?? null);
  }

  private onPathDragged({ detail, currentTarget }: CustomEvent<{ dx: number; dy: number }>): void {
    const { camera } = this;
    if (camera.look === 'space') {
      this.camera = orbited(camera, detail.dx * RADIANS_PER_PIXEL, -detail.dy * RADIANS_PER_PIXEL);
      return;
    }
    const { scale } = this.project((currentTarget as ScanstitchFigure).size);
    this.camera = { ...camera, panX: camera.panX + detail.dx / scale, panY: camera.panY - detail.dy / scale };
  }

  private onPlotPointer({ detail, currentTarget }: CustomEvent<{ x: number; y: number } | null>): void {
    if (!detail) {
      this.instant = null;
      return;
    }
    const area = plotArea((currentTarget as ScanstitchFigure).size);
    const { low, high } = this.scene.xRange;
    const share = (detail.x - area.x) / area.width;
    this.instant = share < 0 || share > 1 ? null : low + share * (high - low);
  }

  /** To the next pose, or, of many, by a two-hundredth of all. */
  private onStep({ detail }: CustomEvent<{ direction: number }>): void {
    const { selected } = this.scene;
    if (!selected) return;
    const xs = this.scene.xOf(selected);
    const pose = this.instant === null ? -detail.direction : nearestIndex(xs, this.instant);
    const step = Math.max(Math.round(xs.length / 200), 1) * detail.direction;
    this.instant = xs[Math.min(Math.max(pose + step, 0), xs.length - 1)] ?? null;
  }

  static override styles = [shared, sectionStyles, figuresStyles];
}
