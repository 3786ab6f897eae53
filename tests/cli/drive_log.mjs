// @ts-check
/** A robot that drives through a building: its log, its odometry, and the building's map. */

/** Corners of a building: a corridor with two different recesses that bends into a room. */
export const BUILDING = '0,0 6,0 6,-1 7.5,-1 7.5,0 12,0 12,6 9,6 9,4 10,4 10,2 4,2 4,3.2 2.2,3.2 2.2,2 0,2';
/** A round hall of another one. */
export const HALL = '3,-4 8,-3 10,1 8,6 3,7 -1,5 -3,1 -1,-3';

/** Both ends of each wall (m). @param {string} building */
function wallsOf(building) {
  const corners = building.split(' ').map((corner) => corner.split(',').map(Number));
  return corners.map((corner, index) => [corner, corners[(index + 1) % corners.length] ?? corner]);
}

/** Side of a cell of a floor plan, and what is around the building (m). */
const [CELL, MARGIN] = [0.05, 1];

/** The map of a building as map_server has it: free inside, and unknown outside. @param {string} building */
export function floorPlan(building) {
  const walls = wallsOf(building);
  const [xs, ys] = [0, 1].map((axis) => walls.map(([corner]) => corner?.[axis] ?? 0));
  const [left, bottom] = [xs, ys].map((values) => Math.min(...(values ?? [])) - MARGIN);
  const [width, height] = [xs, ys].map((values) =>
    Math.round((Math.max(...(values ?? [])) - Math.min(...(values ?? [])) + 2 * MARGIN) / CELL),
  );
  const cells = Buffer.alloc((width ?? 0) * (height ?? 0));
  for (let i = 0; i < cells.length; i++) {
    const [x, y] = [i % (width ?? 1), (height ?? 0) - 1 - Math.floor(i / (width ?? 1))].map(
      (cell) => (cell + 0.5) * CELL,
    );
    const place = [(left ?? 0) + (x ?? 0), (bottom ?? 0) + (y ?? 0)];
    const isWall = walls.some(([from, to]) => distance(place, from ?? [], to ?? []) <= CELL / 2);
    cells[i] = isWall ? 0 : isInside(place, walls) ? 254 : 205;
  }
  const pgm = Buffer.concat([Buffer.from(`P5\n${width} ${height}\n255\n`), cells]);
  const yaml = `image: map.pgm\nresolution: ${CELL}\norigin: [${left}, ${bottom}, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n`;
  return { pgm, yaml };
}

/** @param {number[]} place @param {number[]} from @param {number[]} to */
function distance([x = 0, y = 0], [ax = 0, ay = 0], [bx = 0, by = 0]) {
  const [dx, dy] = [bx - ax, by - ay];
  const share = Math.min(Math.max(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy), 0), 1);
  return Math.hypot(ax + share * dx - x, ay + share * dy - y);
}

/** @param {number[]} place @param {number[][][]} walls */
function isInside([x = 0, y = 0], walls) {
  const crossed = walls.filter(([[ax = 0, ay = 0] = [], [bx = 0, by = 0] = []]) => {
    return ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax);
  });
  return crossed.length % 2 === 1;
}

/** Where the robot is after so many scans: x, y (m), heading (rad). @param {number} scan */
export function driveAt(scan) {
  const way = 0.2 * scan;
  const turn = Math.min(Math.max(0, way - 8.5), 1) * (Math.PI / 2);
  return way < 9.5 ? [1 + way, 1, turn] : [10.9, 1 + way - 9.5, turn];
}

/** Its odometry, a line a scan, as rows of index x y heading. @param {number} first @param {number} last */
export function driveOdometry(first, last) {
  return Array.from({ length: last - first }, (_, index) => `${index} ${driveAt(first + index).join(' ')}\n`);
}

/**
 * A robot that drives 20 cm a scan ahead and then to the left, as CARMEN logs it, with its odometry.
 * @param {string} building @param {number} first @param {number} last
 */
export function driveLog(building, first, last) {
  const walls = wallsOf(building);
  /** @param {number[]} at @param {number} angle */
  const rangeFrom = ([x = 0, y = 0], angle) => {
    const [dx, dy] = [Math.cos(angle), Math.sin(angle)];
    const hits = walls.map(([[ax = 0, ay = 0] = [], [bx = 0, by = 0] = []]) => {
      const determinant = dx * (by - ay) - dy * (bx - ax);
      const range = ((ax - x) * (by - ay) - (ay - y) * (bx - ax)) / determinant;
      const share = ((ax - x) * dy - (ay - y) * dx) / determinant;
      return range > 0 && share >= 0 && share <= 1 ? range : Infinity;
    });
    return Math.min(81, ...hits);
  };
  const lines = Array.from({ length: last - first }, (_, index) => {
    const [x = 0, y = 0, turn = 0] = driveAt(first + index);
    const ranges = Array.from({ length: 180 }, (_, beam) => {
      return rangeFrom([x, y], turn + ((beam - 90) * Math.PI) / 180).toFixed(3);
    });
    const pose = `${x.toFixed(3)} ${y.toFixed(3)} ${turn.toFixed(4)}`;
    return `FLASER 180 ${ranges.join(' ')} ${pose} ${pose} ${index} robot ${index}`;
  });
  return `${lines.join('\n')}\n`;
}
