// @ts-check
/** Settings on the command line: `scanstitch settings`, `--preset NAME` and `--set name=value`. */
import { CommandError, EXIT, readArguments } from './command.js';

/** @typedef {import('../index.js').Settings} Settings */
/** @typedef {import('../index.js').SettingDescription} SettingDescription */

const WIDTH = 100;

/** @type {import('./command.js').Command} */
export const settings = {
  name: 'settings',
  about: 'list every setting with its default and limits, and the presets',
  help: () => `scanstitch settings

Lists every setting of a reconstruction with its default, limits and one line of explanation, and the presets.
`,
  run: (engine, args) => {
    readArguments('settings', { args, options: {} });
    process.stdout.write(settingsHelp(engine));
    return EXIT.done;
  },
};

/**
 * All settings and presets as text.
 * @param {import('./command.js').Engine} engine
 */
export function settingsHelp(engine) {
  const presets = engine.presets();
  const defaults = presets[0]?.settings;
  const descriptions = engine.describe_settings();
  const groups = [...new Set(descriptions.map(({ group }) => group))].map((group) => {
    const members = descriptions.filter((description) => description.group === group);
    return `  ${group}\n${members.map((description) => describeOne(description, defaults)).join('')}`;
  });
  const presetLines = presets.map(({ name, explanation }) => `  ${name}\n${wrap(explanation)}`);
  return `Settings:\n\n${groups.join('\n')}\nPresets:\n\n${presetLines.join('')}`;
}

/**
 * @param {SettingDescription} description
 * @param {Settings | undefined} defaults
 */
function describeOne({ name, unit, explanation, kind }, defaults) {
  const limits =
    kind.type === 'choice' ? kind.choices.map(({ value }) => value).join(' | ') : `${kind.min} to ${short(kind.max)}`;
  const value = defaults?.[/** @type {keyof Settings} */ (name)];
  const shown = typeof value === 'number' ? short(value) : value;
  return `    ${name}=${shown}${unit && ` ${unit}`}   (${limits})\n${wrap(explanation)}`;
}

/** Four significant digits are enough to read. @param {number} value */
function short(value) {
  return String(Number(value.toPrecision(4)));
}

/** Indented lines of at most WIDTH characters. @param {string} text */
function wrap(text) {
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
 * @param {import('./command.js').Engine} engine
 * @param {string | undefined} presetName
 * @param {string[]} assignments each `name=value`
 * @returns {Partial<Settings>}
 */
export function readSettings(engine, presetName, assignments) {
  const presets = engine.presets();
  const preset = presets.find(({ name }) => name === presetName);
  if (presetName !== undefined && !preset) {
    const known = presets.map(({ name }) => name).join(', ');
    throw new CommandError(`There is no preset ${JSON.stringify(presetName)}. There are: ${known}`);
  }
  const descriptions = engine.describe_settings();
  const assigned = assignments.map((assignment) => readAssignment(descriptions, assignment));
  return { ...preset?.settings, ...Object.fromEntries(assigned) };
}

/**
 * @param {SettingDescription[]} descriptions
 * @param {string} assignment
 * @returns {[string, number | string]}
 */
function readAssignment(descriptions, assignment) {
  const [, name = '', value = ''] = assignment.match(/^([^=]+)=(.+)$/s) ?? [];
  if (!name) throw new CommandError(`--set ${assignment}: write it as name=value`);
  const description = descriptions.find((description) => description.name === name);
  if (!description) {
    throw new CommandError(`--set ${assignment}: there is no setting ${name}. To list all: scanstitch settings`);
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
