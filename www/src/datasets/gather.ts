/** From what the browser hands over (a drop, a file dialogue) to files with their paths. */

import type { Note } from './note.js';

export interface NamedFile {
  /** Path inside the dropped folder, or the bare file name. */
  name: string;
  file: File;
}

/** Why an entry is missing: the browser does not say more. */
const UNREADABLE = 'the browser could not read this; was it moved or deleted, or may you not open it?';

/**
 * All files of a drop, folders opened to any depth; what cannot be read is added to `unreadable`, and costs nothing else. The
 * entries are taken before the first wait: the browser empties the DataTransfer when the event is over.
 */
export async function filesOfDrop(transfer: DataTransfer, unreadable: Note[] = []): Promise<NamedFile[]> {
  const entries: FileSystemEntry[] = [];
  const loose: File[] = [];
  for (const item of transfer.items) {
    if (item.kind !== 'file') continue;
    const entry = item.webkitGetAsEntry();
    const file = entry ? null : item.getAsFile();
    if (entry) entries.push(entry);
    else if (file) loose.push(file);
  }
  const opened = await Promise.all(entries.map((entry) => filesOfEntry(entry, unreadable)));
  return [...opened.flat(), ...loose.map((file) => ({ name: file.name, file }))];
}

/**
 * Whether what is dragged may be depth images. Before the drop a browser tells types and no names: images and archives have one; scans
 * have none, nor do folders and bags, of which one is dragged at a time.
 */
export function mayBeDepthImages({ items }: DataTransfer): boolean {
  const types = Array.from(items, ({ type }) => type);
  return types.length < 2 || types.some((type) => /^image\/|zip/.test(type));
}

/** Whether one of these may be an occupancy map, by their names: that is looked into. */
export function mayHoldMap(files: readonly NamedFile[]): boolean {
  const [only] = files;
  const isPicture = files.length === 1 && /(map|grid|floor)[^/]*\.(pgm|png|ppm|jpe?g)$/i.test(only?.name ?? '');
  return isPicture || files.some(({ name }) => /\.(ya?ml|dat(\.gz)?)$/i.test(name));
}

/** All files of a file or folder dialogue. */
export function filesOfInput(input: HTMLInputElement): NamedFile[] {
  const files = Array.from(input.files ?? [], (file) => ({ name: file.webkitRelativePath || file.name, file }));
  input.value = ''; // so that picking the same files again is a change
  return files;
}

async function filesOfEntry(entry: FileSystemEntry, unreadable: Note[]): Promise<NamedFile[]> {
  const name = entry.fullPath.replace(/^\//, '');
  const children: FileSystemEntry[] = [];
  try {
    if (entry.isFile) {
      const file = await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject));
      return [{ name, file }];
    }
    const reader = (entry as FileSystemDirectoryEntry).createReader();
    for (;;) {
      // A folder is read in batches of about a hundred; an empty one is the end.
      const batch = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
      if (batch.length === 0) break;
      children.push(...batch);
    }
  } catch {
    unreadable.push({ file: name, reason: UNREADABLE });
  }
  const opened = await Promise.all(children.map((child) => filesOfEntry(child, unreadable)));
  return opened.flat();
}
