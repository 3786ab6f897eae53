/** The part of the panel beside the map that edits its grid. */
import { html, nothing, type TemplateResult } from 'lit';
import type { Cell } from '../engine/protocol.js';
import { formatFixed } from '../views/format.js';
import type { GridTool, GridTools } from './grid-tools.js';
import type { Mending } from './mending.js';
import { choice, number, numbersOf, pointForm } from './panel-fields.js';

const TOOLS: readonly (readonly [GridTool, string])[] = [
  ['line', 'Line'],
  ['rectangle', 'Rectangle'],
  ['polygon', 'Polygon'],
  ['crop', 'Crop'],
  ['anchor', 'Anchor'],
];
const CELLS: readonly (readonly [Cell, string, string])[] = [
  ['occupied', 'Occupied', 'A wall or another thing to keep off'],
  ['free', 'Free', 'Where a robot may drive'],
  ['unknown', 'Unknown', 'As if no beam had come there'],
];
const WORDS: Record<GridTool, { ends: string; take: string }> = {
  line: { ends: 'Drag along the line, or tap its two ends, or type their coordinates.', take: 'Paint the line' },
  rectangle: {
    ends: 'Drag over the rectangle, or tap two opposite corners, or type their coordinates.',
    take: 'Paint the rectangle',
  },
  polygon: {
    ends: 'Tap its corners one after the other, drag one to move it, or type their coordinates.',
    take: 'Paint the polygon',
  },
  crop: {
    ends: 'Drag over what is to stay, or tap two opposite corners, or type their coordinates.',
    take: 'Crop to the rectangle',
  },
  anchor: {
    ends: 'Tap places of the map whose coordinates are known, two at least and far apart, and type these (m). The map is turned and shifted to where they fit best; where they do not fit, the step is refused.',
    take: 'Anchor the map',
  },
};
const FIELDS = ['From x', 'y', 'To x', 'y'] as const;
const NAMES = ['From x (m)', 'From y (m)', 'To x (m)', 'To y (m)'] as const;

export function gridPanel(mending: Mending): TemplateResult {
  const { grid, isDone } = mending;
  return html`<section aria-label="Grid">
      ${choice('Tool', TOOLS, grid.tool, (tool) => grid.choose(tool))}
      ${grid.tool === 'crop' || grid.tool === 'anchor' ? nothing : choice('Paint as', CELLS, grid.cells, (cells) => grid.paintAs(cells))}
      <div class="actions">
        <button class="primary" title="Enter" ?disabled=${!isDone || !grid.step} @click=${() => mending.takeOnGrid()}>
          ${WORDS[grid.tool].take}
        </button>
        <button title="Escape" ?disabled=${grid.places.length === 0} @click=${() => grid.clear()}>Clear</button>
      </div>
      <p class="explanation">${WORDS[grid.tool].ends}</p>
      ${grid.tool === 'polygon' ? cornerFields(grid) : grid.tool === 'anchor' ? knownFields(grid) : endFields(grid)}
      ${grid.problem === '' ? nothing : html`<p role="status">${grid.problem}</p>`}
    </section>
    <section aria-label="Turn">
      <h3>Turn the map</h3>
      <p class="explanation">All poses turn with it, so that the exported files fit each other.</p>
      <button ?disabled=${!isDone} @click=${() => mending.rotate(null)}>Rotate to the walls</button>
      <form
        class="fields"
        @submit=${(event: SubmitEvent) => {
          event.preventDefault();
          const [degrees = NaN] = numbersOf(event);
          if (!Number.isNaN(degrees)) mending.rotate((degrees * Math.PI) / 180);
        }}
      >
        ${number('By °', 'Angle (°), counter-clockwise', null)}
        <button ?disabled=${!isDone}>Rotate</button>
      </form>
    </section>
    <section aria-label="Scans left out">
      <h3>Leave scans out</h3>
      <form
        class="fields"
        @submit=${(event: SubmitEvent) => {
          event.preventDefault();
          const [first = NaN, last = NaN] = numbersOf(event);
          mending.leaveOut(first, last);
        }}
      >
        ${number('From scan', 'First scan', null)} ${number('to', 'Last scan', null)}
        <button ?disabled=${!isDone}>Leave out</button>
      </form>
    </section>`;
}

/** Both ends of a line, or two opposite corners. */
function endFields(grid: GridTools): TemplateResult {
  return html`<div class="fields">
    ${FIELDS.map((label, at) => number(label, NAMES[at] ?? '', grid.numbers[at] ?? null, (to) => grid.type(at, to)))}
    ${grid.tool === 'line' ? number('Width', 'Width (m)', grid.width, (width) => grid.widen(width)) : nothing}
  </div>`;
}

/** The next corner of a polygon. */
function cornerFields(grid: GridTools): TemplateResult {
  const count = grid.corners.length;
  return html`${pointForm('Corner', 'Add', (corner) => grid.addCorner(corner))}
    <div class="actions">
      <span role="status">${count === 1 ? '1 corner' : `${count} corners`}</span>
      <button ?disabled=${count === 0} @click=${() => grid.removeCorner()}>Remove the last</button>
    </div>`;
}

/** The known coordinates of each place. */
function knownFields(grid: GridTools): TemplateResult {
  return html`${grid.known.map(
      ({ map, world }, at) =>
        html`<div class="fields known" role="group" aria-label="Place ${at + 1}">
          <span class="number">${at + 1}: ${map.map((value) => formatFixed(value, 2)).join(', ')} m is</span>
          ${(['X', 'Y'] as const).map((name, axis) =>
            number(name, `${name} of place ${at + 1} (m)`, world[axis] ?? null, (to) => grid.typeKnown(at, axis, to)),
          )}
        </div>`,
    )}
    <div class="fields">
      ${number('Standard deviation of a coordinate', 'Standard deviation (m)', grid.accuracy, (to) => grid.trust(to))}
    </div>
    <div class="actions">
      <button ?disabled=${grid.known.length === 0} @click=${() => grid.removeCorner()}>Remove the last</button>
    </div>`;
}
