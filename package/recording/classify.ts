/** Planar scans: which files are scans, which one is the reference trajectory, and why the rest is not used. */
import { brokenImage, isPly, isPointer } from '../files/heads.js';
import { isImageName } from '../files/kinds.js';
import { isLaserLog, isOdometryName, isOfLabels, isTable as isTableOfRanges } from '../files/laser_logs.js';
import { adviceFor, isGraph } from './other_formats.js';

/**
 * What a file is for. `reason` completes "notes.pdf: not used: ..."; null: not worth a word (a file the system put
 * there). `is_log`: many scans in one file; `isTable`: a log whose columns somebody may want to name.
 */
export type Role =
  | { role: 'scan'; isLog: boolean; isTable: boolean }
  | { role: 'reference' }
  | { role: 'odometry' }
  | { role: 'ignored'; reason: string | null };

const SYSTEM_FILES = /^(\.|thumbs\.db$|desktop\.ini$|__macosx$)/i;
const TRAJECTORY_NAMES = /\.(tum|traj)$/i;
const TEXT_NAMES = /\.(txt|csv|tsv|dat|xyz|mat)$/i;
/** So many numbers, one a line, may be the ranges of a scan. */
const MIN_RANGES = 24;
/** Images of a format that is not looked into. */
const OTHER_IMAGE_NAMES = /\.tiff?$/i;

/** Whether the system put it there, or hides it. */
export function isSystemFile(path: string) {
  return path.split('/').some((part) => SYSTEM_FILES.test(part) && part !== '.' && part !== '..');
}

/** Images, and the text of programs and pages, in which numbers may stand as in a table. */
const NO_LOGS = /\.(depth|[cm]?[jt]sx?|py|cpp|cc|c|h|hpp|rs|java|sh|css|html?|md)$/i;

/**
 * The part a file plays among planar scans.
 * @param beginning of the file, a few kilobytes; null: its name says enough
 * @param isTable whether tables of numbers are said to be laser scans
 */
export function classify(path: string, beginning: Uint8Array | null, isTable = false): Role {
  const head = beginning ?? new Uint8Array();
  if (isSystemFile(path)) return { role: 'ignored', reason: null };
  if (isPointer(head))
    return { role: 'ignored', reason: 'a Git LFS pointer, not the file itself; fetch it with git lfs pull' };
  const base = path.split('/').at(-1) ?? path;
  if (/\.ply$/i.test(base) || isPly(head)) return { role: 'scan', isLog: false, isTable: false };
  if (isGraph(head)) return { role: 'ignored', reason: adviceFor(base, head) };
  if (
    (!NO_LOGS.test(base) && isLaserLog(head)) ||
    (isTable && !isOdometryName(base) && (looksLikeNumbers(head) || isColumn(head)))
  )
    return { role: 'scan', isLog: true, isTable: isTableOfRanges(head) || isColumn(head) };
  if (TEXT_NAMES.test(base) && isOfLabels(base, head))
    return { role: 'ignored', reason: 'labels of readings, and neither ranges nor a trajectory' };
  if (TRAJECTORY_NAMES.test(base)) return { role: isOdometryName(base) ? 'odometry' : 'reference' };
  if (TEXT_NAMES.test(base) || !base.includes('.')) {
    if (looksLikeNumbers(head)) return { role: isOdometryName(base) ? 'odometry' : 'reference' };
    const reason = adviceFor(base, head) ?? 'holds neither scans nor lines of numbers that could be a trajectory';
    return { role: 'ignored', reason };
  }
  const advice = adviceFor(base, head);
  if (advice !== null) return { role: 'ignored', reason: advice };
  if (/\.npy$/i.test(base)) {
    return {
      role: 'ignored',
      reason: 'a NumPy array that holds neither scans nor points; save a reference trajectory as text, one pose a line',
    };
  }
  if (/\.pcd$/i.test(base)) return { role: 'ignored', reason: 'a cloud that does not lie in the plane z = 0' };
  if (/\.(bag|db3|mcap)$/i.test(base)) return { role: 'ignored', reason: 'a bag, which is opened by itself' };
  if (/\.(log|json|carmen|clf)$/i.test(base)) {
    return { role: 'ignored', reason: 'no laser log: neither lines of CARMEN nor scans as CSM writes them' };
  }
  if (isImageName(base) || OTHER_IMAGE_NAMES.test(base)) {
    const fault = beginning && isImageName(base) ? brokenImage(base, beginning) : null;
    return { role: 'ignored', reason: fault ?? 'an image, not a laser scan' };
  }
  return { role: 'ignored', reason: 'not a PLY scan and not a trajectory (.tum or .txt)' };
}

/** The first lines that say anything hold two numbers or more. */
export function looksLikeNumbers(head: Uint8Array) {
  if (head.includes(0)) return false;
  const lines = new TextDecoder().decode(head).split(/\r?\n/);
  const spoken = lines.map((line) => line.trim()).filter((line) => line !== '' && !/^(#|%|\/\/)/.test(line));
  const isNumeric = (line: string) => {
    const numbers = line.split(/[\s,;]+/).filter((word) => word !== '' && Number.isFinite(Number(word)));
    return numbers.length >= 2;
  };
  // A table may begin with the names of its columns.
  return spoken.slice(0, 3).some(isNumeric) && spoken.slice(1, 4).every(isNumeric);
}
/** Whether a text is a number a line, as many as a scan has, that do not ascend as times do. */
export function isColumn(head: Uint8Array) {
  const lines = new TextDecoder('latin1').decode(head).trim().split(/\r?\n/).slice(0, -1);
  const numbers = lines.slice(1).map((line) => (line.trim() === '' ? Number.NaN : Number(line)));
  const isTimes = numbers.every((number, at) => at === 0 || number > (numbers[at - 1] ?? 0));
  return lines.length >= MIN_RANGES && !isTimes && numbers.every(Number.isFinite);
}
