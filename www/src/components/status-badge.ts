import { html, type TemplateResult } from 'lit';
import type { Status } from '../views/map-painter.js';
import { icon } from './icons.js';

/** Needs `statusStyles`. */
export function statusBadge(status: Status): TemplateResult {
  return html`<span class="status ${status}">${icon(status, 13)}${status}</span>`;
}
