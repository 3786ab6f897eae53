/** Between the settings as the engine has them (metres, radians) and as a form shows them (metres, degrees). */
import { DEGREES } from './format.js';

export interface Field {
  group: string;
  unit: 'm' | 'rad' | '';
  kind:
    | { type: 'number'; min: number; max: number; step: number }
    | { type: 'integer'; min: number; max: number }
    | { type: 'choice' };
}

export function unitSign({ unit }: Field): string {
  return unit === 'rad' ? '°' : unit;
}

/** A value as the form shows it, with the significant digits only, never 0.30000000000000004. */
export function toScreen(field: Field, value: number): string {
  return String(Number((field.unit === 'rad' ? value * DEGREES : value).toPrecision(6)));
}

/** What was typed, as the engine takes it, within the setting's range; null when it is not a number. */
export function fromScreen(field: Field, text: string): number | null {
  if (field.kind.type === 'choice' || text.trim() === '') return null;
  const typed = Number(text);
  if (!Number.isFinite(typed)) return null;
  const value = field.unit === 'rad' ? typed / DEGREES : typed;
  const whole = field.kind.type === 'integer' ? Math.round(value) : value;
  return Math.min(Math.max(whole, field.kind.min), field.kind.max);
}

export type LabelledField<S> = Field & {
  name: keyof S;
  label: string;
  kind: { choices?: { value: string; label: string }[] };
};

/** What differs between two settings: "Strategy: Joint → Scan to map". */
export function changeWords<S extends object>(fields: readonly LabelledField<S>[], before: S, after: S): string[] {
  const words = (field: LabelledField<S>, value: S[keyof S]): string =>
    typeof value === 'number'
      ? `${toScreen(field, value)}${field.unit === 'm' ? ' m' : unitSign(field)}`
      : (field.kind.choices?.find((choice) => choice.value === value)?.label ?? String(value));
  return fields
    .filter(({ name }) => before[name] !== after[name])
    .map((field) => `${field.label}: ${words(field, before[field.name])} → ${words(field, after[field.name])}`);
}

export function sameSettings<S extends object>(a: S, b: S): boolean {
  return (Object.keys(a) as (keyof S)[]).every((name) => a[name] === b[name]);
}

/**
 * Settings written as `name=value&name=value`, as in an address. What is not named stays as in `base`; an unknown
 * name, a choice that does not exist and a number that is none are passed over; a number out of range goes to its end.
 */
export function parseSettings<S extends object>(
  text: string,
  base: S,
  descriptions: readonly (Field & { name: keyof S; kind: { choices?: { value: string }[] } })[],
): S {
  const given = new URLSearchParams(text);
  const settings = { ...base };
  for (const description of descriptions) {
    const { name, kind } = description;
    const value = given.get(String(name));
    if (value === null) continue;
    if (kind.type === 'choice') {
      if (kind.choices?.some((choice) => choice.value === value)) settings[name] = value as S[keyof S];
    } else {
      const number = fromScreen({ ...description, unit: '' }, value);
      if (number !== null) settings[name] = number as S[keyof S];
    }
  }
  return settings;
}

/** The settings that differ from `base`, written as `parseSettings` reads them: in SI units, as the engine has them. */
export function writeSettings<S extends object>(settings: S, base: S): string {
  const changed = (Object.keys(settings) as (keyof S)[]).filter((name) => settings[name] !== base[name]);
  return new URLSearchParams(changed.map((name) => [String(name), String(settings[name])])).toString();
}
