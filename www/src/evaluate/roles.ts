/** Which of the files dropped together is the reference. */

const REFERENCE_NAME = /(^|[^a-z])(gt|truth|ground[ _-]?truth|groundtruth|reference|ref)([^a-z]|$)/i;

/** The index of the file whose name says that it is the ground truth, else the first. */
export function referenceAmong(names: readonly string[]): number {
  const bare = names.map((name) => name.replace(/^.*\//, '').replace(/\.[^.]*$/, ''));
  return Math.max(
    bare.findIndex((name) => REFERENCE_NAME.test(name)),
    0,
  );
}
