import { html, type TemplateResult } from 'lit';
import type { Status } from '../views/map-painter.js';
import { icon } from './icons.js';
import { STATUS_ICONS } from './panel-icons.js';

/** A sign and a word; `size`: of the sign. Needs `statusStyles`. */
export function statusBadge(status: Status, words: string = status, size = 13): TemplateResult {
  return html`<span class="status ${status}">${icon(STATUS_ICONS[status], size)}${words}</span>`;
}
