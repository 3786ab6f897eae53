// @ts-check
/** What is said on stderr. All of it passes through here, so that no name or file content can forge a line. */
import { printable } from '../printable.js';
import { EXIT } from './command.js';

/** Characters of a line that are shown at most: more than any list of topics or settings takes. */
const LINE_LENGTH = 4000;

/** One line. @param {string} text */
export function tell(text) {
  process.stderr.write(`${printable(text, LINE_LENGTH)}\n`);
}

/** What is worth knowing, and changes no exit code. @param {string} text */
export function note(text) {
  tell(`note: ${text}`);
}

/**
 * What was found while files were looked into; what could have been used and is lost counts for the exit code.
 * @param {readonly import('../recording.js').Note[]} notes
 * @param {(problem: string) => void} complain
 */
export function tellNotes(notes, complain) {
  for (const { file, reason, is_loss } of notes) (is_loss ? complain : note)(`${printable(file)}: ${reason}.`);
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

/** A line that counts, where somebody looks. @param {number} total @param {string} [what] is counted */
export function progressLine(total, what = 'frames') {
  const isSeen = process.stderr.isTTY;
  return {
    show: (/** @type {number} */ done) => {
      if (isSeen) process.stderr.write(`\r${done} of ${total} ${what}`);
    },
    clear: () => {
      if (isSeen) process.stderr.write('\r\x1b[K');
    },
  };
}
