/** What the host page hears of a run: its progress, its end, and settings that cannot be used. */
import type { ReactiveControllerHost } from 'lit';
import { type ScanstitchProgress, type ScanstitchResult, tellHost } from '../components/host-events.js';
import type { Message } from '../components/messages.js';
import { type Phase, STOPPED } from '../components/session.js';
import { fire } from '../components/fire.js';

/** The part of a run that events report. */
interface ToldRun {
  phase: Phase;
  progress: number;
  activity: string;
  messages: readonly Message[];
  snapshot: object | null;
  /** Clock time. */
  requestedAt: number;
}

export class RunEvents {
  /** What is wrong with the initial settings, until it is reported. */
  settingFaults: string[] = [];
  #isUsed = false;
  readonly #view: ReactiveControllerHost & EventTarget;
  #toldProgress: ScanstitchProgress | null = null;
  #waiting: { resolve(outcome: ScanstitchResult): void; reject(error: Error): void }[] = [];
  /** Results whose completion was reported. */
  #told = new WeakSet<object>();

  constructor(view: ReactiveControllerHost & EventTarget) {
    this.#view = view;
  }

  /** The result of the run that is under way. */
  end(): Promise<ScanstitchResult> {
    return new Promise((resolve, reject) => {
      this.#waiting.push({ resolve, reject });
      this.#view.requestUpdate();
    });
  }

  /** There will be no end. */
  abandon(reason: string): void {
    for (const { reject } of this.#waiting.splice(0)) reject(new Error(reason));
  }

  /** Answers those who wait for the end; the run is over, with or without an outcome. */
  settle({ messages, phase }: ToldRun, outcomeOf: () => ScanstitchResult | null): void {
    if (this.#waiting.length === 0) return;
    const outcome = outcomeOf();
    const error = messages.find(({ kind }) => kind === 'error')?.text;
    for (const { resolve, reject } of this.#waiting.splice(0)) {
      if (outcome) resolve(outcome);
      else reject(new Error(error ?? (phase === 'stopped' ? STOPPED : 'There is nothing to compute')));
    }
  }

  tellProgress({ phase, progress, activity }: ToldRun): void {
    const isUnderWay = phase === 'reading' || phase === 'running';
    // Errors in settings matter only for the kind of run that is used.
    this.#isUsed ||= isUnderWay;
    const faults = this.#isUsed ? this.settingFaults.splice(0) : [];
    if (faults.length > 0) fire(this.#view, 'settings-refused', faults);
    if (!isUnderWay) {
      this.#toldProgress = null; // the next run begins with an event, even if it begins as this one ended
      return;
    }
    const told = this.#toldProgress;
    if (told?.stage === phase && told.progress === progress && told.activity === activity) return;
    this.#toldProgress = { stage: phase, progress, activity };
    tellHost(this.#view, 'scanstitch-progress', this.#toldProgress);
  }

  /** The result is on the screen; reported once. */
  tellDone({ snapshot, requestedAt }: ToldRun, outcomeOf: () => ScanstitchResult): void {
    if (!snapshot || this.#told.has(snapshot)) return;
    this.#told.add(snapshot);
    tellHost(this.#view, 'scanstitch-done', { ...outcomeOf(), elapsed_ms: performance.now() - requestedAt });
  }
}
