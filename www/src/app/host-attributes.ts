/**
 * The documented attributes of the element as properties: reflected, and tolerant of what frameworks assign. Null and undefined
 * stand for an attribute that is absent, 'true' and 'false' for booleans that a framework writes as text.
 */
import type { PropertyDeclaration, ReactiveElement } from 'lit';

interface HostAttribute<T> extends PropertyDeclaration<T> {
  /** The value of the property for anything that is assigned to it. */
  coerce(value: unknown): T;
}

const reflected = <T extends string | boolean>(coerce: (value: unknown) => T): HostAttribute<T> => ({
  reflect: true,
  converter: {
    fromAttribute: coerce,
    toAttribute: (value) => (value === true ? '' : value === false ? null : value),
  },
  coerce,
});

/** `initial`: where the attribute is absent. */
export const text = (initial: string): HostAttribute<string> => reflected((value) => String(value ?? initial));

function textOrSwitch(value: unknown): string | boolean {
  const given = value ?? false;
  if (given === false || given === 'false') return false;
  return given === true || given === '' || given === 'true' ? true : String(given);
}

/** Off, on, or on with a value. */
export const asTextOrSwitch = reflected(textOrSwitch);

export const onOrOff = reflected((value) => textOrSwitch(value) !== false);

/** The accessors of a property that is such an attribute; null for any other. `key`: where its value is kept. */
export function accessorsOf(
  name: PropertyKey,
  key: PropertyKey,
  options: PropertyDeclaration,
): (PropertyDescriptor & ThisType<ReactiveElement & Record<PropertyKey, unknown>>) | null {
  if (!('coerce' in options)) return null;
  const { coerce } = options as HostAttribute<unknown>;
  return {
    get() {
      return this[key] ?? coerce(undefined);
    },
    set(value: unknown) {
      const before = this[name];
      this[key] = coerce(value);
      this.requestUpdate(name, before, options);
    },
    configurable: true,
    enumerable: true,
  };
}

const said = new Set<string>();

/** Tells a host once of a spelling that still works. */
export function sayOld(spelling: string, now: string): void {
  if (said.has(spelling)) return;
  said.add(spelling);
  console.warn(`<scanstitch-app>: ${spelling} still works; write ${now}`);
}

/** Former names of properties. */
const FORMER_NAMES = { first_view: 'view', remember_settings: 'rememberSettings' } as const;

/** Lets a prototype answer to the former names, too. */
export function keepFormerNames(prototype: Record<(typeof FORMER_NAMES)[keyof typeof FORMER_NAMES], unknown>): void {
  for (const [former, name] of Object.entries(FORMER_NAMES) as [string, keyof typeof prototype][]) {
    Object.defineProperty(prototype, former, {
      get: function (this: typeof prototype) {
        return this[name];
      },
      set: function (this: typeof prototype, value: unknown) {
        sayOld(former, name);
        this[name] = value;
      },
    });
  }
}

/** Whether `src` names nothing to open. */
export function isNothing(src: string): boolean {
  if (src === 'none') sayOld('src="none"', 'no src');
  return src === 'none' || src.trim() === '';
}
