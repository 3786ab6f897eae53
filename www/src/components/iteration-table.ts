import { html, nothing, type TemplateResult } from 'lit';
import type { IterationRecord } from '../engine/protocol.js';
import { formatAngle, formatCount, formatLength, formatStep, plural } from '../views/format.js';

/** The iterations of a registration in numbers, folded; nothing without any. */
export function iterationTable(records: readonly IterationRecord[]): TemplateResult | typeof nothing {
  if (records.length === 0) return nothing;
  return html`<details>
    <summary>All ${plural(records.length, 'iteration')} in numbers</summary>
    <div class="scroll">
      <table class="number iterations">
        <thead>
          <tr>
            <th scope="col">iteration</th>
            <th scope="col">pairs</th>
            <th scope="col">inliers</th>
            <th scope="col">rmse</th>
            <th scope="col">translation</th>
            <th scope="col">rotation</th>
          </tr>
        </thead>
        <tbody>
          ${records.map(
            (record, i) =>
              html`<tr>
                <th scope="row">${i + 1}</th>
                <td>${formatCount(record.num_correspondences)}</td>
                <td>${formatCount(record.num_inliers)}</td>
                <td>${formatLength(record.inlier_rmse)}</td>
                <td>${formatStep(record.translation_step)}</td>
                <td>${formatAngle(Math.abs(record.rotation_step), 4)}</td>
              </tr>`,
          )}
        </tbody>
      </table>
    </div>
  </details>`;
}
