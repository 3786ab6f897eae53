/** What the page says about files and answers, in whole sentences. */
import type { Message } from '../components/messages.js';
import type { Result, Comparison, Refusal } from './protocol.js';

/** More refusals than these are reported in the table alone. */
const MAX_ALERTS = 3;
/** Number of unused files that are named. */
const MAX_NAMES = 3;

export interface Notices {
  problems: string[];
  remarks: string[];
}

export interface NoticeFacts {
  numFiles: number;
  answer: Result | null;
  selected: Comparison | null;
  /** Of files that could not be opened, or of a worker that crashed. */
  messages: readonly Message[];
}

export function noticesOf({ numFiles, answer, selected, messages }: NoticeFacts): Notices {
  const refusals = answer?.refusals ?? [];
  const converted = (answer?.comparisons ?? []).filter(
    (one) => one !== selected && one.summary.advice.includes('conventions_as_read'),
  );
  const many = `${refusals.length} of ${numFiles - 1} cannot be compared; the table says why.`;
  return {
    problems: [
      ...messages.filter(({ kind }) => kind === 'error').map(({ text }) => text),
      ...(answer?.referenceProblem ? [`The ground truth cannot be used. ${answer.referenceProblem}`] : []),
      ...(answer?.relationProblems.slice(0, MAX_ALERTS) ?? []),
      ...(refusals.length > MAX_ALERTS ? [many] : refusals.map(refusalWords)),
    ],
    remarks: [
      ...messages.filter(({ kind }) => kind === 'note').map(({ text }) => text),
      ...(answer?.referenceNotes ?? []).map((note) => `Ground truth: ${note}`),
      ...(selected?.summary.notes ?? []).map((note) => `${selected?.name}: ${note}`),
      ...(converted.length > 0
        ? [`Read in other conventions than their files have: ${named(converted)}. Select one to see what was changed.`]
        : []),
    ],
  };
}

/** What became of files that were not even opened; empty where there are none. */
export function skippedWords(names: readonly string[]): string[] {
  if (names.length === 0) return [];
  return [`Skipped, as neither trajectories nor maps: ${named(names.map((name) => ({ name })))}.`];
}

/** The first of the names, and how many more there are. */
function named(files: readonly { name: string }[]): string {
  const more = files.length > MAX_NAMES ? ` and ${files.length - MAX_NAMES} more` : '';
  return `${files
    .slice(0, MAX_NAMES)
    .map(({ name }) => name)
    .join(', ')}${more}`;
}

function refusalWords({ name, problem }: Refusal): string {
  return problem.startsWith(name) ? problem : `${name}: ${problem}`;
}
