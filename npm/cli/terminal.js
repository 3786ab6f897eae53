// @ts-check
/** What is printed. All that is said on stderr passes through here, so that no name or file content can forge a line. */
import { printable } from '../printable.js';
import { groupBy } from '../recording/names.js';
import { EXIT } from './command.js';
import { invocation } from './invocation.js';

/** Characters of a line that are shown at most: more than any list of topics or settings takes. */
const LINE_LENGTH = 4000;

/** Results, on stdout. @param {string} text */
export function print(text) {
  invocation().stdout.write(text);
}

/** One line. @param {string} text */
export function tell(text) {
  invocation().stderr.write(`${printable(text, LINE_LENGTH)}\n`);
}

/** What is worth knowing, and changes no exit code. @param {string} text */
export function note(text) {
  tell(`note: ${text}`);
}

/** Of more files than these of which the same is to be said, the first few are named. */
const MOST_NAMED = 20;
const FIRST_NAMED = 3;

/**
 * What was found while files were looked into; what could have been used and is lost counts for the exit code, and each is
 * named.
 * @param {readonly import('../recording.js').Note[]} notes
 * @param {(problem: string) => void} complain
 */
export function tellNotes(notes, complain) {
  const alike = groupBy(notes, ({ reason, is_loss }) => `${is_loss ?? false} ${reason}`);
  for (const group of alike.values()) {
    const { reason, is_loss } = /** @type {import('../recording.js').Note} */ (group[0]);
    const isNamed = is_loss || group.length <= MOST_NAMED;
    const names = group.slice(0, isNamed ? group.length : FIRST_NAMED).map(({ file }) => printable(file));
    if (isNamed) for (const name of names) (is_loss ? complain : note)(`${name}: ${reason}.`);
    else note(`${names.join(', ')} and ${group.length - FIRST_NAMED} others: ${reason}.`);
  }
}

/** What is left out: told, and counted for the exit code. */
export class Complaints {
  /** In the order in which they were made. @type {string[]} */
  problems = [];

  complain = (/** @type {string} */ problem) => {
    tell(problem);
    this.problems.push(problem);
  };

  get exitCode() {
    return this.problems.length > 0 ? EXIT.partial : EXIT.done;
  }
}

/** The exit code where something failed: of what has been written by then. */
export function exitCodeOfFailure() {
  return invocation().written.length > 0 ? EXIT.partial : EXIT.nothing;
}

/** A line that counts, where somebody looks. @param {number} total @param {string} [what] is counted */
export function progressLine(total, what = 'frames') {
  const { stderr } = invocation();
  const isSeen = stderr.isTTY;
  return {
    show: (/** @type {number} */ done) => {
      if (isSeen) stderr.write(`\r${done} of ${total} ${what}`);
    },
    clear: () => {
      if (isSeen) stderr.write('\r\x1b[K');
    },
  };
}
