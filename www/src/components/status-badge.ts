import { html, type TemplateResult } from 'lit';
import type { Status } from '../views/map-painter.ts';
import { icon } from './icons.ts';

/** Needs `status_styles`. */
export function statusBadge(status: Status): TemplateResult {
  return html`<span class="status ${status}">${icon(status, 13)}${status}</span>`;
}
