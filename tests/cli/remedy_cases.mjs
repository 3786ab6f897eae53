// @ts-check
/** Inputs that provoke a message with a remedy: on the command line by remedies.test.mjs, on the page by remedies.spec.ts. */
import { greyPng, see, SIZE, VIEWS } from './depth_room.mjs';
import { bearings, PLACES, rangesAt } from './layout_room.mjs';
import { roomCloud } from './room_clouds.mjs';

/** A drive of a laser that looks over half a turn and counts its readings clockwise, in another unit than its format has. */
const CLOCKWISE = PLACES.map((place) =>
  rangesAt(place, bearings(181, 90, -1)).map((range) => Math.round(1000 * range)),
);
/** @param {(millimetres: number) => number} valueOf */
const depthImages = (valueOf) =>
  Object.fromEntries(VIEWS.slice(0, 2).map(({ depth }, at) => [`depth_${at}.png`, greyPng(depth.map(valueOf))]));

/** The middle of images of a right angle: their focal length is 1.14 times that of images of a right angle of this size. */
const NARROW = 168;
/** @param {Uint16Array} depth */
function narrowed(depth) {
  const border = (SIZE - NARROW) / 2;
  const row = (/** @type {number} */ at) => depth.subarray((border + at) * SIZE + border).subarray(0, NARROW);
  return Uint16Array.from(Array.from({ length: NARROW }, (_, at) => [...row(at)]).flat());
}
const NARROW_IMAGES = Object.fromEntries(
  [0, 0.12, 0.24, 0.36, 0.48, 0.6].map((yaw, at) => {
    const { depth } = see([0.05 * at, 0.01 * at, 0.04 * at, yaw]);
    return [`depth_${at}.png`, greyPng(narrowed(depth), NARROW)];
  }),
);
/** No depth is larger (mm). */
const CUT_OFF = 2500;
/** @param {number} number */
const inCentimetres = (number) =>
  roomCloud(number).replaceAll(/-?\d+\.\d{4}/g, (metres) => (100 * Number(metres)).toFixed(2));

/** @type {Record<string, { files: Record<string, string | Uint8Array>, said: RegExp, remedy: string[], helps: RegExp }>} */
export const REMEDY_CASES = {
  'a log that does not keep to its format, with bearings that fall': {
    files: {
      'log.json': CLOCKWISE.map(
        (readings) =>
          `${JSON.stringify({ nrays: 181, min_theta: 90, max_theta: -90, readings: readings.toReversed() })}\n`,
      ).join(''),
    },
    said: /if clockwise, set laser_direction=mirrored/,
    remedy: ['--set', 'laser_direction=mirrored'],
    helps: /#7 +0\.840 +0\.420 +16\.04 .* good/,
  },
  'columns without names': {
    files: { 'scans.txt': CLOCKWISE.map((readings) => `${readings.join(' ')}\n`).join('') },
    said: /the map is mirrored: give step=-1deg,start=90deg/,
    remedy: ['--table', 'step=-1deg,start=90deg'],
    helps: /#7 +0\.840 +0\.420 +16\.04 .* good/,
  },
  'depth that is taken for inverted': {
    files: depthImages((value) => 65_535 - 6 * value),
    said: /taken for inverted.*If that is wrong, set depth_values=depth/s,
    remedy: ['--set', 'depth_values=depth'],
    helps: /depth_0\.png/,
  },
  'a narrower view than rendered images have': {
    files: NARROW_IMAGES,
    said: /The frames fit each other best with a focal length of about 9[5-7] pixels, not with the 84 .*: set fx=9/,
    remedy: ['--set', 'fx=96'],
    helps: /6 good/,
  },
  'depth that is cut off': {
    files: Object.fromEntries(
      [0, 0.06, 0.12, 0.18].map((yaw, at) => {
        const { depth } = see([0.05 * at, 0.01 * at, 0.04 * at, yaw]);
        return [`depth_${at}.png`, greyPng(depth.map((value) => Math.min(value, CUT_OFF)))];
      }),
    ),
    said: /cut off at 2\.50 m.*set max_range=2\.499/s,
    remedy: ['--set', 'max_range=2.499'],
    helps: /4 good/,
  },
  'clouds in centimetres': {
    files: { '0.ply': inCentimetres(0), '1.ply': inCentimetres(1) },
    said: /No file says the unit of the clouds' coordinates/,
    remedy: ['--set', 'cloud_unit=0.01'],
    helps: /Clouds: a unit is 0\.01 m\n/,
  },
  'a number a line': {
    files: {
      'ranges.txt': `${rangesAt([0, 0, 0], bearings(181, -90, 1))
        .map((range) => range.toFixed(3))
        .join('\n')}\n`,
    },
    said: /may make one scan of 181 readings, .* if they do, give --table range=1,unit=m,start=-90deg,step=1deg/,
    remedy: ['--table', 'range=1,unit=m,start=-90deg,step=1deg'],
    helps: /1 scan in/,
  },
  'inverse depth': {
    files: depthImages((value) => 4e7 / value),
    said: /inverse depth, as disparities.*or set depth_values, if that is wrong/,
    remedy: ['--set', 'depth_values=depth'],
    helps: /depth_0\.png/,
  },
};
