/** Somebody's own ICP beside the engine's: where they part, and why. */
import { html, nothing, type TemplateResult } from 'lit';
import { numberTable } from '../components/number-table.js';
import { plural } from '../views/format.js';
import { formatAngle, formatStep } from '../views/pose-format.js';
import type { OwnIcpComparison } from '../../../package/lab/own_icp.js';

const KINDS: Record<string, string> = {
  input: 'The poses',
  pairs: 'The pairs',
  weights: 'The weights',
  solution: 'The solution',
};

/** `seek`: looks at the iteration. `styles`: sideStyles. */
export function ownPanel(
  { steps, parts_at, fault, num_ours }: OwnIcpComparison,
  seek: (at: number) => void,
): TemplateResult {
  const largest = Math.max(0, ...steps.map(({ translation }) => translation));
  return html`
    <header><h2>Your ICP beside ours</h2></header>
    <p>
      ${
        parts_at === null
          ? html`<strong>All ${plural(steps.length, 'step')} agree</strong>, to ${formatStep(largest)}.`
          : html`<strong>They diverge at iteration ${parts_at + 1}.</strong>
              ${parts_at > 0 ? `The ${plural(parts_at, 'step')} before agree.` : nothing}
              <button class="link" @click=${() => seek(parts_at)}>Look at it</button>`
      }
    </p>
    ${
      steps.length === num_ours
        ? nothing
        : html`<p>
            Your file has ${plural(steps.length, 'iteration')}, our run ${num_ours} from the same start. This is not an
            error: each run stops at its own convergence limits.
          </p>`
    }
    ${fault ? html`<p class="fault"><strong>${KINDS[fault.kind] ?? 'The step'}.</strong> ${fault.text}</p>` : nothing}
    <details>
      <summary>Every step: how far yours ends from ours</summary>
      <div class="scroll">
        ${numberTable(
          ['iteration', 'moved', 'turned'],
          steps.map(({ translation, rotation }, i) => [i + 1, formatStep(translation), formatAngle(rotation, 4)]),
        )}
      </div>
    </details>
    <p class="explanation">
      Our next step is computed from each of your poses, with the pairs and weights of the selected method. The stage
      shows your poses with our pairs. Coordinates are read with the precision that the file declares: if it declares
      floats and your program reads its text as doubles, the steps agree to about a ten-millionth of the points'
      distance.
    </p>
  `;
}
