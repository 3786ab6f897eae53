// @ts-check
/**
 * The bill of materials of the page: every package of npm and of crates.io that is part of it, with version, licence and
 * where it comes from.
 *
 * Source of the form: CycloneDX 1.5, JSON.
 */
import { execFileSync } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { ROOT } from './steps.mjs';

/** @typedef {{ type: 'library', name: string, version: string, purl: string, licenses: { expression: string }[] }} Component */

/** @param {'npm' | 'cargo'} registry @param {string} name @param {string} version @param {string | null | undefined} license @returns {Component} */
function component(registry, name, version, license) {
  const purl = `pkg:${registry}/${name.replace('@', '%40')}@${version}`;
  return {
    type: 'library',
    name,
    version,
    purl,
    licenses: license ? [{ expression: license.replaceAll('/', ' OR ') }] : [],
  };
}

/** What is bundled: everything but what only builds and tests it. */
function npmComponents() {
  const { packages } = JSON.parse(readFileSync(join(ROOT, 'package-lock.json'), 'utf8'));
  const { dependencies } = JSON.parse(readFileSync(join(ROOT, 'package.json'), 'utf8'));
  // The page's own libraries stand among the tools: the package of the command line needs none of them.
  const waiting = [...Object.keys(dependencies), 'lit', 'three', 'd3-dsv', 'd3-scale'];
  /** @type {Map<string, Component>} */
  const found = new Map();
  for (let name = waiting.pop(); name !== undefined; name = waiting.pop()) {
    const entry = packages[`node_modules/${name}`];
    if (!entry || found.has(name)) continue;
    found.set(name, component('npm', name, entry.version, entry.license));
    waiting.push(...Object.keys(entry.dependencies ?? {}));
  }
  return [...found.values()];
}

/** The packages of the engine's parts. */
const OWN_PACKAGES = ['scanstitch', 'scanstitch-formats'];

/** What is compiled into the WebAssembly modules. */
function cargoComponents() {
  const args = ['metadata', '--format-version', '1', '--locked', '--filter-platform', 'wasm32-unknown-unknown'];
  const metadata = JSON.parse(
    execFileSync('cargo', args, {
      cwd: ROOT,
      encoding: 'utf8',
      maxBuffer: 2 ** 26,
      stdio: ['ignore', 'pipe', 'ignore'],
    }),
  );
  const nodes = new Map(metadata.resolve.nodes.map((/** @type {{ id: string }} */ node) => [node.id, node]));
  const packages = new Map(metadata.packages.map((/** @type {{ id: string }} */ one) => [one.id, one]));
  const own = metadata.packages
    .filter(
      (/** @type {{ name: string, source: string | null }} */ { name, source }) =>
        OWN_PACKAGES.includes(name) && source === null,
    )
    .map((/** @type {{ id: string }} */ { id }) => id);
  const [waiting, seen] = [[...own], new Set()];
  for (let id = waiting.pop(); id !== undefined; id = waiting.pop()) {
    if (seen.has(id)) continue;
    seen.add(id);
    for (const { pkg, dep_kinds } of nodes.get(id).deps) {
      if (dep_kinds.some((/** @type {{ kind: string | null }} */ { kind }) => kind === null)) waiting.push(pkg);
    }
  }
  for (const id of own) seen.delete(id);
  return [...seen].map((id) => {
    const { name, version, license } = packages.get(id);
    return component('cargo', name, version, license);
  });
}

/** @returns {{ bomFormat: string, specVersion: string, version: number, metadata: object, components: Component[] }} */
export function billOfMaterials() {
  const { name, version } = JSON.parse(readFileSync(join(ROOT, 'package.json'), 'utf8'));
  const components = [...npmComponents(), ...cargoComponents()].sort((a, b) => (a.purl < b.purl ? -1 : 1));
  return {
    bomFormat: 'CycloneDX',
    specVersion: '1.5',
    version: 1,
    metadata: { component: { type: 'application', name, version } },
    components,
  };
}

export function writeBillOfMaterials() {
  writeFileSync(join(ROOT, 'www', 'dist', 'sbom.json'), `${JSON.stringify(billOfMaterials(), null, 2)}\n`);
}
