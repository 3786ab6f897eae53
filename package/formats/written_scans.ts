/** Scans as text that the engine reads: JSON objects with `readings` (CSM), or a table of ranges where nothing tells the angles. */
import { fileError } from '../base/errors.js';
import { given, type Scan } from './scan.js';
import { checkedScans, type Tell } from './scan_checks.js';

export function written(found: readonly Scan[], name: string, tell: Tell) {
  if (found.length === 0) {
    throw fileError(name, 'It contains no complete scan', 'Give messages with angle_min, angle_increment and ranges');
  }
  const scans = checkedScans(found, name, tell);
  if (scans.some(({ mayBeMirrored }) => mayBeMirrored)) {
    tell(
      'its angles are taken to grow counter-clockwise; of a laser that turns clockwise, as RPLIDAR, YDLIDAR and LDROBOT do, the map is mirrored: then set laser_direction=mirrored',
    );
  }
  const hasAngles = scans.every(({ angles, start, step }) => angles !== undefined || (start !== undefined && step));
  if (!hasAngles && scans.some(({ start }) => start !== undefined)) {
    throw fileError(name, 'All its readings have the same angle', 'Give angle_min, angle_max and angle_increment');
  }
  return hasAngles ? scans.map(asCsm).join('') : asTable(scans);
}

function asCsm({ ranges, angles, start = 0, step = 0, time, nearest, farthest, odometry, mayBeMirrored }: Scan) {
  const whole = {
    readings: ranges.map((range) => (range !== null && farthest !== undefined && range > farthest ? null : range)),
    ...(angles ? { theta: angles } : { min_theta: start, max_theta: start + step * (ranges.length - 1) }),
    ...given('min_range', nearest),
    ...given('timestamp', time),
    ...(odometry ? { odometry } : {}),
    ...(mayBeMirrored && { may_be_mirrored: true }),
  };
  return `${JSON.stringify(whole)}\n`;
}

/** A table without angles: the import dialog asks for them. */
function asTable(scans: readonly Scan[]) {
  const hasTimes = scans.every(({ time }) => time !== undefined);
  const [{ ranges: first } = { ranges: [] }] = scans;
  const head = [...(hasTimes ? ['time'] : []), ...first.map((_, at) => `range_${at}`)].join(',');
  const rows = scans.map(({ ranges, time }) =>
    [...(hasTimes ? [time] : []), ...ranges.map((r) => r ?? 'nan')].join(','),
  );
  return `${[head, ...rows].join('\n')}\n`;
}
