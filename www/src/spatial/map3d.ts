import { html, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { keyed } from 'lit/directives/keyed.js';
import { DrawingSurface } from '../drawing/drawing-surface.js';
import { Graphics, type GraphicsUser } from '../drawing/graphics.js';
import { mapStyles } from '../drawing/map-styles.js';
import { mapFrame, mapToolbar } from '../drawing/map-toolbar.js';
import { shared } from '../components/theme.js';
import { type KeyedMap, PAN_STEP, pressKey, ZOOM_STEP } from '../views/map-keys.js';
import { OrbitedMap } from './orbited-map.js';
import { GRID_BAND } from '../../../package/mesh/floor_grid.js';
import type { FloorGrid, MapPoints } from '../engine/spatial-protocol.js';
import type { Vec3 } from '../views/vectors.js';
import { floorLines } from './floor.js';
import { NO_POINTS } from './leveling.js';
import { chosenMode, chosenSection, FIRST_CHOICES, type LookChoices, ramp, sceneLook } from './look.js';
import {
  graphicsNotice,
  KEY_HELP,
  layers,
  ownButtons,
  readout,
  type Section,
  sectionSlider,
} from './map3d-controls.js';
import { map3dStyles } from './map3d-styles.js';
import { metresPerPixel, orbited } from '../views/orbit.js';
import { showMarks, type SpatialMarks } from './path-marks.js';
import type { MapScene, SceneLook } from './scene.js';
import {
  NO_SURFACE,
  surfaceStyles,
  surfaceBar,
  surfaceButton,
  type SurfaceChange,
  type SurfaceChoices,
  type SurfaceState,
} from './surface-bar.js';
import { leveled, positions, straightened } from './survey.js';
import type { ToolHost } from './map-tool.js';
import { MapTools } from './map-tools.js';
import { fire } from '../components/fire.js';

const TURN_STEP = Math.PI / 24;
/**
 * The map in space: points, paths and cameras, which turn, move and zoom.
 *
 * Fires `frame-selected` with a frame number or null, `surface-wanted` where there is none yet, or one of voxels of another
 * side (m) is wanted, `surface-changed` with what is to be made of it, `map-painted` when a new set of points is on the screen, and `graphics-changed` with 'lost',
 * 'restored' or 'unavailable'.
 */
@customElement('scanstitch-map3d')
export class ScanstitchMap3d extends OrbitedMap implements GraphicsUser<MapScene>, KeyedMap, ToolHost {
  @property({ attribute: false }) points: MapPoints = NO_POINTS;
  /** What there is of the run's surface. */
  @property({ attribute: false }) runSurface: SurfaceState = NO_SURFACE;
  @property({ attribute: false }) names: readonly string[] = [];
  @property({ attribute: false }) referenceName = '';
  /** Edge of the map's voxels, m: how large a point is drawn. */
  @property({ attribute: false }) voxel_size = 0.02;
  @property({ attribute: false }) hasColors = true;
  @property({ type: Boolean }) dark = false;
  /** Changes with the data set, so that the view is fitted again. */
  @property({ attribute: false }) fitKey: unknown = null;
  @property({ attribute: false }) description = '';
  /** Without the buttons on it and the section's slider beside it. */
  @property({ type: Boolean, reflect: true }) bare = false;
  /** The selected frame's picture. */
  @property({ attribute: false }) image: HTMLImageElement | null = null;

  /** Makes the grid that the map is flattened to. */
  @property({ attribute: false }) floorGrid!: ToolHost['floorGrid'];

  band: ToolHost['band'] = GRID_BAND;
  @state() private choices: LookChoices = FIRST_CHOICES;
  @state() private layersOpen = false;
  @query('.stage') readonly stage!: HTMLElement;
  @query('canvas') readonly canvas!: HTMLCanvasElement;

  private graphics = new Graphics(this, this);
  protected readonly surface = new DrawingSurface(this);
  protected readonly tools = new MapTools(this);
  private hasNewPoints = false;

  protected override firstUpdated(): void {
    this.surface.begin();
  }

  protected override willUpdate(changed: PropertyValues<this>): void {
    if (changed.has('fitKey')) {
      this.choices = { ...this.choices, section: null };
      this.tools.end();
      this.viewpoint.reset();
    }
    // Beside the result before, the section stays where it was.
    if (changed.has('pathBefore') && this.pathBefore && this.points.positions.length > 0) {
      this.choices = { ...this.choices, section: this.cut() };
    }
    if (changed.has('points') || changed.has('fitKey')) this.takeSurvey();
    if (changed.get('runSurface')?.mesh === null && this.runSurface.mesh) this.chooseSurface({ shown: 'surface' });
  }

  protected override updated(changed: PropertyValues<this>): void {
    if (changed.has('points')) {
      this.graphics.scene?.setPoints(this.points);
      this.hasNewPoints = true;
    }
    if (this.isOtherSurface(changed)) this.graphics.scene?.setSurface(this.runSurface.mesh);
    const isWhole = changed.has('growing') && !this.growing;
    if ((changed.has('points') || isWhole) && !this.viewpoint.isMoved) this.follow(changed.has('fitKey'));
    if (changed.has('pathBefore')) this.graphics.scene?.setBefore(this.pathBefore?.poses ?? []);
    if (changed.has('marks') || changed.has('image') || changed.has('points')) {
      this.passMarks(changed.get('marks') ?? null);
    }
    this.requestPaint();
  }

  /** What the map is flattened to. */
  async floorGridWanted(): Promise<FloorGrid> {
    return (await import('./flattening.js')).floorGridOf(this);
  }

  /** The map as a picture, at twice the resolution of the screen or better. */
  async picture(): Promise<Blob> {
    const { scene } = this.graphics;
    if (!scene) throw new Error('The browser gives no 3D graphics at the moment.');
    return scene.toPng(this.viewpoint.orbit, this.look(), this.survey.R_view_map[1], 2);
  }

  /** The map as it turns once, from aside, as a video. */
  async turntable(): Promise<Blob> {
    this.tools.end();
    const { recordTurn } = await import('./turntable.js');
    const before = this.viewpoint.orbit;
    const aside = this.toAll({ ...before, elevation: Math.PI / 5, projection: 'perspective' });
    try {
      const show = (share: number): void => this.move({ ...aside, azimuth: aside.azimuth + 2 * Math.PI * share });
      return await recordTurn(this.canvas, show);
    } finally {
      this.move(before);
    }
  }

  protected override render(): TemplateResult {
    const section = { heights: this.survey.heights, cut: this.cut() };
    return mapFrame({
      describedBy: 'map-keys',
      onKey: (event) => this.onKey(event),
      before: sectionSlider(section, (height) => this.choose({ section: height })),
      stage: html`${keyed(this.graphics.canvasNumber, html`<canvas role="img" aria-label=${this.description}></canvas>`)}
      ${KEY_HELP}`,
      over: html`${graphicsNotice(this.graphics.state, () => this.graphics.restart())} ${this.tools.renderOver()}
      ${this.renderControls(section)}`,
      layers: this.layersOpen ? this.renderLayers() : null,
      toggleLayers: this.toggleLayers,
      after: this.tools.renderBars(
        surfaceBar(
          this.runSurface,
          this.choices.surface,
          ramp(this.dark),
          this.chooseSurface,
          this.wantSurface,
          this.changeSurface,
        ),
      ),
    });
  }

  private toggleLayers = (): void => {
    this.layersOpen = !this.layersOpen;
  };

  private renderControls(section: Section): TemplateResult {
    const { choices, viewpoint, hasColors } = this;
    return html`${readout(section, {
      hovered: this.hovered === null ? null : (this.names[this.hovered] ?? ''),
      mode: chosenMode(choices, hasColors),
      dark: this.dark,
      metresPerPixel: metresPerPixel(viewpoint.orbit, this.surface.size),
    })}
    ${mapToolbar({
      zoom: (direction) => this.zoomBy(ZOOM_STEP ** direction),
      fit: () => this.fit(),
      own: html`${surfaceButton(this.runSurface, choices.surface, () => this.toggleSurface())}${ownButtons({
        isFlat: viewpoint.orbit.projection === 'orthographic',
        fromAbove: () => this.fromAbove(),
        toggleProjection: () => this.toggleProjection(),
        hasTools: this.tools.now !== null,
        toggleTools: () => void this.tools.toggle(),
      })}`,
      hasLayers: this.layersOpen,
      layersHint: 'Layers and colours',
      toggleLayers: this.toggleLayers,
    })}`;
  }

  private renderLayers(): TemplateResult {
    const { choices, hasColors, voxel_size, marks } = this;
    return layers({
      choices,
      hasColors,
      voxel_size,
      gridStep: floorLines(this.onFloor(), this.survey.straight).step,
      referenceName: marks.reference.length > 0 ? this.referenceName : null,
      hasCameras: marks.camera !== null,
      choose: (change) => this.choose(change),
    });
  }

  private choose(change: Partial<LookChoices>): void {
    this.choices = { ...this.choices, ...change };
  }

  private isOtherSurface(changed: PropertyValues<this>): boolean {
    const before = changed.get('runSurface');
    return before !== undefined && before.mesh !== this.runSurface.mesh;
  }

  private chooseSurface = (change: Partial<SurfaceChoices>): void =>
    this.choose({ surface: { ...this.choices.surface, ...change } });

  private changeSurface = (change: SurfaceChange): void => fire(this, 'surface-changed', change);

  private wantSurface = (voxelSize?: number): void => fire(this, 'surface-wanted', voxelSize);

  /** Makes the surface, or changes between it and the points. */
  private toggleSurface(): void {
    const { mesh, numPlaced } = this.runSurface;
    if (mesh) this.chooseSurface({ shown: this.choices.surface.shown === 'points' ? 'surface' : 'points' });
    else if (numPlaced > 0) this.wantSurface();
  }

  setMeasured(segments: readonly (readonly [Vec3, Vec3])[]): void {
    this.graphics.scene?.setMeasured(segments);
  }

  // Layers.

  async loadScene(): Promise<typeof MapScene> {
    return (await import('./scene.js')).MapScene;
  }

  onScene(scene: MapScene): void {
    scene.resize(this.surface.size, this.surface.pixelRatio);
    scene.setPoints(this.points);
    scene.setSurface(this.runSurface.mesh);
    scene.setBefore(this.pathBefore?.poses ?? []);
    this.passMarks(null);
    this.hasNewPoints = true;
    this.requestPaint();
  }

  onGraphics(change: 'lost' | 'restored' | 'unavailable'): void {
    fire(this, 'graphics-changed', change);
  }

  private passMarks(before: SpatialMarks | null): void {
    const { marks, survey, image } = this;
    const { scene } = this.graphics;
    if (scene) showMarks(scene, marks, before, image, { ...survey, onFloor: () => this.onFloor() });
  }

  /** What the squares on the floor lie under. */
  private onFloor(): readonly Vec3[] {
    return [...this.survey.sampled, ...positions(this.marks.poses, this.survey.R_view_map)];
  }

  protected cut(): number {
    return chosenSection(this.choices, this.survey.heights);
  }

  private takeSurvey(): void {
    const { poses, camera } = this.marks;
    this.survey = leveled(this.survey, this.points, poses, { hasCamera: camera !== null, isRough: this.growing });
    const { width, height } = this.surface.size;
    this.survey = straightened(this.survey, poses, { cut: this.cut(), isWide: width >= height });
  }

  look(): SceneLook {
    const { hasColors, voxel_size, dark, runSurface, survey } = this;
    const { until, selected, poses } = this.marks;
    const of = { num_frames: poses.length, until, selected, mesh: runSurface.mesh, heights: survey.heights };
    return this.tools.on(sceneLook(this.choices, { hasColors, voxel_size, dark, ...of }));
  }

  // Painting.

  resized(): void {
    this.graphics.scene?.resize(this.surface.size, this.surface.pixelRatio);
    if (!this.viewpoint.isMoved) this.fit(true);
  }

  requestPaint(): void {
    this.surface.requestPaint();
    this.stage.ariaBusy = 'true';
  }

  paint(): void {
    const { viewpoint, graphics } = this;
    if (viewpoint.isFlying) {
      viewpoint.advance();
      if (!viewpoint.isFlying) this.requestUpdate();
    }
    const isMoving = this.tools.now?.advance(performance.now()) ?? false;
    graphics.scene?.render(viewpoint.orbit, this.look(), this.survey.R_view_map[1]);
    if (viewpoint.isFlying || isMoving) this.requestPaint();
    else this.stage.ariaBusy = 'false';
    // Where nothing can be drawn, whoever waits for the map need not wait for ever.
    if (!graphics.scene && graphics.state !== 'unavailable') return;
    if (this.hasNewPoints) {
      this.hasNewPoints = false;
      fire(this, 'map-painted');
    }
  }

  private onKey(event: KeyboardEvent): void {
    if (this.tools.now?.key(event)) return;
    const step = (right: number, down: number): void =>
      event.shiftKey
        ? this.shift(-right * PAN_STEP, -down * PAN_STEP)
        : this.move(orbited(this.viewpoint.orbit, -right * TURN_STEP, down * TURN_STEP));
    pressKey(event, this, {
      ArrowLeft: () => step(-1, 0),
      ArrowRight: () => step(1, 0),
      ArrowUp: () => step(0, -1),
      ArrowDown: () => step(0, 1),
      t: () => this.fromAbove(),
      p: () => this.toggleProjection(),
      m: () => this.toggleSurface(),
      v: () => void this.tools.toggle(),
    });
  }

  static override styles = [shared, mapStyles, map3dStyles, surfaceStyles];
}
