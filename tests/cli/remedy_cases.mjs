// @ts-check
/** Inputs that provoke a message with a remedy: on the command line by remedies.test.mjs, on the page by remedies.spec.ts. */
import { greyPng, VIEWS } from './depth_room.mjs';
import { bearings, PLACES, rangesAt } from './layout_room.mjs';

/** A drive of a laser that looks over half a turn and counts its readings clockwise, in another unit than its format has. */
const CLOCKWISE = PLACES.map((place) =>
  rangesAt(place, bearings(181, 90, -1)).map((range) => Math.round(1000 * range)),
);
/** @param {(millimetres: number) => number} valueOf */
const depthImages = (valueOf) =>
  Object.fromEntries(VIEWS.slice(0, 2).map(({ depth }, at) => [`depth_${at}.png`, greyPng(depth.map(valueOf))]));

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
  'inverse depth': {
    files: depthImages((value) => 4e7 / value),
    said: /inverse depth, as disparities.*or set depth_values, if that is wrong/,
    remedy: ['--set', 'depth_values=depth'],
    helps: /depth_0\.png/,
  },
};
