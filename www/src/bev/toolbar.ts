/** The bar above the two views. */
import { html, nothing, type TemplateResult } from 'lit';
import { typed } from '../components/fields.js';
import { RESET, TRASH } from '../components/panel-icons.js';
import { list } from '../components/list-field.js';
import { iconButton } from '../components/icon-button.js';
import '../components/menu.js';
import type { MenuItem } from '../components/menu.js';
import { type BevDocument, MAX_GRID, markedPixels, type Tool } from './document.js';
import { EXPORTS } from './export.js';
import { hasSample } from './images.js';
import { withoutAny } from './marks.js';
import type { BevPreset, WholePixels } from './protocol.js';

const TOOLS: readonly [Tool, string][] = [
  ['polygon', 'Polygon'],
  ['grid', 'Grid'],
  ['points', 'Points'],
  ['pairs', 'Pairs'],
];
const WHOLE: Record<WholePixels, string> = { exact: 'no', truncated: 'down', rounded: 'to nearest' };
/** What the bar shows beside the document, and what it asks for. */
export interface ToolbarState {
  openItems: MenuItem[];
  canUndo: boolean;
  canRedo: boolean;
  open: (event: CustomEvent<string>) => void;
  export: (event: CustomEvent<string>) => void;
  undo: () => void;
  redo: () => void;
  /** A change of the document. */
  change: (wanted: Partial<BevDocument>, keepsSelection: boolean) => void;
}

/** What is opened, marked, taken back and exported. */
export function toolbar(document: BevDocument, { canUndo, canRedo, ...has }: ToolbarState): TemplateResult {
  const change = (wanted: Partial<BevDocument>) => () => has.change(wanted, false);
  return html`<div class="controls" role="toolbar" aria-label="Bird's-eye view">
    <scanstitch-menu label="Open" icon="open" .items=${has.openItems} @menu-chosen=${has.open}></scanstitch-menu>
    <div class="tools" role="group" aria-label="Tool">
      ${TOOLS.map(
        ([tool, label]) =>
          html`<button aria-pressed=${document.tool === tool} @click=${change({ tool })}>${label}</button>`,
      )}
    </div>
    ${document.tool === 'grid' ? cells(document, has.change) : nothing}
    <div class="group">
      ${iconButton(RESET, 'Undo', has.undo, { hint: 'Undo (Ctrl+Z)', kind: '', isOff: !canUndo })}
      ${iconButton(RESET, 'Redo', has.redo, { hint: 'Redo (Ctrl+Y)', kind: 'mirrored', isOff: !canRedo })}
      ${iconButton(TRASH, 'Remove all marks', change(withoutAny(document)), {
        hint: 'Remove all marks',
        kind: '',
        isOff: markedPixels(document).length === 0,
      })}
    </div>
    <label>Round front pixels ${list(WHOLE, document.whole, (whole) => has.change({ whole }, true))}</label>
    <span class="end">
      <scanstitch-menu label="Export" icon="download" .items=${EXPORTS} @menu-chosen=${has.export}></scanstitch-menu>
    </span>
  </div>`;
}

function cells(document: BevDocument, change: ToolbarState['change']): TemplateResult {
  const set = (name: 'columns' | 'rows', event: Event) => {
    const value = Number(typed(event));
    if (Number.isInteger(value) && value >= 1 && value <= MAX_GRID) change({ [name]: value }, true);
  };
  return html`${(['columns', 'rows'] as const).map(
    (name) =>
      html`<label
        >${name}<input
          type="number"
          min="1"
          max=${MAX_GRID}
          .value=${String(document[name])}
          @change=${(event: Event) => set(name, event)}
      /></label>`,
  )}`;
}

/** What can be opened. */
export function openItems(presets: readonly BevPreset[]): MenuItem[] {
  return [
    { id: 'files', label: 'Files…', detail: 'two views (PNG, JPEG), a scene.json, a table of points (CSV)' },
    ...(hasSample ? [{ id: 'sample', label: 'The sample', detail: 'a rendered pair with exact cameras' }] : []),
    ...presets.map(({ name, label, explanation }) => ({ id: name, label, detail: explanation })),
  ];
}
