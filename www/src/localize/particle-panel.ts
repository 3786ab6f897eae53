/** What a particle filter says beside the exact search, and what is chosen by hand. */
import { html, nothing, type TemplateResult } from 'lit';
import { typed } from '../components/fields.js';
import { type Choices, list } from '../components/list-field.js';
import { numberTable } from '../components/number-table.js';
import { facts } from '../run/facts.js';
import { CHART_VIEW_BOX, lineChart } from '../views/chart.js';
import { formatCount, formatFixed } from '../views/format.js';
import { formatAngle } from '../views/pose-format.js';
import { percent } from './paint.js';
import { type Particles, weightNear } from './particles.js';
import type { ParticleOptions, ScanDetails } from './protocol.js';

/** Particles within this distance of a place stand for it (m). */
const NEAR = 1;
/** Places that are compared. */
const MOST_PLACES = 6;

type NumberOption = Exclude<keyof ParticleOptions, 'resample_below'>;

interface NumberField {
  label: string;
  min: number;
  max: number;
  step: number | 'any';
  hint: string;
}

const FIELDS: Record<NumberOption, NumberField> = {
  num_particles: { label: 'Particles', min: 1, max: 100_000, step: 1, hint: 'Number of particles' },
  seed: { label: 'Seed', min: 0, max: 4_294_967_295, step: 1, hint: 'Another seed draws other random numbers' },
  num_beams: { label: 'Beams', min: 1, max: 2000, step: 1, hint: 'Most beams of a scan that weigh the particles' },
  return_sigma: {
    label: 'Spread of a return (m)',
    min: 0,
    max: 10,
    step: 'any',
    hint: 'Standard deviation of a return from a wall: the larger, the broader the maxima of the likelihood',
  },
  independent: {
    label: 'Independence of beams',
    min: 0.01,
    max: 1,
    step: 'any',
    hint: 'Exponent of the likelihood: 1 as if no beam told what its neighbour tells',
  },
  motion_noise: {
    label: 'Motion noise, factor',
    min: 0,
    max: 100,
    step: 'any',
    hint: 'Factor on the standard deviation of the motion between two scans',
  },
  random_share: {
    label: 'Put anywhere, share',
    min: 0,
    max: 1,
    step: 'any',
    hint: 'Share of the particles that are put anywhere at each drawing: recovers a kidnapped robot',
  },
};

const DRAWING: Choices<number> = [
  [1, 'after each scan'],
  [0.5, 'below half effective'],
  [0, 'never'],
];

/** `choose`: takes other options. `styles`: localizeStyles, figureStyles. */
export function particlePanel(
  { state, effective }: Particles,
  details: ScanDetails | null,
  choose: (options: Partial<ParticleOptions>) => void,
): TemplateResult {
  const isThere = state !== null && details !== null && state.scan === details.index;
  const number = state && effective[state.scan];
  const words = number
    ? `${formatCount(number)} of ${formatCount(state.values.length / 4)}, scan ${state.scan + 1}`
    : '…';
  return html`<section class="particles" aria-label="Monte Carlo">
    <h2>Monte Carlo</h2>
    <p class="muted">
      A particle filter as it is taught, on the same scans and motions: particles are drawn by their weight, moved with
      noise and weighed by the likelihood of the beams. On the map, the darker the more weight.
    </p>
    ${facts([['Effective particles', words, 'So many of equal weight would say as much']], 'number')}
    ${isThere ? placeTable(state.values, details) : nothing}
    ${
      effective.length > 1
        ? html`<svg class="chart" viewBox=${CHART_VIEW_BOX} role="img" aria-label="Effective particles after each scan">
            ${lineChart({
              values: Array.from(effective, (number) => number ?? 0),
              format: formatCount,
              step: 'scan',
              first: 1,
              color: 'var(--accent)',
              scale: 'linear',
            })}
          </svg>`
        : nothing
    }
    ${state ? form(state.options, choose) : nothing}
  </section>`;
}

function form(options: ParticleOptions, choose: (options: Partial<ParticleOptions>) => void): TemplateResult {
  return html`<form @submit=${(event: Event) => event.preventDefault()}>
    ${(Object.keys(FIELDS) as NumberOption[]).map((name) => field(name, options, choose))}
    <label>Drawn anew ${list(DRAWING, options.resample_below, (resample_below) => choose({ resample_below }))}</label>
  </form>`;
}

function field(
  name: NumberOption,
  options: ParticleOptions,
  choose: (options: Partial<ParticleOptions>) => void,
): TemplateResult {
  const { label, min, max, step, hint } = FIELDS[name];
  const onChange = (event: Event): void => {
    const value = Number(typed(event));
    const isRight = (event.target as HTMLInputElement).checkValidity() && Number.isFinite(value);
    if (isRight && typed(event) !== '') choose({ [name]: value });
  };
  return html`<label title=${hint}
    >${label}
    <input
      type="number"
      name=${name}
      min=${min}
      max=${max}
      step=${step}
      required
      .value=${String(options[name])}
      @change=${onChange}
  /></label>`;
}

/** Each place of the exact search with its probability, and the weight of the particles near it. */
function placeTable(values: Float32Array, { scan: { place, rivals, elsewhere } }: ScanDetails): TemplateResult {
  const places = [...(place ? [place] : []), ...rivals].slice(0, MOST_PLACES);
  const weights = places.map(({ T_world_sensor }) => weightNear(values, T_world_sensor, NEAR));
  // Places may lie nearer to each other than that.
  const rest = Math.max(1 - weights.reduce((sum, weight) => sum + weight, 0), 0);
  const rows = places.map(({ T_world_sensor: { x, y, theta }, probability }, i) => [
    `${formatFixed(x, 1)}, ${formatFixed(y, 1)} m, ${formatAngle(theta, 0)}`,
    percent(probability),
    percent(weights[i] ?? 0),
  ]);
  return html`${numberTable(['place', 'exact', 'particles'], [...rows, ['elsewhere', percent(elsewhere), percent(rest)]], 'Exact and by particles')}
    <p class="muted">Particles: weight within ${NEAR} m of the place.</p>`;
}
