/**
 * The files of the built-in sample, as one script: that is one request in place of eleven, and every host compresses it.
 * Imported only when the sample is shown.
 */
import type { InputFile } from '../engine/protocol.js';

/** In the order of their names: the scans are numbered by one digit. */
const texts = import.meta.glob<string>('../../samples/corridor/*.{ply,tum}', {
  query: '?raw',
  import: 'default',
  eager: true,
});

/** The scans in the order they were taken in, and the ground truth; their bytes are the caller's own. */
export function corridorFiles(): { scans: InputFile[]; reference: InputFile | null } {
  const files = Object.entries(texts).map(([path, text]): InputFile => {
    const name = path.slice(path.lastIndexOf('corridor/'));
    return { name, bytes: new TextEncoder().encode(text).buffer };
  });
  const scans = files.filter(({ name }) => name.endsWith('.ply'));
  return { scans, reference: files.find(({ name }) => name.endsWith('.tum')) ?? null };
}
