/** Which of the files dropped together is the truth. */

const TRUTH = /(^|[^a-z])(gt|truth|ground[ _-]?truth|groundtruth|reference|ref)([^a-z]|$)/i;

/** The index of the file whose name says that it is the truth, else the first. */
export function referenceAmong(names: readonly string[]): number {
  const bare = names.map((name) => name.replace(/^.*\//, '').replace(/\.[^.]*$/, ''));
  return Math.max(
    bare.findIndex((name) => TRUTH.test(name)),
    0,
  );
}
