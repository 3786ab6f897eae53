// @ts-check
/**
 * The custom elements manifest (schema 1.0.0), which editors and frameworks read: made from the types of the element, so that what is
 * said of an attribute stands in one place.
 */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { ROOT } from './steps.mjs';

const SLOTS = {
  title: 'Takes the place of the name in the header.',
  side: 'Stands beside the map, or below it where there is little room.',
};
const PARTS = ['header', 'figures', 'map', 'settings', 'details', 'table', 'side'];
const COLORS = ['background', 'surface', 'line', 'text', 'muted', 'accent', 'on-accent', 'radius', 'font'];
/** Of attributes that are not empty or off where they are absent. */
const DEFAULTS = new Map([
  ['view', "'map'"],
  ['theme', "'auto'"],
  ['controls', "'full'"],
]);

/** @typedef {{ name: string, signature: string, description: string, isReadonly: boolean }} Member */

/**
 * The members of an interface, with the comments above them.
 * @param {string} source
 * @param {string} name
 * @returns {Member[]}
 */
function membersOf(source, name) {
  const body = new RegExp(`interface ${name} [^{]*\\{([^]*?)\\n\\}`).exec(source)?.[1] ?? '';
  const member = /(?:\/\*\*([^]*?)\*\/\s*)?^ {2}(readonly )?'?([\w-]+)'?([:(][^]*?);$/gm;
  return [...body.matchAll(member)].map(([, comment = '', readonly, word = '', signature = '']) => {
    const description = comment.replace(/\s*\n\s*\* ?|\s+/g, ' ').trim();
    return { name: word, signature, description, isReadonly: readonly !== undefined };
  });
}

/** @param {string} text */
const typed = (text) => ({ text: text.trim() });

/** @param {Member} member */
function memberOf({ name, signature, description, isReadonly }) {
  const method = /^\((?:(\w+): (.*))?\): (.*)$/.exec(signature);
  if (!method) return { kind: 'field', name, readonly: isReadonly, type: typed(signature.slice(1)), description };
  const [, parameter, type = '', returned = ''] = method;
  const parameters = parameter === undefined ? [] : [{ name: parameter, type: typed(type) }];
  return { kind: 'method', name, parameters, return: { type: typed(returned) }, description };
}

/** The manifest as JSON. */
export function manifest() {
  const source = readFileSync(join(ROOT, 'package', 'element.ts'), 'utf8');
  const attributes = membersOf(source, 'ScanstitchAttributes').map(({ name: fieldName, signature, description }) => {
    const type = typed(signature.slice(1));
    const initial = DEFAULTS.get(fieldName) ?? (type.text.startsWith('boolean') ? 'false' : "''");
    const name = fieldName.replace(/[A-Z]/g, (letter) => `-${letter.toLowerCase()}`);
    return { name, fieldName, type, default: initial, description };
  });
  const fields = attributes.map(({ name, fieldName, type, default: initial }) => {
    return { kind: 'field', name: fieldName, attribute: name, reflects: true, type, default: initial };
  });
  const events = membersOf(source, 'ScanstitchEvents').map(({ name, description }) => {
    return { name, type: typed(`CustomEvent<ScanstitchEvents['${name}']>`), description };
  });
  const path = 'www/dist/module/scanstitch-app.js';
  const declaration = {
    kind: 'class',
    customElement: true,
    name: 'ScanstitchApp',
    tagName: 'scanstitch-app',
    description:
      'Drop laser scans or depth images on it: it shows the path of the sensor and the stitched map, computed in the tab.',
    superclass: { name: 'HTMLElement' },
    attributes,
    members: [...fields, ...membersOf(source, 'ScanstitchElement').map(memberOf)],
    events,
    slots: Object.entries(SLOTS).map(([name, description]) => ({ name, description })),
    cssParts: PARTS.map((name) => ({ name })),
    cssProperties: COLORS.map((name) => ({ name: `--scanstitch-${name}` })),
  };
  const exported = {
    kind: 'custom-element-definition',
    name: 'scanstitch-app',
    declaration: { name: 'ScanstitchApp' },
  };
  const module = { kind: 'javascript-module', path, declarations: [declaration], exports: [exported] };
  return `${JSON.stringify({ schemaVersion: '1.0.0', modules: [module] }, null, 2)}\n`;
}
