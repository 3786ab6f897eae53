/** Mending a map: its loops, the step that is being prepared and what it would change. Loaded when somebody asks for it. */
import { readSteps, stepsText } from '../../../package/report/steps_file.js';
import type { Consequence, Edit, GraphLoop, GraphLoops, PlanarPose, Snapshot } from '../engine/protocol.js';
import { messageOf } from '../engine/message-of.js';
import { LastRequest } from '../engine/last-request.js';
import { changedSettings } from '../export/exports.js';
import { download } from '../export/download.js';
import { plural, sentence } from '../views/format.js';
import type { MapLayer } from '../views/map-layer.js';
import { GridTools } from './grid-tools.js';
import { composed, inverse } from './loop-poses.js';
import { MapMeasuring } from './map-measuring.js';
import { PlanTools } from './plan-tools.js';
import type { PlanarSession } from './session.js';

/** A step that is not taken yet: a loop to be taken out, or scans between which one is to be put in. */
export type Draft =
  | { kind: 'old'; loop: GraphLoop }
  /** `pose`: where the second scan is laid in the world, once both are chosen. */
  | { kind: 'new'; scans: readonly number[]; pose: PlanarPose | null };

/** An arrow key moves a scan by this (m) ... */
const KEY_STEP = 0.1;
/** ... and a bracket turns it by this (rad). */
const KEY_TURN = Math.PI / 36;

/** Loops are mended, the grid and the frame of the map edited, a plan is laid behind the map, and it is measured. */
export type MendPart = 'loops' | 'grid' | 'plan' | 'measure';

/** What is said of a step. */
const TAKEN: Partial<Record<Edit['action'], string>> = {
  crop: 'The grid is cropped.',
  anchor: 'The map is laid on the known coordinates.',
};

