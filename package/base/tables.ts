/** Tables as the texts of files. */

/** A line a row; nothing for null and undefined. */
export function csv(rows: readonly (readonly unknown[])[]) {
  return rows.map((row) => `${row.map(quoted).join(',')}\n`).join('');
}

function quoted(value: unknown) {
  const text = String(value ?? '');
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

/** @param textColumns that hold no numbers */
export function markdown(
  heads: readonly string[],
  rows: readonly (readonly string[])[],
  textColumns: ReadonlySet<number>,
) {
  const line = (cells: readonly string[]) => `| ${cells.map((cell) => cell.replaceAll('|', '\\|')).join(' | ')} |\n`;
  const rule = heads.map((_, column) => (textColumns.has(column) ? '---' : '---:'));
  return [heads, rule, ...rows].map(line).join('');
}
