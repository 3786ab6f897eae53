/**
 * The files of the built-in sample, as one script: that is one request in place of eleven, and every host compresses it.
 * Imported only when the sample is shown.
 */
import type { InputFile } from '../engine/protocol.js';
import { scanText } from './scan-text.js';

/** In the order of their names: the scans are numbered by one digit. */
const ranges = import.meta.glob<string>('../../samples/corridor/*.ply', {
  query: '?ranges',
  import: 'default',
  eager: true,
});
const truths = import.meta.glob<string>('../../samples/corridor/*.tum', {
  query: '?raw',
  import: 'default',
  eager: true,
});

/** The scans in the order they were taken in, and the ground truth; their bytes are the caller's own. */
export function corridorFiles(): { scans: InputFile[]; reference: InputFile | null } {
  const file = (path: string, text: string): InputFile => ({
    name: path.slice(path.lastIndexOf('corridor/')),
    bytes: new TextEncoder().encode(text).buffer,
  });
  const scans = Object.entries(ranges).map(([path, text]) => file(path, scanText(text)));
  const [reference = null] = Object.entries(truths).map(([path, text]) => file(path, text));
  return { scans, reference };
}
