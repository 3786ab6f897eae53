// @ts-check
/** What the tests of the command line share: running it, folders that vanish, and a room to scan. */
import { spawnSync } from 'node:child_process';
import { existsSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { invoke } from '../../npm/cli/invocation.js';
import { main } from '../../npm/cli/main.js';
import { compareNaturally } from '../../npm/base/natural_order.js';

export const ROOT = fileURLToPath(new URL('../..', import.meta.url));
export const SAMPLES = join(ROOT, 'www', 'samples', 'corridor');
/** The recordings of others. */
export const DATA = join(ROOT, '..', 'shared', 'data');
/** For `skip`: false, or why. Where the folder is there, everything that the tests read of it is. */
export const skipWithoutData = existsSync(DATA) ? false : '../shared/data is absent';
/** What takes longer hangs (ms): everything takes a fraction of it, also on a busy machine. */
export const DEADLINE_MS = 600_000;

/**
 * Runs `scanstitch` with these arguments in this process: one of its own takes longer to start than most commands to run.
 * @param {string[]} args
 * @param {string} [cwd]
 */
export async function scanstitch(args, cwd = ROOT) {
  const printed = { stdout: '', stderr: '' };
  const into = (/** @type {'stdout' | 'stderr'} */ name) => ({
    write: (/** @type {string} */ text) => (printed[name] += text),
  });
  const before = process.cwd();
  process.chdir(cwd);
  try {
    const status = await invoke({ stdout: into('stdout'), stderr: into('stderr') }, () => main(args));
    return { status, ...printed };
  } finally {
    process.chdir(before);
  }
}

/**
 * Runs it in a process of its own.
 * @param {string[]} args
 * @param {string} [cwd]
 * @param {number} [timeout] after which it hangs (ms)
 */
export function spawnScanstitch(args, cwd = ROOT, timeout = DEADLINE_MS) {
  const { status, stdout, stderr, error } = spawnSync(process.execPath, [join(ROOT, 'npm', 'cli.js'), ...args], {
    cwd,
    encoding: 'utf8',
    timeout,
    killSignal: 'SIGKILL',
  });
  if (error) throw new Error(`scanstitch ${args.join(' ')}: ${error.message}\n${stderr}`, { cause: error });
  return { status, stdout, stderr };
}

/**
 * A folder that is gone when the test is.
 * @param {import('node:test').TestContext} t
 */
export function temporaryFolder(t) {
  const folder = mkdtempSync(join(tmpdir(), 'scanstitch-test-'));
  t.after(() => rmSync(folder, { recursive: true, force: true }));
  return folder;
}

/**
 * Writes files into a folder and returns their paths.
 * @param {string} folder
 * @param {Record<string, string | Uint8Array>} files
 */
export function writeFiles(folder, files) {
  return Object.entries(files).map(([name, contents]) => {
    const path = join(folder, name);
    writeFileSync(path, contents);
    return path;
  });
}

/** @param {string} folder */
export function plyFiles(folder) {
  const names = readdirSync(folder).filter((name) => name.endsWith('.ply'));
  return names.sort(compareNaturally).map((name) => join(folder, name));
}

/** @param {string} folder */
export function readReport(folder) {
  return JSON.parse(readFileSync(join(folder, 'report.json'), 'utf8'));
}

/** @typedef {readonly (readonly [number, number, number, number])[]} Walls segments x0 y0 x1 y1 (m) */

/** A room with a niche and a cupboard: no two views of it are alike. */
export const ROOM = /** @type {const} */ ([
  [-3, -2, 4, -2],
  [4, -2, 4, 1],
  [4, 1, 5, 1],
  [5, 1, 5, 3],
  [5, 3, 4, 3],
  [4, 3, 4, 6],
  [4, 6, -2, 6],
  [-2, 6, -3, 4],
  [-3, 4, -3, -2],
  [-2, 2, -1.2, 2.3],
  [-1.2, 2.3, -1.2, 3],
  [-1.2, 3, -2, 2.7],
  [-2, 2.7, -2, 2],
  [1.5, 4, 2.5, 4.4],
]);

/** A hall with two pillars, which has nothing in common with the room. */
export const HALL = /** @type {const} */ ([
  [-9, -1, 14, -1],
  [14, -1, 14, 16],
  [14, 16, -9, 16],
  [-9, 16, -9, -1],
  [2, 9, 3, 10],
  [3, 10, 4, 9],
  [4, 9, 2, 9],
  [-5, 6, -4, 7],
  [-4, 7, -4, 6],
  [-4, 6, -5, 6],
]);

/** Poses of the scans of the room: x, y (m), heading (rad); the first is the world. */
export const ROOM_POSES = /** @type {const} */ ([
  [0, 0, 0],
  [0.3, 0.5, 0.05],
  [0.5, 1, -0.04],
]);

/**
 * A planar scan between walls: 180 returns over 180 degrees, as a PLY file.
 * @param {readonly [number, number, number]} pose
 * @param {Walls} [walls]
 */
export function roomScan([x, y, heading], walls = ROOM) {
  const points = Array.from({ length: 180 }, (_, beam) => {
    const angle = (beam * Math.PI) / 179;
    const range = Math.min(...walls.map((wall) => rangeTo(wall, x, y, angle + heading)));
    return [range * Math.cos(angle), range * Math.sin(angle), 0];
  });
  return asciiPly(points);
}

/**
 * Distance along a ray to a wall (m), Infinity past its ends.
 * @param {readonly [number, number, number, number]} wall
 * @param {number} x
 * @param {number} y
 * @param {number} angle
 */
function rangeTo([x0, y0, x1, y1], x, y, angle) {
  const [dx, dy] = [Math.cos(angle), Math.sin(angle)];
  const [ex, ey] = [x1 - x0, y1 - y0];
  const cross = dx * ey - dy * ex;
  const range = ((x0 - x) * ey - (y0 - y) * ex) / cross;
  const along = ((x0 - x) * dy - (y0 - y) * dx) / cross;
  return range > 0 && along >= 0 && along <= 1 ? range : Number.POSITIVE_INFINITY;
}

/**
 * @param {number[][]} points
 * @param {number} [claimed] the number of points the header speaks of
 */
export function asciiPly(points, claimed = points.length) {
  const header = `ply\nformat ascii 1.0\nelement vertex ${claimed}\nproperty double x\nproperty double y\nproperty double z\n`;
  return `${header}end_header\n${points.map((point) => `${point.join(' ')}\n`).join('')}`;
}

/** The three scans of the room, as files 0.ply, 1.ply and 2.ply. */
export const ROOM_FILES = Object.fromEntries(ROOM_POSES.map((pose, index) => [`${index}.ply`, roomScan(pose)]));

/** A point moved by a pose in space. @param {{ x: number, y: number, z: number, qx: number, qy: number, qz: number, qw: number }} pose @param {readonly number[]} point */
export function moved({ x, y, z, qx, qy, qz, qw }, point) {
  const cross = (/** @type {readonly number[]} */ [a = 0, b = 0, c = 0]) => [
    qy * c - qz * b,
    qz * a - qx * c,
    qx * b - qy * a,
  ];
  const once = cross(point);
  const twice = cross(once);
  return [x, y, z].map((value, i) => value + (point[i] ?? 0) + 2 * (qw * (once[i] ?? 0) + (twice[i] ?? 0)));
}

/**
 * Folders of all packages that an installed scanstitch needs, those included that others need: a machine that has only just installed them
 * cannot tell offline which versions there are.
 */
export function neededPackages() {
  const { packages } = JSON.parse(readFileSync(join(ROOT, 'package-lock.json'), 'utf8'));
  const isNeeded = (/** @type {[string, { dev?: boolean, optional?: boolean }]} */ [path, { dev, optional }]) =>
    path !== '' && !dev && !optional;
  return Object.entries(packages)
    .filter(isNeeded)
    .map(([path]) => join(ROOT, path));
}
