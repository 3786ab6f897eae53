/** What the form of settings says of each. */
import { type Field, toScreen, unitSign } from './setting-fields.js';

/** The groups in the order in which they first appear. */
export function settingGroups<F extends Field>(descriptions: readonly F[]): { group: string; descriptions: F[] }[] {
  const groups = new Map<string, F[]>();
  for (const description of descriptions) {
    groups.set(description.group, [...(groups.get(description.group) ?? []), description]);
  }
  return Array.from(groups, ([group, members]) => ({ group, descriptions: members }));
}

/** What a zero stands for where the explanation says so ("0: estimated from the first image."), in one word; null where it is a number. */
export function zeroWord(explanation: string): string | null {
  const [, meaning] = /(?<![\d.])0: (\w+)/.exec(explanation) ?? [];
  if (meaning === undefined) return null;
  return ['all', 'none'].includes(meaning) ? meaning : 'auto';
}

/** The step of the arrow keys on the screen; any value in between may be typed as well. */
export function screenStep(field: Field): string {
  return field.kind.type === 'number' ? toScreen(field, field.kind.step) : '1';
}

/** "0.01 to 5 m". */
export function rangeWords(field: Field): string {
  if (field.kind.type === 'choice') return '';
  return `${toScreen(field, field.kind.min)} to ${toScreen(field, field.kind.max)} ${unitSign(field)}`.trimEnd();
}
