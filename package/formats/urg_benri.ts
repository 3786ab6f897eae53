/** UrgBenri's log (`.ubh`): sections in square brackets, their values below them. */
import { given, type Scan } from './scan.js';

/** Smallest range of Hokuyo's lasers (mm): values below it are error codes. */
const FIRST_RANGE_OF_URG = 20;

export function isUrgBenri(head: string) {
  return /^\[startStep\]/m.test(head) && /^\[(scan|endStep)\]/m.test(head);
}

/** Sections in square brackets, their values below them. */
export function readUrgBenri(text: string) {
  const known: Map<string, number> = new Map();
  const scans: Scan[] = [];
  let section = '';
  for (const line of text.split(/\r?\n/).map((line) => line.trim())) {
    const title = /^\[(\w+)\]$/.exec(line)?.[1];
    if (title !== undefined) section = title.toLowerCase();
    else if (section === 'scan' && line.includes(';')) {
      const ranges = line.split(/[;|]/).filter(Boolean).map(Number);
      const [turn, front] = [known.get('areatotal') ?? 1440, known.get('frontstep') ?? (ranges.length - 1) / 2];
      const step = (2 * Math.PI) / turn;
      const time = known.get('timestamp');
      scans.push({
        ranges: ranges.map((range) => (range >= FIRST_RANGE_OF_URG ? 1e-3 * range : null)),
        start: ((known.get('startstep') ?? 0) - front) * step,
        step,
        ...given('time', time === undefined ? undefined : 1e-3 * time),
      });
    } else if (line !== '' && Number.isFinite(Number(line))) known.set(section, Number(line));
  }
  return scans;
}
