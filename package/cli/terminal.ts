/** What is printed. All that is said on stderr passes through here, so that no name or file content can forge a line. */
import type { Note } from '../base/errors.js';
import { printable } from '../base/printable.js';
import { groupBy } from '../files/names.js';
import { EXIT } from './command.js';
import { invocation } from './invocation.js';

/** Characters of a line that are shown at most: more than any list of topics or settings takes. */
const LINE_LENGTH = 4000;

/** Results, on stdout. */
export function print(text: string) {
  invocation().stdout.write(text);
}

/** One line. */
export function tell(text: string) {
  invocation().stderr.write(`${printable(text, LINE_LENGTH)}\n`);
}

/** What is worth knowing, and changes no exit code. */
export function note(text: string) {
  tell(`note: ${text}`);
}

/** Of more files than these of which the same is to be said, the first few are named. */
const MOST_NAMED = 20;
const FIRST_NAMED = 3;

/**
 * What was found while files were looked into; what could have been used and is lost counts for the exit code, and each is
 * named.
 */
export function tellNotes(notes: readonly Note[], complain: (problem: string) => void) {
  const alike = groupBy(notes, ({ reason, is_loss }) => `${is_loss ?? false} ${reason}`);
  for (const group of alike.values()) {
    const { reason, is_loss } = group[0] as Note;
    const isNamed = is_loss || group.length <= MOST_NAMED;
    const names = group.slice(0, isNamed ? group.length : FIRST_NAMED).map(({ file }) => printable(file));
    if (isNamed) for (const name of names) (is_loss ? complain : note)(`${name}: ${reason}.`);
    else note(`${names.join(', ')} and ${group.length - FIRST_NAMED} others: ${reason}.`);
  }
}

/** Which frames are doubtful, and why. */
export function tellDoubtful(
  frames: readonly { name: string; status: string; reason: string }[],
  complain: (problem: string) => void,
) {
  const doubtful = frames.filter(({ status }) => status === 'doubtful');
  tellNotes(
    doubtful.map(({ name, reason }) => ({ file: name, reason: `doubtful: ${reason}` })),
    complain,
  );
}

/** What is left out: told, and counted for the exit code. */
export class Complaints {
  /** In the order in which they were made. */
  problems: string[] = [];
  /** Of what was told last, what follows the name of the file. */
  #reason = '';

  complain = (problem: string) => {
    const [name = '', ...reason] = problem.split(': ');
    const isSame = reason.length > 0 && reason.join(': ') === this.#reason;
    this.#reason = reason.join(': ');
    tell(isSame ? `${name}: the same.` : problem);
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

/**
 * A line that counts, where somebody looks.
 * @param what is counted
 */
export function progressLine(total: number, what = 'frames') {
  const { stderr } = invocation();
  const isSeen = stderr.isTTY;
  return {
    show: (done: number) => {
      if (isSeen) stderr.write(`\r${done} of ${total} ${what}`);
    },
    clear: () => {
      if (isSeen) stderr.write('\r\x1b[K');
    },
  };
}
