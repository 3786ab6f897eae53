import { html, nothing, type TemplateResult } from 'lit';
import type { IterationRecord } from '../engine/protocol.js';
import { formatCount, formatLength, plural } from '../views/format.js';
import { formatAngle, formatStep } from '../views/pose-format.js';
import { numberTable } from '../components/number-table.js';

/** The iterations of a registration in numbers, folded; nothing without any. */
export function iterationTable(records: readonly IterationRecord[]): TemplateResult | typeof nothing {
  if (records.length === 0) return nothing;
  return html`<details>
    <summary>All ${plural(records.length, 'iteration')} in numbers</summary>
    <div class="scroll">
      ${numberTable(
        ['iteration', 'pairs', 'inliers', 'rmse', 'translation', 'rotation'],
        records.map((record, i) => [
          i + 1,
          formatCount(record.num_correspondences),
          formatCount(record.num_inliers),
          formatLength(record.inlier_rmse),
          formatStep(record.translation_step),
          formatAngle(Math.abs(record.rotation_step), 4),
        ]),
      )}
    </div>
  </details>`;
}
