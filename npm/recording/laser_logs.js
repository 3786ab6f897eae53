// @ts-check
/** Logs of laser scans, many in one file: which files are such, and which tell the odometry to them. */
import { latin1 } from './heads.js';

/** Words that begin a line of a CARMEN log, or of what pose graph tools made of one. */
const CARMEN_WORDS = /^(FLASER|ROBOTLASER1|RAWLASER1|ODOM|PARAM|VERTEX2|EDGE2|SYNC|RLASER)\s/;

/**
 * Whether a file that begins like this is a laser log: CARMEN's text, or CSM's JSON.
 * @param {Uint8Array} head a few kilobytes
 */
export function isLaserLog(head) {
  if (head.includes(0)) return false;
  const text = latin1(head)
    .replace(/^\xef\xbb\xbf/, '')
    .trimStart();
  if (/^[[{]/.test(text)) return /"readings"/.test(text) || (/"nrays"/.test(text) && /"min_theta"/.test(text));
  const lines = text.split(/[\r\n]+/).filter((line) => line.trim() !== '' && !/^\s*#/.test(line));
  return lines.slice(0, 3).some((line) => CARMEN_WORDS.test(line.trimStart()));
}

/**
 * Whether a file of numbers is called odometry.
 * @param {string} path
 */
export function isOdometryName(path) {
  return /odom/i.test(path.split('/').at(-1) ?? '');
}
