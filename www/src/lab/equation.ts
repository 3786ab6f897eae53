/** The equation that a step solves, with the values that it has at this iteration. */
import { html, nothing, type TemplateResult } from 'lit';
import { formatAngle, formatStep } from '../views/pose-format.js';
import { isTurn } from './grids.js';
import type { CloudMetric, LabIteration } from './protocol.js';
import { formatNumber } from './words.js';

/** Names of the unknowns, in the order of H. */
export const unknowns = (n: number): readonly string[] =>
  n === 3 ? ['θ', 'x', 'y'] : ['ωx', 'ωy', 'ωz', 'x', 'y', 'z'];

const RESIDUALS: Record<CloudMetric, TemplateResult> = {
  point_to_point: html`<var>r</var><sub>i</sub> = ‖exp(<var>x</var>) <var>T p</var><sub>i</sub> − <var>q</var
    ><sub>i</sub>‖`,
  point_to_line: html`<var>r</var><sub>i</sub> = <var>n</var><sub>i</sub> · (exp(<var>x</var>) <var>T p</var
    ><sub>i</sub> − <var>q</var><sub>i</sub>)`,
  point_to_plane: html`<var>r</var><sub>i</sub> = <var>n</var><sub>i</sub> · (exp(<var>x</var>) <var>T p</var
    ><sub>i</sub> − <var>q</var><sub>i</sub>)`,
  gicp: html`<var>r</var><sub>i</sub>² = <var>d</var><sub>i</sub>ᵀ (<var>C</var><sub>q</sub> + <var>R C</var
    ><sub>p</sub> <var>R</var>ᵀ)⁻¹ <var>d</var><sub>i</sub>, <var>d</var><sub>i</sub> = exp(<var>x</var>) <var>T p</var
    ><sub>i</sub> − <var>q</var><sub>i</sub>`,
  vgicp: html`<var>r</var><sub>i</sub>² = <var>d</var><sub>i</sub>ᵀ (<var>C</var><sub>q</sub> + <var>R C</var
    ><sub>p</sub> <var>R</var>ᵀ)⁻¹ <var>d</var><sub>i</sub>, over the voxel of each point`,
};

/** `styles`: sideStyles. */
export function equation(iteration: LabIteration, metric: CloudMetric): TemplateResult {
  const { H, b, x } = iteration;
  const n = b.length;
  const names = unknowns(n);
  const isClosed = metric === 'point_to_point';
  return html`<div class="equation">
    <p class="formula">
      min<sub>x</sub> Σ <var>w</var><sub>i</sub> <var>r</var><sub>i</sub>², &ensp; ${RESIDUALS[metric]}
    </p>
    <p class="formula">
      <var>H x</var> = −<var>b</var>, &ensp; <var>H</var> = Σ <var>w J</var>ᵀ<var>J</var>, &ensp; <var>b</var> = Σ
      <var>w J</var>ᵀ<var>r</var>
    </p>
    <div class="system ${n === 6 ? 'large' : ''}" role="group" aria-label="Normal equations with their values">
      ${matrix('H', H, n, names)}
      ${
        n === 3
          ? html`<span class="sign">·</span> ${matrix('x', x ?? [], 1, names)} <span class="sign">= −</span>`
          : html`<span class="sign"><var>x</var> = −</span>`
      }
      ${matrix('b', b, 1, names)}
    </div>
    <p class="solution number">
      ${
        x
          ? html`<var>x</var> =
              (${x.map((value, i) => (isTurn(i, n === 3) ? formatAngle(value, 3) : formatStep(value))).join(', ')})`
          : 'These pairs do not determine a step.'
      }
    </p>
    ${
      isClosed
        ? html`<p class="explanation">
            Between points the step has a closed form: <var>R</var> from the SVD of Σ <var>w</var> (<var>q</var> −
            <var>q̄</var>)(<var>p</var> − <var>p̄</var>)ᵀ, then <var>t</var> = <var>q̄</var> − <var>R p̄</var> (Umeyama
            1991). It is the <var>x</var> shown; the linear equation gives nearly the same.
          </p>`
        : nothing
    }
  </div>`;
}

function matrix(name: string, values: readonly number[], columns: number, names: readonly string[]): TemplateResult {
  const rows = values.length / columns;
  return html`<table class="matrix number" aria-label=${name}>
    <caption>
      <var>${name}</var>
    </caption>
    <tbody>
      ${Array.from(
        { length: rows },
        (_, row) =>
          html`<tr>
            ${columns === 1 && name === 'x' ? html`<th scope="row">${names[row]}</th>` : nothing}
            ${Array.from({ length: columns }, (_, column) => html`<td>${formatNumber(values[row * columns + column] ?? 0)}</td>`)}
          </tr>`,
      )}
    </tbody>
  </table>`;
}
