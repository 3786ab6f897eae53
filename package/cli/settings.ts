/** Settings on the command line: `scanstitch settings`, `--preset NAME` and `--set name=value`. */
import type { SettingDescription } from '../../pkg/scanstitch.js';
import { type Command, CommandError, type Engine, EXIT, readArguments } from './command.js';
import { print } from './terminal.js';

const WIDTH = 100;

export const settings: Command = {
  name: 'settings',
  about: 'list every setting with its default and limits, and the presets',
  help: () => `scanstitch settings

Lists every setting of a reconstruction with its default, limits and one line of explanation, and the presets: those for
planar scans, and those for depth images and clouds.
`,
  run: (engine, args) => {
    readArguments('settings', { args, options: {} });
    print(settingsHelp(engine));
    return EXIT.done;
  },
};

/** What can be set, for one kind of input. */
export interface Catalogue {
  /** What it is for. */
  about: string;
  descriptions: SettingDescription[];
  /** The first is the default. */
  presets: { name: string; explanation: string; settings: Record<string, unknown> }[];
}

export const planarCatalogue = (engine: Engine): Catalogue =>
  catalogue('planar scans', engine.describe_settings(), engine.presets());

export const spatialCatalogue = (engine: Engine): Catalogue =>
  catalogue('depth images and clouds', engine.describe_spatial_settings(), engine.spatial_presets());

export const strategyCatalogue = (engine: Engine): Catalogue =>
  catalogue('strategies', engine.describe_strategy_settings(), engine.strategy_presets());

function catalogue(
  about: string,
  descriptions: SettingDescription[],
  presets: readonly { name: string; explanation: string; settings: object }[],
): Catalogue {
  return {
    about,
    descriptions,
    presets: presets.map((preset) => ({ ...preset, settings: { ...preset.settings } })),
  };
}

/** All settings and presets as text. */
export function settingsHelp(engine: Engine) {
  return [planarCatalogue(engine), spatialCatalogue(engine)].map(describeAll).join('\n');
}

export function describeAll({ about, descriptions, presets }: Catalogue) {
  const defaults = presets[0]?.settings;
  const groups = [...new Set(descriptions.map(({ group }) => group))].map((group) => {
    const members = descriptions.filter((description) => description.group === group);
    return `  ${group}\n${members.map((description) => describeOne(description, defaults)).join('')}`;
  });
  const presetLines = presets.map(({ name, explanation }) => `  ${name}\n${wrap(explanation)}`);
  return `Settings for ${about}:\n\n${groups.join('\n')}\nPresets for ${about}:\n\n${presetLines.join('')}`;
}

function describeOne(
  { name, unit, explanation, kind }: SettingDescription,
  defaults: Record<string, unknown> | undefined,
) {
  const limits =
    kind.type === 'choice' ? kind.choices.map(({ value }) => value).join(' | ') : `${kind.min} to ${short(kind.max)}`;
  const value = defaults?.[name];
  const shown = typeof value === 'number' ? short(value) : value;
  return `    ${name}=${shown}${unit && ` ${unit}`}   (${limits})\n${wrap(explanation)}`;
}

/** Four significant digits are enough to read. */
function short(value: number) {
  return String(Number(value.toPrecision(4)));
}

/** Indented lines of at most WIDTH characters. */
function wrap(text: string) {
  const lines = [''];
  for (const word of text.split(' ')) {
    const last = lines.at(-1) ?? '';
    if (last && last.length + 1 + word.length > WIDTH) lines.push(word);
    else lines[lines.length - 1] = last ? `${last} ${word}` : word;
  }
  return lines.map((line) => `        ${line}\n`).join('');
}

/**
 * The settings asked for: those of the preset, with the assignments over them.
 * @param assignments each `name=value`
 */
export function readSettings(
  { about, presets, descriptions }: Catalogue,
  presetName: string | undefined,
  assignments: string[],
): Record<string, unknown> {
  const preset = presets.find(({ name }) => name === presetName);
  if (presetName !== undefined && !preset) {
    const known = presets.map(({ name }) => name).join(', ');
    throw new CommandError(`There is no preset ${JSON.stringify(presetName)} for ${about}. There are: ${known}`);
  }
  const assigned = assignments.map((assignment) => readAssignment(about, descriptions, assignment));
  return { ...preset?.settings, ...Object.fromEntries(assigned) };
}

function readAssignment(
  about: string,
  descriptions: SettingDescription[],
  assignment: string,
): [string, number | string] {
  const [, name = '', value = ''] = assignment.match(/^([^=]+)=(.+)$/s) ?? [];
  if (!name) throw new CommandError(`--set ${assignment}: write it as name=value`);
  const description = descriptions.find((description) => description.name === name);
  if (!description) {
    const problem = `there is no setting ${name} for ${about}`;
    throw new CommandError(`--set ${assignment}: ${problem}. To list all: scanstitch settings`);
  }
  const { kind, unit } = description;
  if (kind.type === 'choice') {
    const values = kind.choices.map(({ value }) => value);
    if (values.includes(value)) return [name, value];
    throw new CommandError(`--set ${assignment}: ${name} is one of ${values.join(', ')}`);
  }
  const degrees = unit === 'rad' ? value.match(/^(.+?)\s*(?:deg|°)$/)?.[1] : undefined;
  const number = degrees === undefined ? Number(value) : (Number(degrees) * Math.PI) / 180;
  const whole = kind.type === 'integer';
  if (value.trim() === '' || !Number.isFinite(number) || (whole && !Number.isInteger(number))) {
    const wanted = whole
      ? 'a whole number'
      : `a number${unit && ` in ${unit}`}${unit === 'rad' ? ', or as 35deg' : ''}`;
    throw new CommandError(`--set ${assignment}: ${name} is ${wanted}`);
  }
  return [name, number];
}
