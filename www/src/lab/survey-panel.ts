/** What landscape and basin have in common: the unknowns, how far they go, and a place on the figure that can be started from. */
import { css, html, LitElement, type TemplateResult } from 'lit';
import { property, query, state } from 'lit/decorators.js';
import { type Choices, list } from '../components/list-field.js';
import '../drawing/figure-view.js';
import type { ScanstitchFigure } from '../drawing/figure-view.js';
import { column, row, shared } from '../components/theme.js';
import { formatLength } from '../views/format.js';
import { formatAngle } from '../views/pose-format.js';
import { makeColors } from '../views/figure-colors.js';
import { memoizeLast } from '../views/memoize-last.js';
import { unknowns } from './equation.js';
import { isTurn, nodeAt, offsetsOf, offsetsOfNode, poseAtOffsets } from './grids.js';
import { labStyles } from './lab-styles.js';
import { sideStyles } from './side-styles.js';
import { type LandscapeMarks, offsetsAt } from './landscape.js';
import type { Grid, LabFacts, Pose } from './protocol.js';
import type { LabRun } from './runs.js';
import type { LabSession } from './session.js';
import type { SurveyOf } from './survey.js';
import { surveyStride } from './thinning.js';
import { lastPose, numPoses, poseAt } from './trace.js';

const RANGES: Choices<number> = [0.25, 0.5, 1, 2, 4].map((times) => [times, `× ${times}`]);
/** Smallest half widths of a survey around the result (rad, m): 20 degrees, and the largest distance of pairs. */
const LEAST_TURN = Math.PI / 9;
const LEAST_REACH = 0.5;

export interface Survey {
  run(of: SurveyOf): Promise<void>;
  stop(): void;
}

export abstract class SurveyPanel<S extends Survey & { result: { grid: Grid } | null }> extends LitElement {
  @property({ attribute: false }) session!: LabSession;
  @property({ attribute: false }) survey!: S;
  @property({ type: Boolean }) dark = false;
  /** Changes whenever there is something new to draw. */
  @property({ attribute: false }) tick: unknown = null;
  /** The two unknowns of the figure, by their indices; null: the default ones. */
  @state() protected chosen: readonly [number, number] | null = null;
  @state() protected range = 1;
  /** The node that the pointer or the keyboard is at. */
  @state() protected node: readonly number[] | null = null;
  @query('scanstitch-figure') protected figure!: ScanstitchFigure;

  protected colorsOf = memoizeLast(makeColors);
  protected marksOf = memoizeLast((_pose: Pose, _trace: unknown, facts: LabFacts, grid: Grid) =>
    this.marks(facts, grid),
  );
  private madeOf: readonly unknown[] = [];

