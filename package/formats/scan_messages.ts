/**
 * Laser scans as programs print or log them, as the text that the engine reads: JSON objects with `readings` (CSM) where a scan
 * tells its angles, a table of ranges where it does not.
 *
 * | what | told from |
 * |---|---|
 * | `ros2 topic echo`, `rostopic echo`, `gz topic -e`: `name: value` lines, a message after the other | `angle_min:` and `angle_increment:` or `angle_step:` |
 * | JSON: a message, a list of them, one a line, within others (rosbridge) | `"ranges": [` or objects with an angle and a distance |
 * | SICK's telegrams (CoLa A; CoLa B as bytes) | `LMDscandata` |
 * | UrgBenri's log (`.ubh`) | `[startStep]` |
 * | answers of Hokuyo's lasers (SCIP 2.0, scip.js) | `MD`, `MS`, `ME`, `GD` or `GS` and a status line |
 * | packets of LDROBOT's lasers, as bytes or hexadecimal text (ldrobot.js) | two whole packets |
 * | a LaserScan as Python prints it | `LaserScan(header=` |
 * | lists of 24 numbers and more, as JSON or Python writes them | their brackets |
 * | Player, DP-SLAM, `ultra_simple` of RPLIDARs, listeners of the ROS packages of RPLIDARs and YDLIDARs, logs of ARIA and ARNL, GetLDSScan of Neato (scan_lines.js) | their lines |
 * | scans as points x y or x y z, a scan a line, numbered, or in JSON (point_scans.js) | their columns |
 * | the Python package rplidar: a list of (quality, angle, distance) a line | its brackets |
 * | an angle and a distance at a time (angle_distance.js) | colons, braces, letters |
 */
import { angleDistanceReader } from './angle_distance.js';
import { isJson, isNumberLists, readJson } from './json_scans.js';
import { bytesOfHex, isLdrobot, readLdrobot } from './ldrobot.js';
import { isNumberedPoints, kindOfLines, readLines, readNumberedPoints } from './point_scans.js';
import * as printed from './printed_messages.js';
import type { Scan } from './scan.js';
import type { Tell } from './scan_checks.js';
import * as lines from './scan_lines.js';
import { isScip, readScip } from './scip.js';
import { readSickBinary, readSickText } from './sick.js';
import { isUrgBenri, readUrgBenri } from './urg_benri.js';
import { written } from './written_scans.js';

/** tell: of what is wrong with it */
type Reader = (text: string, name: string, tell: Tell) => string;
type Kind = { is: (head: string) => boolean; read: (text: string, name: string, tell: Tell) => Scan[] };

const KINDS: readonly Kind[] = [
  { is: (head) => /\bLMDscandata /.test(head), read: (text, _, tell) => whole(readSickText(text), 'telegrams', tell) },
  { is: isUrgBenri, read: readUrgBenri },
  { is: isScip, read: (text, _, tell) => whole(readScip(text), 'answers', tell) },
  { is: printed.isRepr, read: printed.readRepr },
  { is: isJson, read: readJson },
  { is: printed.isTuples, read: printed.readTuples },
  { is: printed.isArrays, read: printed.readArrays },
  { is: printed.isEcho, read: printed.readEcho },
  { is: lines.isPlayer, read: lines.fromPlayer },
  { is: lines.isDpSlam, read: lines.fromDpSlam },
  { is: lines.isRplidar, read: lines.fromRplidar },
  { is: lines.isListener, read: lines.fromListener },
  { is: lines.isAria, read: lines.fromAria },
];

/** Those that lie in tables as well: what has another reader by its columns is none of them. */
const TABLE_KINDS: readonly Kind[] = [
  { is: lines.isNeato, read: lines.fromNeato },
  { is: isNumberedPoints, read: (text, _, tell) => whole(readNumberedPoints(text), 'lines', tell) },
  {
    is: (head) => isLdrobot(bytesOfHex(head) ?? new Uint8Array()),
    read: (text, _, tell) => whole(readLdrobot(bytesOfHex(text) ?? new Uint8Array()), 'packets', tell),
  },
  { is: (head) => kindOfLines(head) !== null, read: (text, _, tell) => whole(readLines(text), 'lines', tell) },
];

/** What reads a table that begins like this and whose columns are no ranges; null where it is none of these. */
export function tableScanReader(head: string): Reader | null {
  return readerAmong(TABLE_KINDS, head);
}

/**
 * What reads a text that begins like this; null where it is none of these.
 * @param isPath whether it is called a path or a camera: lists without names are none of scans then
 */
export function scanReader(head: string, isPath = false): Reader | null {
  const reader = readerAmong(KINDS, head) ?? tableScanReader(head) ?? angleDistanceReader(head);
  return reader ?? (!isPath && isNumberLists(head) ? writing(readJson) : null);
}

function readerAmong(kinds: readonly Kind[], head: string): Reader | null {
  const kind = kinds.find(({ is }) => is(head));
  return kind ? writing(kind.read) : null;
}

function writing(read: Kind['read']): Reader {
  return (text, name, tell) => written(read(text, name, tell), name, tell);
}

/** SICK's telegrams in bytes. */
export function fromSick(telegrams: Uint8Array, name: string, tell: Tell) {
  return written(whole(readSickBinary(telegrams), 'telegrams', tell), name, tell);
}

/** Packets of LDROBOT's lasers. */
export function fromLdrobot(bytes: Uint8Array, name: string, tell: Tell) {
  return written(whole(readLdrobot(bytes), 'packets', tell), name, tell);
}

/** The scans; how many parts of the file are broken is told. */
function whole({ scans, numBroken }: { scans: Scan[]; numBroken: number }, parts: string, tell: Tell) {
  if (numBroken > 0) tell(`${numBroken} of its ${parts} are cut off or damaged`, true);
  return scans;
}
