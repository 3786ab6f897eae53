/** What a topic of a bag can be used as. */

export type Role = 'depth' | 'color' | 'camera' | 'clouds' | 'scans' | 'imu' | 'odometry' | 'reference';

export const ROLES: readonly Role[] = Object.freeze([
  'depth',
  'color',
  'camera',
  'clouds',
  'scans',
  'imu',
  'odometry',
  'reference',
]);