  protected abstract readonly isBasin: boolean;
  /** All unknowns of the grid: those of the figure first. */
  protected abstract allAxes(facts: LabFacts): readonly number[];
  protected abstract renderResult(facts: LabFacts): TemplateResult;

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.tellGhost(null);
  }

  protected axes({ is_planar }: LabFacts): readonly [number, number] {
    return this.chosen ?? (is_planar ? [1, 2] : [3, 4]);
  }

  protected override updated(): void {
    const { run, client, facts, generation } = this.session;
    if (!run?.trace || !client || !facts) return;
    const madeOf = [run.id, run.options, generation, client, this.range, ...this.allAxes(facts)];
    if (madeOf.every((part, i) => part === this.madeOf[i])) return;
    this.madeOf = madeOf;
    this.node = null;
    // Another start of the same method leads home by another way: the same landscape, around the same pose.
    const reference = lastPose(run.trace);
    const axes = this.allAxes(facts);
    const widths = this.halfWidths(facts, reference, run);
    const half_widths = axes.map((axis) => widths[axis] ?? 1);
    const stride = surveyStride(facts);
    const grid = { T_center: reference, axes, half_widths, stride };
    void this.survey.run({ client, method: run.id, grid, reference });
  }

  /** Of all unknowns. */
  private halfWidths({ is_planar }: LabFacts, reference: Pose, { trace, options }: LabRun): number[] {
    const away = Array.from({ length: numPoses(trace) }, (_, i) => offsetsOf(reference, poseAt(trace, i), is_planar));
    const largest = (turns: boolean): number =>
      Math.max(...away.flatMap((offsets) => offsets.filter((_, i) => isTurn(i, is_planar) === turns).map(Math.abs)));
    const reach = this.isBasin ? 3 * LEAST_REACH : Math.max(LEAST_REACH, options.max_correspondence_distance ?? 0);
    const turn = Math.min(Math.max(1.25 * largest(true), (this.isBasin ? 2 : 1) * LEAST_TURN) * this.range, Math.PI);
    const shift = Math.max(1.25 * largest(false), reach) * this.range;
    return Array.from({ length: is_planar ? 3 : 6 }, (_, i) => (isTurn(i, is_planar) ? turn : shift));
  }

  protected override render(): TemplateResult {
    const { facts, trace } = this.session;
    if (!facts || !trace) return html`<p class="muted">Nothing is registered yet.</p>`;
    return html`${this.renderResult(facts)}`;
  }

  protected renderChoices(facts: LabFacts): TemplateResult {
    const { is_planar } = facts;
    const axes = this.axes(facts);
    const names: Choices<number> = unknowns(is_planar ? 3 : 6).map((name, i) => [i, name]);
    const choose = (which: 0 | 1, axis: number): void => {
      const other = axes[which === 0 ? 1 : 0];
      // The same unknown twice: they change places.
      const rest = other === axis ? axes[which] : other;
      this.chosen = which === 0 ? [axis, rest] : [rest, axis];
    };
    return html`<div class="row field">
      <label class="choice">Across ${list(names, axes[0], (axis) => choose(0, axis))}</label>
      <label class="choice">Up ${list(names, axes[1], (axis) => choose(1, axis))}</label>
      <label class="choice">Range ${list(RANGES, this.range, (range) => (this.range = range))}</label>
    </div>`;
  }

  /** Path, present place and names, for the figure's painters. */
  private marks(facts: LabFacts, { T_center, axes }: Grid): LandscapeMarks {
    const { trace, pose } = this.session;
    const { is_planar } = facts;
    const inAxes = (T: Pose): [number, number] => {
      const offsets = offsetsOf(T_center, T, is_planar);
      return [offsets[axes[0] ?? 0] ?? 0, offsets[axes[1] ?? 1] ?? 0];
    };
    const named = (axis: number): string => {
      const name = unknowns(is_planar ? 3 : 6)[axis];
      return `${name} (${isTurn(axis, is_planar) ? '°' : 'm'})`;
    };
    return {
      path: Array.from({ length: numPoses(trace) }, (_, i) => inAxes(poseAt(trace, i))),
      current: inAxes(pose),
      names: [named(axes[0] ?? 0), named(axes[1] ?? 1)],
      turns: [isTurn(axes[0] ?? 0, is_planar), isTurn(axes[1] ?? 1, is_planar)],
    };
  }

  // A place on the figure.

  protected onPointer = ({ detail }: CustomEvent<{ x: number; y: number } | null>): void => {
    const grid = this.survey.result?.grid;
    const offsets = detail && grid ? offsetsAt(grid, this.figure.size, detail) : null;
    this.node = offsets && grid ? this.withLayer(nodeAt({ ...grid, size: grid.size.slice(0, 2) }, offsets)) : null;
    this.onNode();
  };

  /** Arrow keys go from node to node, Enter starts there. */
  protected onKey = (event: KeyboardEvent): void => {
    const grid = this.survey.result?.grid;
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (event.key === 'Enter') this.startHere();
    if (!grid || !step) return;
    event.preventDefault();
    const [columns = 1, rows = 1] = grid.size;
    const [column = columns >> 1, row = rows >> 1] = this.node ?? [];
    const reach = event.shiftKey ? 10 : 1;
    const clamp = (value: number, count: number): number => Math.min(Math.max(value, 0), count - 1);
    this.node = this.withLayer([
      clamp(column + reach * (step[0] ?? 0), columns),
      clamp(row + reach * (step[1] ?? 0), rows),
    ]);
    this.onNode();
  };

  /** The node with the third unknown that the figure shows. */
  protected withLayer(node: readonly number[] | null): readonly number[] | null {
    return node;
  }

  protected onNode(): void {
    // A subclass may show more of it.
  }

  protected nodePose(facts: LabFacts): Pose | null {
    const grid = this.survey.result?.grid;
    return grid && this.node ? poseAtOffsets(grid, offsetsOfNode(grid, this.node), facts.is_planar) : null;
  }

  protected nodeWords({ is_planar }: LabFacts): string {
    const grid = this.survey.result?.grid;
    if (!grid || !this.node) return '';
    const names = unknowns(is_planar ? 3 : 6);
    return offsetsOfNode(grid, this.node)
      .map((offset, i) => {
        const axis = grid.axes[i] ?? 0;
        return `${names[axis]} ${isTurn(axis, is_planar) ? formatAngle(offset, 1) : formatLength(offset)}`;
      })
      .join(', ');
  }

  /** All methods run from the place that is pointed at. */
  protected startHere = (): void => {
    const { facts } = this.session;
    const T = facts && this.nodePose(facts);
    if (T) void this.session.startFrom(T);
  };

  /** A pose to be drawn on the stage; null removes it. */
  protected tellGhost(T: Pose | null): void {
    this.dispatchEvent(new CustomEvent('ghost-shown', { detail: T, bubbles: true, composed: true }));
  }

  static override styles = [
    shared,
    labStyles,
    sideStyles,
    css`
      :host {
        ${column};
        gap: 10px;
        padding: 12px 16px 24px;
      }
      .choice {
        display: inline-flex;
        align-items: center;
        gap: 6px;
      }
      .readout {
        min-height: 21px;
      }
      .costs {
        ${row};
        gap: 6px;
        font-size: calc(12.5 * var(--px));
        white-space: nowrap;
      }
      .costs i {
        flex: 0 1 110px;
        height: 8px;
        border-radius: 4px;
      }
      .minima {
        display: grid;
        gap: 2px;
      }
      .minima li {
        ${row};
        gap: 8px;
      }
      .minima button {
        min-height: 26px;
        padding: 0 6px;
      }
      .minima i {
        flex: none;
        width: 11px;
        height: 11px;
        border-radius: 3px;
      }
      .big {
        font-size: calc(24 * var(--px));
        font-weight: 650;
      }
      progress {
        width: 100%;
      }
    `,
  ];
}
