/** What a recording shows otherwise than those before it, in words. */
import type { ChangeKind, RecordingChanges } from '../../pkg/scanstitch.js';

export function countOf({ changes }: RecordingChanges, wanted: ChangeKind) {
  return changes.filter(({ kind }) => kind === wanted).length;
}

/** "3 things are new". */
export function countWords(count: number, kind: ChangeKind) {
  return `${count} ${count === 1 ? 'thing is' : 'things are'} ${kind}`;
}

export function changeWords(of: RecordingChanges) {
  const [largest] = of.changes;
  if (!largest) return `${of.name} shows nothing new, and nothing gone.`;
  const [x, y] = largest.middle.map((value) => value.toFixed(1));
  const counts = (['new', 'gone'] as const).map((kind) => countWords(countOf(of, kind), kind)).join(', ');
  return `${of.name} against the recordings before it: ${counts}, the largest ${largest.size.toFixed(1)} m at ${x}, ${y}.`;
}
