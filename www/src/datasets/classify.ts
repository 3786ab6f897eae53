/** Which of the given files are scans, which one is the reference trajectory, and why the rest is left aside. */

export type Role =
  | { role: 'scan' }
  | { role: 'reference' }
  /** `reason` completes "notes.pdf: ...". Null: not worth a word (a file the system put there). */
  | { role: 'ignored'; reason: string | null };

const SYSTEM_FILES = /^(\.|thumbs\.db$|desktop\.ini$|__macosx$)/i;
const TRAJECTORY_NAMES = /\.(tum|traj)$/i;
const TEXT_NAMES = /\.(txt|csv|tsv|dat|xyz)$/i;
const IMAGE_NAMES = /\.(png|jpe?g|tiff?|bmp|webp|pgm)$/i;
const ARCHIVE_NAMES = /\.(zip|tar|gz|tgz|7z|rar)$/i;

/** `head` is the beginning of the file, a few kilobytes. */
export function classify(name: string, head: Uint8Array): Role {
  const parts = name.split('/');
  if (parts.some((part) => SYSTEM_FILES.test(part))) return { role: 'ignored', reason: null };
  const base = parts.at(-1) ?? name;
  if (/\.ply$/i.test(base) || startsAsPly(head)) return { role: 'scan' };
  if (TRAJECTORY_NAMES.test(base)) return { role: 'reference' };
  if (TEXT_NAMES.test(base) || !base.includes('.')) {
    if (looksLikeNumbers(head)) return { role: 'reference' };
    return { role: 'ignored', reason: 'holds neither a PLY scan nor lines of numbers that could be a trajectory' };
  }
  if (/\.npy$/i.test(base)) {
    return { role: 'ignored', reason: 'NumPy arrays are not read; save the trajectory as text, one pose a line' };
  }
  if (/\.(pcd|las|laz|e57|xyz|bag|db3|mcap|log)$/i.test(base)) {
    return { role: 'ignored', reason: 'this format is not read; convert the scans to PLY, one file a scan' };
  }
  if (IMAGE_NAMES.test(base)) return { role: 'ignored', reason: 'an image, not a laser scan' };
  if (ARCHIVE_NAMES.test(base)) return { role: 'ignored', reason: 'an archive; unpack it and drop the folder' };
  return { role: 'ignored', reason: 'not a PLY scan and not a trajectory (.tum or .txt)' };
}

function startsAsPly(head: Uint8Array): boolean {
  return /^ply\s/.test(new TextDecoder('latin1').decode(head.subarray(0, 4)));
}

/** The first lines that say anything hold two numbers or more. */
function looksLikeNumbers(head: Uint8Array): boolean {
  if (head.includes(0)) return false;
  const lines = new TextDecoder().decode(head).split(/\r?\n/);
  const spoken = lines.map((line) => line.trim()).filter((line) => line !== '' && !/^(#|%|\/\/)/.test(line));
  const is_numeric = (line: string): boolean => {
    const numbers = line.split(/[\s,;]+/).filter((word) => word !== '' && Number.isFinite(Number(word)));
    return numbers.length >= 2;
  };
  // A table may begin with the names of its columns.
  return spoken.slice(0, 3).some(is_numeric) && spoken.slice(1, 4).every(is_numeric);
}
