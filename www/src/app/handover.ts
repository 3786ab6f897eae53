/** What the views beside a run take over from it when they are opened: its result, its recording, two of its clouds. */
import type { ReactiveControllerHost } from 'lit';
import type { GivenClouds } from '../run/given-clouds.js';
import type { GivenFiles, GivenRecording, GivenScans, ViewFacts } from '../run/run-kind.js';

interface Run {
  readonly facts: ViewFacts;
  readonly isUnderWay: boolean;
  filesToEvaluate(): Promise<GivenFiles | null>;
  cloudsToRegister(frame: number | null): Promise<GivenClouds | null>;
  recordingToCompare(): GivenRecording | GivenScans | null;
}

export interface HandoverHooks {
  /** The run that is shown, or lies behind a view beside it; null before there is one. */
  run(): Run | null;
  planar(): { scansToLocate(): GivenScans | null } | null;
}

export class Handover {
  evaluated: GivenFiles | null = null;
  compared: GivenRecording | GivenScans | null = null;
  lookedInto: GivenClouds | null = null;
  toLocate: GivenScans | null = null;
  /** A map that was dropped on another view, and the recording beside it. */
  dropped: unknown = null;
  readonly #host: ReactiveControllerHost;
  readonly #hooks: HandoverHooks;
  /** The result that was taken over last; its map is not kept alive by this. */
  #evaluatedOf: WeakRef<object> | null = null;
  /** The evaluation was opened while a run was under way, which goes along when it is done. */
  #awaitsResult = false;

  constructor(host: ReactiveControllerHost, hooks: HandoverHooks) {
    this.#host = host;
    this.#hooks = hooks;
  }

  /** A run that is done goes along, with its reference. */
  async openEvaluation(): Promise<void> {
    await this.#takeResult();
    this.#awaitsResult = this.#hooks.run()?.isUnderWay ?? false;
  }

  /** The run may be done now. */
  async follow(): Promise<void> {
    if (!this.#awaitsResult || this.#hooks.run()?.isUnderWay) return;
    this.#awaitsResult = false;
    await this.#takeResult();
  }

  async #takeResult(): Promise<void> {
    const run = this.#hooks.run();
    const { result = null } = run?.facts ?? {};
    if (!run || !result || this.#evaluatedOf?.deref() === result) return;
    const files = await run.filesToEvaluate();
    if (files) [this.evaluated, this.#evaluatedOf] = [files, new WeakRef(result)];
    this.#host.requestUpdate();
  }

  /** The recording goes along; the comparison of one that has been compared stays as it is. */
  openStrategies(): void {
    this.compared = this.#hooks.run()?.recordingToCompare() ?? this.compared;
    this.#host.requestUpdate();
  }

  /** The scans of the run go along, and what was dropped. */
  openLocalization(dropped = this.dropped): void {
    this.dropped = dropped;
    this.toLocate = this.#hooks.planar()?.scansToLocate() ?? this.toLocate;
    this.#host.requestUpdate();
  }

  /** The registration of a scan or frame as the run did it; null: of the selected one to the one before. */
  async openLab(frame: number | null): Promise<void> {
    const clouds = (await this.#hooks.run()?.cloudsToRegister(frame)) ?? null;
    const isSame = clouds?.source === this.lookedInto?.source && clouds?.of === this.lookedInto?.of;
    if (clouds && (frame !== null || !isSame)) this.lookedInto = clouds;
    this.#host.requestUpdate();
  }
}
