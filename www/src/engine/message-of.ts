/** What an error says. */
export function messageOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

/** Whether something failed only because it was no longer wanted. */
export const isOvertaken = (error: unknown): boolean => error instanceof DOMException && error.name === 'AbortError';
