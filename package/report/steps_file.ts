/** The file that keeps the steps by which a map was mended: what the page saves and the command line replays. */
import type { Cell, Edit, KnownPlace, PlanarPose, PlanPoint } from '../../pkg/scanstitch.js';
import { fromBase64, toBase64 } from '../base/base64.js';
import type { Pictures, StepsFile } from '../files/recording.js';
import { object, parsed, show } from './checked_json.js';

/** Raised when an older reader could not replay what a newer writer keeps. */
const VERSION = 1;

export type { StepsFile };

/** The text of the file, with the pictures that its steps name. */
export function stepsText({ num_scans, settings, steps, pictures = {} }: StepsFile) {
  const named = new Set(steps.map((step) => (step.action === 'lay_plan' ? step.picture : null)));
  const kept = Object.entries(pictures).filter(([name]) => named.has(name));
  const encoded = Object.fromEntries(kept.map(([name, bytes]) => [name, toBase64(bytes)]));
  const file = { scanstitch_steps: VERSION, num_scans, settings, steps, ...(kept.length > 0 && { pictures: encoded }) };
  return `${JSON.stringify(file, null, 1)}\n`;
}

/** Reads the file; throws an Error whose message says what is wrong with it. */
export function readSteps(text: string): StepsFile {
  const {
    scanstitch_steps: version,
    num_scans,
    settings = {},
    steps,
    pictures,
  } = object(parsed(text, 'file of steps'), 'the file');
  if (version === undefined) throw new Error('This is no file of steps: it has no "scanstitch_steps"');
  if (version !== VERSION)
    throw new Error(`These steps are of version ${show(version)}; this program reads ${VERSION}`);
  if (!Array.isArray(steps)) throw new Error('It has no list of "steps"');
  return {
    num_scans: count(num_scans, '"num_scans"'),
    settings: object(settings, '"settings"'),
    steps: steps.map((step, index) => readStep(step, `Step ${index + 1}`)),
    ...(pictures !== undefined && { pictures: readPictures(object(pictures, '"pictures"')) }),
  };
}

function readPictures(pictures: Record<string, unknown>): Pictures {
  const decoded = Object.entries(pictures).map(([name, value]) => {
    const bytes = typeof value === 'string' ? fromBase64(value) : null;
    if (!bytes) throw new Error(`The picture ${show(name)} is no base64`);
    return [name, bytes] as const;
  });
  return Object.fromEntries(decoded);
}

type Action = Edit['action'];
type Point = [number, number];

/** How each kind of step is read; the engine says what is wrong with its numbers. */
const READERS: { [A in Action]: (step: Fields) => Omit<Extract<Edit, { action: A }>, 'action'> } = {
  remove_loop: (step) => ({ target: step.count('target'), source: step.count('source') }),
  add_loop: (step) => ({
    target: step.count('target'),
    source: step.count('source'),
    T_target_source: step.pose('T_target_source'),
    unchecked: step.flag('unchecked'),
  }),
  paint_line: (step) => ({ cells: step.cells(), ends: step.pair('ends'), width: step.number('width') }),
  paint_rectangle: (step) => ({ cells: step.cells(), corners: step.pair('corners') }),
  paint_polygon: (step) => ({ cells: step.cells(), corners: step.points('corners') }),
  crop: (step) => ({ corners: step.pair('corners') }),
  rotate: (step) => (step.has('angle') ? { angle: step.number('angle') } : {}),
  anchor: (step) => ({
    pairs: step.knownPlaces('pairs'),
    ...(step.has('accuracy') && { accuracy: step.number('accuracy') }),
  }),
  lay_plan: (step) => ({
    picture: step.text('picture'),
    points: step.planPoints('points'),
    ...(step.has('accuracy') && { accuracy: step.number('accuracy') }),
  }),
  remove_plan: () => ({}),
  leave_out: (step) => ({ first: step.count('first'), last: step.count('last') }),
};

function isAction(action: unknown): action is Action {
  return typeof action === 'string' && Object.hasOwn(READERS, action);
}

function readStep(value: unknown, where: string): Edit {
  const { action, ...fields } = object(value, where);
  if (!isAction(action)) {
    throw new Error(`${where}: "action" is one of ${Object.keys(READERS).join(', ')}, not ${show(action)}`);
  }
  const step = new Fields(fields, where);
  const read = READERS[action](step);
  const [unknown] = step.rest;
  if (unknown !== undefined) throw new Error(`${where} has ${show(unknown)}, which no step ${action} has`);
  return { action, ...read } as Edit;
}

/** The fields of a step, each taken once. */
class Fields {
  readonly #taken = new Set<string>();

