/**
 * Foreign text (names of files, words from their contents) made fit to be shown on a terminal or on the page: it can
 * neither move the cursor, nor begin a line, nor turn the direction of writing, nor fill the screen.
 */

/** Characters of a name that are shown at most. */
export const NAME_LENGTH = 200;
/** Control and format characters, separators of lines, and halves of surrogate pairs. */
const UNPRINTABLE = /[\p{Cc}\p{Cf}\p{Cs}\p{Zl}\p{Zp}]/gu;

/**
 * What cannot be seen is written as in JSON, `\u001b`; of a long text the middle is left out.
 * @param longest characters, before any of them is written out
 */
export function printable(text: string, longest: number = NAME_LENGTH) {
  return shortened(text, longest).replaceAll(UNPRINTABLE, written);
}

function shortened(text: string, longest: number) {
  if (text.length <= longest) return text;
  const head = Math.floor((2 * longest) / 3);
  return `${text.slice(0, head)} ... ${text.slice(text.length - (longest - head))}`;
}

function written(character: string) {
  const code = character.codePointAt(0) ?? 0;
  return code > 0xffff ? `\\u{${code.toString(16)}}` : `\\u${code.toString(16).padStart(4, '0')}`;
}
