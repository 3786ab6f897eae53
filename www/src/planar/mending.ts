/** Mending a map: its loops, the step that is being prepared and what it would change. Loaded when somebody asks for it. */
import { readSteps, stepsText } from '../../../package/report/steps_file.js';
import type { Consequence, Edit, GraphLoop, GraphLoops, PlanarPose, Snapshot } from '../engine/protocol.js';
import { messageOf } from '../engine/message-of.js';
import { LastRequest } from '../engine/last-request.js';
import { download } from '../export/download.js';
import { plural, sentence } from '../views/format.js';
import type { MapLayer } from '../views/map-layer.js';
import { composed, inverse } from './loop-poses.js';
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

export class Mending {
  loops: GraphLoops | null = null;
  draft: Draft | null = null;
  /** Null while it is not known. */
  consequence: Consequence | null = null;
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
    // Computed anew by the full engine, the map has its loops.
    if (session.client?.prepareToMend()) this.#snapshot = session.snapshot;
    else this.follow();
  }

  get steps(): readonly Edit[] {
    return this.session.steps;
  }

  get isIdle(): boolean {
    return this.session.phase === 'done' && this.loops !== null;
  }

  /** Its layer over the map: another one after every change. */
  get layer(): MapLayer {
    this.#layer ??= this.layerOf(this);
    return this.#layer;
  }

  get poses(): readonly PlanarPose[] {
    return this.session.snapshot?.result.frames.map(({ T_world_sensor }) => T_world_sensor) ?? [];
  }

  /** Looks at the loops of a map that has just been computed. */
  follow(): void {
    const { session } = this;
    if (session.phase !== 'done' || session.snapshot === this.#snapshot) return;
    const snapshot = session.snapshot;
    this.#snapshot = snapshot;
    this.draft = null;
    const settle = (loops: GraphLoops | null, problem: string): void => {
      if (session.snapshot !== snapshot) return;
      loops?.loops.sort((a, b) => b.chi_squared - a.chi_squared);
      [this.loops, this.problem] = [loops, problem];
      this.#changed();
    };
    session.ask('graph_loops').then(
      (loops) => settle(loops, ''),
      (error: unknown) => settle(null, messageOf(error)),
    );
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
    if (this.draft?.kind !== 'new' || !this.draft.pose) return {};
    return {
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
  async take(): Promise<void> {
    const { step, consequence } = this;
    if (!this.isIdle || !step || !consequence || consequence.refusal !== null) return;
    await this.#mend([...this.steps, step]);
  }

  async undo(): Promise<void> {
    if (!this.isIdle || this.steps.length === 0) return;
    this.session.announce('The last step was undone.');
    await this.#mend(this.steps.slice(0, -1));
  }

  save(): void {
    const { dataset, snapshot, settings, facts } = this.session;
    if (!dataset || !snapshot || !settings) return;
    const defaults: Readonly<Record<string, unknown>> = { ...facts?.presets[0]?.settings };
    const changed = Object.entries(settings).filter(([name, value]) => value !== defaults[name]);
    const steps = [...this.steps];
    const text = stepsText({ num_scans: snapshot.result.frames.length, settings: Object.fromEntries(changed), steps });
    download({ name: `${dataset.title}.steps.json`, blob: new Blob([text], { type: 'application/json' }) });
  }

  /** Takes the steps of a file in place of those so far. */
  async open(file: File): Promise<void> {
    const { session } = this;
    try {
      const { num_scans, steps } = readSteps(await file.text());
      const count = session.snapshot?.result.frames.length ?? 0;
      if (num_scans !== count)
        throw new Error(`The steps are for a recording of ${plural(num_scans, 'scan')}, and this one has ${count}`);
      await this.#mend(steps);
    } catch (error) {
      session.report(`${file.name}: ${messageOf(error)}`);
    }
  }

  async #mend(steps: readonly Edit[]): Promise<void> {
    const { session } = this;
    this.draft = null;
    this.#changed();
    for (const { index, reason } of await session.mend(steps)) {
      session.report(`Step ${index + 1} was not taken: ${reason}`);
    }
  }

  async #preview(): Promise<void> {
    const { step, session } = this;
    const signal = this.#previews.begin();
    if (!step || !this.isIdle) return;
    try {
      const consequence = await session.previewEdit(step);
      if (signal.aborted) return;
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
