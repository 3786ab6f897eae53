// @ts-check
/** What a topic of a bag can be used as. */

/** @typedef {'depth' | 'color' | 'camera' | 'clouds' | 'scans' | 'odometry' | 'reference'} Role */

/** @type {readonly Role[]} */
export const ROLES = Object.freeze(['depth', 'color', 'camera', 'clouds', 'scans', 'odometry', 'reference']);
