/** Files of JSON that people may have written by hand, looked through part by part. */

/** @param what the file should be, for the message */
export function parsed(text: string, what: string): unknown {
  try {
    return JSON.parse(text);
  } catch {
    throw new Error(`This is no JSON, and so no ${what}`);
  }
}

/** @param where in the file, for the message */
export function object(value: unknown, where: string): Record<string, unknown> {
  if (typeof value === 'object' && value !== null && !Array.isArray(value)) return { ...value };
  throw new Error(`${where} is an object in braces, not ${show(value)}`);
}

/** As a message quotes it. */
export function show(value: unknown) {
  return value === undefined ? 'missing' : JSON.stringify(value).slice(0, 60);
}
