/** The file that keeps the steps by which a map was mended: what the page saves and the command line replays. */
import type { Edit } from '../../pkg/scanstitch.js';
import type { StepsFile } from '../files/recording.js';
import { object, parsed, show } from './checked_json.js';

/** Raised when an older reader could not replay what a newer writer keeps. */
const VERSION = 1;

export type { StepsFile };

/** The text of the file. */
export function stepsText({ num_scans, settings, steps }: StepsFile) {
  return `${JSON.stringify({ scanstitch_steps: VERSION, num_scans, settings, steps }, null, 1)}\n`;
}

/** Reads the file; throws an Error whose message says what is wrong with it. */
export function readSteps(text: string): StepsFile {
  const {
    scanstitch_steps: version,
    num_scans,
    settings = {},
    steps,
  } = object(parsed(text, 'file of steps'), 'the file');
  if (version === undefined) throw new Error('This is no file of steps: it has no "scanstitch_steps"');
  if (version !== VERSION)
    throw new Error(`These steps are of version ${show(version)}; this program reads ${VERSION}`);
  if (!Array.isArray(steps)) throw new Error('It has no list of "steps"');
  return {
    num_scans: count(num_scans, '"num_scans"'),
    settings: object(settings, '"settings"'),
    steps: steps.map((step, index) => readStep(step, `Step ${index + 1}`)),
  };
}

function readStep(value: unknown, where: string): Edit {
  const { action, target, source, T_target_source: pose, unchecked = false, ...others } = object(value, where);
  const [unknown] = Object.keys(others);
  if (unknown !== undefined) throw new Error(`${where} has ${show(unknown)}, which no step has`);
  const scans = { target: count(target, `${where}: "target"`), source: count(source, `${where}: "source"`) };
  if (action === 'remove_loop') return { action, ...scans };
  if (action !== 'add_loop') throw new Error(`${where}: "action" is remove_loop or add_loop, not ${show(action)}`);
  if (typeof unchecked !== 'boolean') throw new Error(`${where}: "unchecked" is true or false, not ${show(unchecked)}`);
  const { x, y, theta } = object(pose, `${where}: "T_target_source"`);
  const number = (coordinate: unknown, name: string) => {
    if (typeof coordinate === 'number' && Number.isFinite(coordinate)) return coordinate;
    throw new Error(`${where}: "${name}" of "T_target_source" is a number, not ${show(coordinate)}`);
  };
  const T_target_source = { x: number(x, 'x'), y: number(y, 'y'), theta: number(theta, 'theta') };
  return { action, ...scans, T_target_source, unchecked };
}

function count(value: unknown, where: string) {
  if (typeof value === 'number' && Number.isInteger(value) && value >= 0) return value;
  throw new Error(`${where} is a whole number from 0, not ${show(value)}`);
}