  constructor(
    readonly values: Record<string, unknown>,
    readonly where: string,
  ) {}

  /** Names of those that were not taken. */
  get rest(): string[] {
    return Object.keys(this.values).filter((name) => !this.#taken.has(name));
  }

  has(name: string): boolean {
    return this.values[name] !== undefined;
  }

  count(name: string): number {
    return count(this.#take(name), `${this.where}: "${name}"`);
  }

  number(name: string): number {
    return finite(this.#take(name), `${this.where}: "${name}"`);
  }

  text(name: string): string {
    const value = this.#take(name);
    if (typeof value === 'string') return value;
    throw new Error(`${this.where}: "${name}" is a text, not ${show(value)}`);
  }

  flag(name: string): boolean {
    const value = this.#take(name) ?? false;
    if (typeof value === 'boolean') return value;
    throw new Error(`${this.where}: "${name}" is true or false, not ${show(value)}`);
  }

  cells(): Cell {
    const value = this.#take('cells');
    if (value === 'occupied' || value === 'free' || value === 'unknown') return value;
    throw new Error(`${this.where}: "cells" is occupied, free or unknown, not ${show(value)}`);
  }

  pose(name: string): PlanarPose {
    const { x, y, theta } = object(this.#take(name), `${this.where}: "${name}"`);
    const of = (value: unknown, coordinate: string) => finite(value, `${this.where}: "${coordinate}" of "${name}"`);
    return { x: of(x, 'x'), y: of(y, 'y'), theta: of(theta, 'theta') };
  }

  points(name: string): Point[] {
    const value = this.#take(name);
    const where = `${this.where}: "${name}"`;
    if (!Array.isArray(value)) throw new Error(`${where} is a list of points [x, y], not ${show(value)}`);
    return value.map((point: unknown, index) => this.#point(point, `oint ${index + 1} of "${name}"`));
  }

  /** `one`: what it is, but for its first letter. */
  #point(point: unknown, one: string): Point {
    if (!Array.isArray(point) || point.length !== 2)
      throw new Error(`${this.where}: P${one} is [x, y] in metres, not ${show(point)}`);
    const [x, y] = point as [unknown, unknown];
    return [finite(x, `${this.where}: x of p${one}`), finite(y, `${this.where}: y of p${one}`)];
  }

  knownPlaces(name: string): KnownPlace[] {
    return this.#pairs(name, ['map', '[x, y]'], ['world', '[X, Y]']).map(([map, world]) => ({ map, world }));
  }

  planPoints(name: string): PlanPoint[] {
    return this.#pairs(name, ['picture', '[right, down]'], ['map', '[x, y]']).map(([picture, map]) => ({
      picture,
      map,
    }));
  }

  /** Points that are known in two frames, each with how it is written. */
  #pairs(name: string, ...[one, other]: [[string, string], [string, string]]): [Point, Point][] {
    const value = this.#take(name);
    const where = `${this.where}: "${name}"`;
    const form = `{ "${one.join('": ')}, "${other.join('": ')} }`;
    if (!Array.isArray(value)) throw new Error(`${where} is a list of pairs ${form}, not ${show(value)}`);
    return value.map((pair: unknown, index) => {
      const {
        [one[0]]: first,
        [other[0]]: second,
        ...rest
      } = object(pair, `${this.where}: Pair ${index + 1} of "${name}"`);
      const [unknown] = Object.keys(rest);
      if (unknown !== undefined)
        throw new Error(`${this.where}: Pair ${index + 1} has ${show(unknown)}; a pair is ${form}`);
      const of = (frame: string) => `oint "${frame}" of pair ${index + 1}`;
      return [this.#point(first, of(one[0])), this.#point(second, of(other[0]))];
    });
  }

  pair(name: string): [Point, Point] {
    const [first, second, ...others] = this.points(name);
    if (first && second && others.length === 0) return [first, second];
    throw new Error(`${this.where}: "${name}" has two points, not ${first ? (second ? others.length + 2 : 1) : 0}`);
  }

  #take(name: string): unknown {
    this.#taken.add(name);
    return this.values[name];
  }
}

function finite(value: unknown, where: string): number {
  if (typeof value === 'number' && Number.isFinite(value)) return value;
  // 1e999 is read as infinite, for which JSON has no word.
  throw new Error(`${where} is a number, not ${typeof value === 'number' ? String(value) : show(value)}`);
}

function count(value: unknown, where: string) {
  if (typeof value === 'number' && Number.isInteger(value) && value >= 0) return value;
  throw new Error(`${where} is a whole number from 0, not ${show(value)}`);
}
