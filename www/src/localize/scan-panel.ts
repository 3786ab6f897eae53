/** What is known of a scan's place, in words and figures. */
import { html, nothing, type TemplateResult } from 'lit';
import { facts } from '../run/facts.js';
import { statusBadge } from '../components/status-badge.js';
import { numberTable } from '../components/number-table.js';
import { baseName, formatFixed, formatLength, formatPercent, plural, sentence } from '../views/format.js';
import { formatAngle } from '../views/pose-format.js';
import type { Status } from '../views/map-painter.js';
import { percent } from './paint.js';
import type { LocatedPose, ScanDetails } from './protocol.js';

/** Rivals that are listed; all are drawn. */
const MOST_LISTED = 12;

const WORDS: Record<Status, string> = { good: 'certain', doubtful: 'undecided', lost: 'no place' };

export const scanBadge = (status: Status): TemplateResult => statusBadge(status, WORDS[status]);

/** `styles`: localizeStyles, statusStyles, tableStyles. */
export function scanPanel({ index, scan }: ScanDetails): TemplateResult {
  const { name, status, reason, place, rivals, elsewhere, agreement, is_known_at_once } = scan;
  return html`<section class="scan" aria-label="Selected scan">
    <header>
      <h2>Scan ${index + 1}</h2>
      <span class="muted name" title=${name}>${baseName(name)}</span>
      ${scanBadge(status)}
    </header>
    <p>${reason ? sentence(reason) : certainWords(is_known_at_once)}</p>
    ${
      place
        ? facts(
            [
              ['Position', positionWords(place)],
              ['Heading', headingWords(place)],
              ['Probability', percent(place.probability)],
              ['Of being elsewhere', percent(elsewhere)],
              ['Beams on walls', formatPercent(agreement)],
            ],
            'number',
          )
        : nothing
    }
    ${rivals.length > 0 ? rivalTable(rivals) : nothing}
  </section>`;
}

function certainWords(isKnownAtOnce: boolean): string {
  return isKnownAtOnce
    ? 'Its place is certain: this scan and those before it tell it.'
    : 'Its place is certain: the scans after it tell it.';
}

/** Every other place that it may have been taken at, the most likely one first. */
function rivalTable(rivals: readonly LocatedPose[]): TemplateResult {
  const rest = rivals.length - MOST_LISTED;
  return html`<h3>${plural(rivals.length, 'other place')}</h3>
    ${numberTable(
      ['x (m)', 'y (m)', 'heading', 'probability'],
      rivals
        .slice(0, MOST_LISTED)
        .map(({ T_world_sensor: { x, y, theta }, probability }) => [
          formatFixed(x, 2),
          formatFixed(y, 2),
          formatAngle(theta, 0),
          percent(probability),
        ]),
      'Other places',
    )}
    ${rest > 0 ? html`<p class="muted">and ${rest} less likely ones</p>` : nothing}`;
}

/** One standard deviation along the axis in which it is less certain. */
function positionWords({ T_world_sensor: { x, y }, covariance }: LocatedPose): string {
  const [xx = 0, xy = 0, , , yy = 0] = covariance;
  const largest = (xx + yy) / 2 + Math.hypot((xx - yy) / 2, xy);
  return `${formatFixed(x, 2)}, ${formatFixed(y, 2)} m ± ${formatLength(Math.sqrt(Math.max(largest, 0)))}`;
}

function headingWords({ T_world_sensor: { theta }, covariance }: LocatedPose): string {
  return `${formatAngle(theta, 1)} ± ${formatAngle(Math.sqrt(Math.max(covariance[8] ?? 0, 0)), 1)}`;
}

/** The map and the selected scan, for those who do not see them. */
export function mapWords(mapName: string, size: readonly [number, number], details: ScanDetails | null): string {
  const map = `${mapName}, ${formatFixed(size[0], 0)} by ${formatFixed(size[1], 0)} metres.`;
  if (!details) return map;
  const { index, scan } = details;
  const where = scan.place ? ` at ${positionWords(scan.place)}, heading ${headingWords(scan.place)}` : '';
  const others = scan.rivals.length > 0 ? `, ${plural(scan.rivals.length, 'other place')}` : '';
  return `${map} Scan ${index + 1}: ${WORDS[scan.status]}${where}${others}.`;
}
