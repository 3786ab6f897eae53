/** Texts in UTF-16, as PowerShell's `>` and spreadsheets write them, told by their byte order mark. */

/** The encoding that a text's first two bytes mark; null where they mark none. */
export function markedUtf16([first, second]: Uint8Array): 'utf-16le' | 'utf-16be' | null {
  if (first === 0xff && second === 0xfe) return 'utf-16le';
  return first === 0xfe && second === 0xff ? 'utf-16be' : null;
}

/** The bytes of a text in UTF-8: as they are where none of UTF-16 are marked. */
export function inUtf8(bytes: Uint8Array): Uint8Array {
  const encoding = markedUtf16(bytes.subarray(0, 2));
  return encoding ? new TextEncoder().encode(new TextDecoder(encoding).decode(bytes)) : bytes;
}
