/** The panels around the map of laser scans: loaded with the first one that is unfolded. */
import { html, type TemplateResult } from 'lit';
import '../run/panels.js';
import type { FrameResult, IterationRecord, Snapshot } from '../engine/protocol.js';
import { frameColumns } from '../views/frame-columns.js';
import { frameRows } from '../views/frame-rows.js';
import { type LongestPairs, longestPairs, type ShownPairs } from '../views/longest-pairs.js';
import { memoizeLast } from '../views/memoize-last.js';
import type { Rgb } from '../views/palette.js';

/** What is shown of the selected scan. */
interface SelectedScan {
  selected: number;
  history: readonly IterationRecord[];
  pairsShown: ShownPairs;
  longest: LongestPairs | null;
  isRemovable: boolean;
}

interface ScanActions {
  showPairs(which: ShownPairs): void;
  remove(name: string): void;
}

// The same empty lists every time: a new one would be a change.
const NO_FRAMES: readonly FrameResult[] = [];
const NO_NUMBERS: readonly number[] = [];
const NO_WORDS: readonly string[] = [];
const NO_ROUNDS: readonly IterationRecord[] = [];

export class PlanarPanels {
  private rowsOf = memoizeLast(frameRows);
  private columnsOf = memoizeLast(frameColumns);
  readonly longestOf = memoizeLast(longestPairs);

  table(snapshot: Snapshot | null, colors: readonly Rgb[], selected: number | null): TemplateResult {
    const { frames, ms, errors, referenceName } = factsOf(snapshot);
    return html`<scanstitch-frame-table
      part="table"
      .rows=${this.rowsOf(frames, ms, errors)}
      .columns=${this.columnsOf(referenceName)}
      .colors=${colors}
      .selected=${selected}
    ></scanstitch-frame-table>`;
  }

  /** Of all scans, while none is selected. */
  overview(snapshot: Snapshot | null, colors: readonly Rgb[], explainWorst: () => void): TemplateResult {
    const { frames, errors, referenceName } = factsOf(snapshot);
    return html`<scanstitch-overview
      .frames=${frames}
      .joint_history=${snapshot?.result.joint_history ?? NO_ROUNDS}
      .notes=${snapshot?.result.notes ?? NO_WORDS}
      .errors=${errors}
      .referenceName=${referenceName}
      .colors=${colors}
      @why-wanted=${explainWorst}
    ></scanstitch-overview>`;
  }

  /** Of the selected scan; its code is loaded with the first one that is selected. */
  why(
    snapshot: Snapshot | null,
    colors: readonly Rgb[],
    { selected, history, pairsShown, longest, isRemovable }: SelectedScan,
    { showPairs, remove }: ScanActions,
  ): TemplateResult {
    void import('../run/why-panel.js');
    const { frames, ms, errors, referenceName } = factsOf(snapshot);
    return html`<scanstitch-why
      .frames=${frames}
      .index=${selected}
      .history=${history}
      .ms=${ms}
      .errors=${errors}
      .referenceName=${referenceName}
      .colors=${colors}
      ?removable=${isRemovable}
      .pairsShown=${pairsShown}
      .longest=${longest}
      @pairs-wanted=${({ detail }: CustomEvent<ShownPairs>) => showPairs(detail)}
      @scan-removed=${({ detail }: CustomEvent<string>) => remove(detail)}
    ></scanstitch-why>`;
  }
}

function factsOf(snapshot: Snapshot | null) {
  const comparison = snapshot?.result.comparison;
  return {
    frames: snapshot?.result.frames ?? NO_FRAMES,
    ms: snapshot?.timing.frames ?? NO_NUMBERS,
    errors: comparison?.errors ?? NO_NUMBERS,
    referenceName: comparison?.name ?? '',
  };
}