export class Mending {
  loops: GraphLoops | null = null;
  draft: Draft | null = null;
  /** Null while it is not known. */
  consequence: Consequence | null = null;
  /** What the panel is about. */
  part: MendPart = 'loops';
  readonly grid = new GridTools(() => this.#changed());
  readonly measuring: MapMeasuring;
  readonly plan: PlanTools;
  /** Why there is nothing to mend; empty where there is. */
  problem = '';
  #layer: MapLayer | null = null;
  #snapshot: Snapshot | null = null;
  readonly #previews = new LastRequest();

  constructor(
    readonly session: PlanarSession,
    readonly onChange: () => void,
    readonly layerOf: (mending: Mending) => MapLayer,
  ) {
    this.measuring = new MapMeasuring(session, () => this.#changed());
    this.plan = new PlanTools(session, () => this.#changed());
    // Computed anew by the full engine, the map has its loops.
    if (session.client?.prepareToMend()) this.#snapshot = session.snapshot;
    else this.follow();
  }

  /** Whether the grid is edited, and not the loops. */
  get isOnGrid(): boolean {
    return this.part === 'grid';
  }

  get steps(): readonly Edit[] {
    return this.session.client?.steps ?? [];
  }

  get isIdle(): boolean {
    return this.session.phase === 'done' && this.loops !== null;
  }

  /** Whether there is a map whose grid can be edited, which needs no loops. */
  get isDone(): boolean {
    return this.session.phase === 'done' && this.session.snapshot !== null;
  }

  /** Its layer over the map: another one after every change. */
  get layer(): MapLayer {
    this.#layer ??= this.layerOf(this);
    return this.#layer;
  }

  get poses(): readonly PlanarPose[] {
    return this.session.snapshot?.result.frames.map(({ T_world_sensor }) => T_world_sensor) ?? [];
  }

  /** Of the map: certain ones. */
  get numPieces(): number {
    return new Set(this.session.snapshot?.result.frames.map(({ piece }) => piece)).size;
  }

  /** Looks at the loops of a map that has just been computed. */
  follow(): void {
    const { session } = this;
    if (session.phase !== 'done' || session.snapshot === this.#snapshot) return;
    const snapshot = session.snapshot;
    this.#snapshot = snapshot;
    this.draft = null;
    // The map may lie elsewhere now.
    this.measuring.clear();
    if (this.steps.at(-1)?.action === 'anchor') this.grid.clear();
    const settle = (loops: GraphLoops | null, problem: string): void => {
      if (session.snapshot !== snapshot) return;
      loops?.loops.sort((a, b) => b.chi_squared - a.chi_squared);
      [this.loops, this.problem] = [loops, problem];
      this.#changed();
    };
    void session.ask('plan').then(
      (laid) => session.snapshot === snapshot && void this.plan.adopt(laid),
      () => undefined, // the session tells of it
    );
    session.ask('graph_loops').then(
      (loops) => settle(loops, ''),
      (error: unknown) => settle(null, messageOf(error)),
    );
  }

  /** Turns to another part. */
  turnTo(part: MendPart): void {
    this.part = part;
    this.#changed();
  }

  /** What is to be done; null: nothing. */
  prepare(draft: Draft | null): void {
    this.draft = draft;
    this.consequence = null;
    this.#changed();
    void this.#preview();
  }

  /** Takes a scan as the next one of a loop to be put in. */
  chooseScan(scan: number, at?: number): void {
    if (this.draft?.kind !== 'new') return;
    const scans = [...this.draft.scans];
    scans[at ?? scans.length] = scan;
    const pose = scans.length === 2 ? (this.poses[scans[1] ?? -1] ?? null) : null;
    this.prepare({ kind: 'new', scans, pose });
  }

  /** Lays the second scan elsewhere. `isOver`: its consequence is wanted. */
  lay(pose: PlanarPose, isOver = true): void {
    if (this.draft?.kind !== 'new') return;
    this.draft = { ...this.draft, pose };
    this.consequence = null;
    this.#changed();
    if (isOver) void this.#preview();
  }

  /** Moves it (m) and turns it (rad). */
  move(x: number, y: number, turn = 0, isOver = true): boolean {
    const pose = this.draft?.kind === 'new' ? this.draft.pose : null;
    if (pose) this.lay({ x: pose.x + x, y: pose.y + y, theta: pose.theta + turn }, isOver);
    return pose !== null;
  }

  get keys(): Record<string, () => void> {
    if (this.isOnGrid) {
      const { grid } = this;
      return {
        Enter: () => this.takeOnGrid(),
        ...(grid.places.length > 0 && { Escape: () => grid.clear() }),
      };
    }
    if (this.part === 'measure') {
      const { measuring } = this;
      return {
        Enter: () => measuring.takeCross(),
        Backspace: () => measuring.back(),
        ...(!measuring.isEmpty && { Escape: () => measuring.clear() }),
      };
    }
    if (this.part === 'plan') {
      const { plan } = this;
      return { Enter: () => plan.tapMap(plan.cross), Backspace: () => plan.remove(plan.pairs.length - 1) };
    }
    const back = this.draft && { Escape: () => this.prepare(null) };
    if (this.draft?.kind !== 'new' || !this.draft.pose) return { ...back };
    return {
      ...back,
      ArrowLeft: () => void this.move(-KEY_STEP, 0),
      ArrowRight: () => void this.move(KEY_STEP, 0),
      ArrowUp: () => void this.move(0, KEY_STEP),
      ArrowDown: () => void this.move(0, -KEY_STEP),
      '[': () => void this.move(0, 0, KEY_TURN),
      ']': () => void this.move(0, 0, -KEY_TURN),
    };
  }

  /** The step that is prepared. */
  get step(): Edit | null {
    const { draft, poses } = this;
    if (draft?.kind === 'old') {
      const { target, source } = draft.loop;
      return { action: 'remove_loop', target, source };
    }
    const [target = -1, source = -1] = draft?.scans ?? [];
    const T_world_target = poses[target];
    if (!draft?.pose || !T_world_target) return null;
    const T_target_source = composed(inverse(T_world_target), draft.pose);
    return { action: 'add_loop', target, source, T_target_source, unchecked: false };
  }

  /** Takes the step that is prepared, unless it would be refused. */
  take(): void {
    const { step, consequence } = this;
    if (step && consequence?.refusal === null) this.#mend([...this.steps, step]);
  }

  /** Takes what the tool of the grid has drawn. */
  takeOnGrid(): void {
    const { step } = this.grid;
    if (!step || !this.isDone) return;
    // The pairs of an anchor that is refused are corrected.
    if (step.action !== 'anchor') this.grid.clear();
    this.session.announce(TAKEN[step.action] ?? 'The shape is painted.');
    // The map may lie far away then.
    if (step.action === 'anchor') this.session.fitAnew();
    this.#mend([...this.steps, step]);
  }

  /** Lays the plan as its points have it. */
  layPlan(): void {
    const { step } = this.plan;
    if (!step || !this.isDone) return;
    this.session.announce('The plan lies behind the map.');
    this.#mend([...this.steps, step]);
  }

  removePlan(): void {
    this.session.announce('The plan is taken off.');
    this.#mend([...this.steps, { action: 'remove_plan' }]);
  }

  /** Turns the map (rad); null: to its walls. */
  rotate(angle: number | null): void {
    this.grid.clear();
    this.session.announce('The map is turned.');
    this.#mend([...this.steps, { action: 'rotate', ...(angle !== null && { angle }) }]);
  }

  leaveOut(first: number, last: number): void {
    const { length } = this.poses;
    if (![first, last].every((scan) => Number.isInteger(scan) && scan >= 0 && scan < length) || first > last) {
      this.session.report(`Scans are left out from a number to one that is not less, of 0 to ${length - 1}.`);
      return;
    }
    this.#mend([...this.steps, { action: 'leave_out', first, last }]);
  }

  undo(): void {
    if (!this.isDone || this.steps.length === 0) return;
    this.session.announce('The last step was undone.');
    this.#mend(this.steps.slice(0, -1));
  }

  save(): void {
    const { poses, steps, session } = this;
    if (!session.dataset) return;
    const { pictures } = session;
    const text = stepsText({ num_scans: poses.length, settings: this.#changedSettings, steps: [...steps], pictures });
    download({ name: `${session.dataset.title}.steps.json`, blob: new Blob([text], { type: 'application/json' }) });
  }

  /** Saves the graph with the information of its motions, as g2o. */
  async saveGraph(): Promise<void> {
    const { session } = this;
    try {
      const blob = new Blob([await session.ask('graph_g2o')], { type: 'text/plain' });
      download({ name: 'graph.g2o', blob });
    } catch (error) {
      session.report(messageOf(error));
    }
  }

  /** Takes the steps of a file in place of those so far, with its settings. */
  async open(file: File): Promise<void> {
    const { session, poses } = this;
    try {
      const { num_scans: numScans, steps, settings, pictures } = readSteps(await file.text());
      if (numScans !== poses.length) {
        const scans = plural(numScans, 'scan');
        throw new Error(`The steps are for a recording of ${scans}, and this one has ${poses.length}`);
      }
      session.pictures = { ...session.pictures, ...pictures };
      this.#mend(steps);
      const [defaults] = session.facts?.presets ?? [];
      const isOther = JSON.stringify(settings) !== JSON.stringify(this.#changedSettings);
      if (defaults && isOther) session.configure({ ...defaults.settings, ...settings });
    } catch (error) {
      session.report(`${file.name}: ${messageOf(error)}`);
    }
  }

  /** The settings that are not those by default. */
  get #changedSettings(): Record<string, unknown> {
    const { settings, facts } = this.session;
    return changedSettings(settings, facts?.presets[0]?.settings);
  }

  #mend(steps: readonly Edit[]): void {
    this.draft = null;
    const { session } = this;
    if (this.isDone) {
      [session.phase, session.progress, session.activity] = ['running', 0, 'Mending the map'];
      session.client?.mend(steps);
      session.changed();
    }
    this.#changed();
  }

  async #preview(): Promise<void> {
    const { step, session } = this;
    const signal = this.#previews.begin();
    if (!step || !this.isIdle) return;
    try {
      const consequence = await session.client?.previewEdit(step);
      if (signal.aborted || !consequence) return;
      this.consequence = consequence;
      session.announce(consequence.refusal === null ? 'The step can be taken.' : sentence(consequence.refusal));
      this.#changed();
    } catch (error) {
      if (!signal.aborted) session.report(messageOf(error));
    }
  }

  #changed(): void {
    this.#layer = null;
    this.onChange();
  }
}
