/** The pure parts of the view in space, without a browser. */
import { expect, test } from '@playwright/test';
import { floorLines } from '../../www/src/spatial/floor.js';
import { heightsOf, leveling, NORMAL_UNIT, spread, straightAzimuth } from '../../www/src/spatial/leveling.js';
import { fitted, type Orbit, orbited, panned, STRAIGHT_DOWN, toScreen, zoomedAt } from '../../www/src/views/orbit.js';
import { PointCloud } from '../../www/src/spatial/point-cloud.js';
import { frustumSegments, pathSegments } from '../../www/src/spatial/poses.js';
import { turned, type Vec3 } from '../../www/src/views/vectors.js';

const SIZE = { width: 800, height: 500 };
const VIEWS: Orbit[] = (['perspective', 'orthographic'] as const).flatMap((projection) =>
  [0.3, 1, STRAIGHT_DOWN].map((elevation) => ({
    target: [1, 0.5, -2] as const,
    azimuth: 0.7,
    elevation,
    distance: 6,
    projection,
  })),
);

/** The floor and the ceiling of a room, and two walls, as a camera sees them that looks down by `tilt`. */
function room(tilt: number) {
  const upright: { point: Vec3; normal: Vec3 }[] = [];
  for (let i = 0; i < 40; i++) {
    for (let k = 0; k < 20; k++) {
      const [along, across] = [i / 5, k / 5];
      upright.push({ point: [along - 4, 1.5, across], normal: [0, -1, 0] });
      upright.push({ point: [along - 4, -1.1, across], normal: [0, 1, 0] });
      upright.push({ point: [along - 4, (k / 20) * 2.6 - 1.1, 4], normal: [0, 0, -1] });
    }
  }
  const q = { qx: Math.sin(tilt / 2), qy: 0, qz: 0, qw: Math.cos(tilt / 2) };
  const flat = (pick: 'point' | 'normal') => upright.flatMap((entry) => turned(q, entry[pick]));
  const count = upright.length;
  return {
    positions: new Float32Array(flat('point')),
    normals: Int16Array.from(flat('normal'), (x) => Math.round(NORMAL_UNIT * x)),
    colors: new Uint8Array(3 * count),
    frames: new Uint32Array(count),
  };
}

test('what lies under the cursor stays there while zooming, and moves with the hand while shifting', () => {
  for (const view of VIEWS) {
    // A point of the plane through the target that faces the eye.
    const target = panned(view, SIZE, -120, 60).target;
    const before = toScreen(view, SIZE, target);
    const after = toScreen(zoomedAt(view, SIZE, before?.x ?? 0, before?.y ?? 0, 2.5), SIZE, target);
    expect(after?.x).toBeCloseTo(before?.x ?? 0, 6);
    expect(after?.y).toBeCloseTo(before?.y ?? 0, 6);
    const shifted = toScreen(panned(view, SIZE, 30, -20), SIZE, target);
    expect((shifted?.x ?? 0) - (before?.x ?? 0)).toBeCloseTo(30, 6);
    expect((shifted?.y ?? 0) - (before?.y ?? 0)).toBeCloseTo(-20, 6);
  }
});

test('from above, the first camera looks to the top of the screen and its right is on the right', () => {
  const view: Orbit = {
    target: [0, 0, 0],
    azimuth: 0,
    elevation: STRAIGHT_DOWN,
    distance: 5,
    projection: 'perspective',
  };
  expect(toScreen(view, SIZE, [0, 0, -1])?.y).toBeLessThan(SIZE.height / 2);
  expect(toScreen(view, SIZE, [1, 0, 0])?.x).toBeGreaterThan(SIZE.width / 2);
  expect(orbited(view, 0, -1).elevation).toBe(STRAIGHT_DOWN);
});

test('fitting shows every point within the margin', () => {
  const points: Vec3[] = Array.from({ length: 200 }, (_, i) => [Math.cos(i) * 7, (i % 5) * 0.5, Math.sin(i) * 3]);
  for (const view of VIEWS) {
    const all = fitted(view, points, SIZE, { across: 60, along: 30 });
    for (const point of points) {
      const place = toScreen(all, SIZE, point);
      expect(place?.x).toBeGreaterThanOrEqual(59);
      expect(place?.x).toBeLessThanOrEqual(SIZE.width - 59);
      expect(place?.y).toBeGreaterThanOrEqual(29);
      expect(place?.y).toBeLessThanOrEqual(SIZE.height - 29);
    }
  }
});

test('a camera that looks down sees a level floor all the same', () => {
  for (const tilt of [0, 0.2, -0.3]) {
    const [, up] = leveling(room(tilt), true, 4000);
    const wanted = turned({ qx: Math.sin(tilt / 2), qy: 0, qz: 0, qw: Math.cos(tilt / 2) }, [0, -1, 0]);
    for (let k = 0; k < 3; k++) expect(up[k]).toBeCloseTo(wanted[k] ?? 0, 4);
  }
});

test('the section opens the room: above the camera, below the ceiling', () => {
  const points: Vec3[] = Array.from({ length: 3000 }, (_, i) => {
    const height = [-1.5, 1.1, -1.5 + ((i * 7) % 260) / 100][i % 3] ?? 0;
    return [i % 50, height, i % 37];
  });
  const { floor, top, section } = heightsOf(points, [[0, 0, 0]]);
  expect(floor).toBeCloseTo(-1.5, 1);
  expect(top).toBeCloseTo(1.1, 1);
  expect(section).toBeGreaterThan(0);
  expect(section).toBeLessThan(1);
  // Outdoors trees and walls go on and on: nothing is cut away.
  const outdoors: Vec3[] = points.map(([x, y, z], i) => [x, i % 3 === 0 ? y : 0.2 + ((i * 11) % 700) / 100, z]);
  const open = heightsOf(outdoors, [[0, 0, 0]]);
  expect(open.section).toBe(open.top);
  // A camera under the ceiling: the cut stays below that.
  expect(heightsOf(points, [[0, 1, 0]]).section).toBeLessThan(1);
});

test('a plan that lies askew is turned straight, its long side across', () => {
  const askew: Vec3[] = Array.from({ length: 600 }, (_, i) => {
    const [long, short] = [(i % 60) / 6 - 5, Math.floor(i / 60) / 3 - 1.5];
    return [long * Math.cos(0.4) + short * Math.sin(0.4), 0, short * Math.cos(0.4) - long * Math.sin(0.4)];
  });
  expect(straightAzimuth(askew, true)).toBeCloseTo(0.4, 1);
  expect(straightAzimuth(askew, false)).toBeCloseTo(0.4 - Math.PI / 2, 1);
});

test('squares on the floor are a metre wide, ten where the map is large', () => {
  const corners = (side: number): Vec3[] => [
    [0, 0, 0],
    [side, 2, side],
  ];
  expect(floorLines(corners(8), 0)).toEqual({ x0: -1, x1: 9, z0: -1, z1: 9, step: 1 });
  expect(floorLines(corners(300), 0).step).toBe(10);
});

test('an extent leaves out the outermost hundredth on either side', () => {
  for (const count of [0, 1, 2, 99, 100, 250, 1530]) {
    const values = Array.from({ length: count }, (_, i) => ((i * 7919) % 1009) / 10 - 40);
    const sorted = values.toSorted((a, b) => a - b);
    const cut = Math.floor(count / 100);
    expect(spread(values)).toBe((sorted[count - 1 - cut] ?? 0) - (sorted[cut] ?? 0));
  }
});

test('a path bridges poses that are not known, and a frustum has eight edges', () => {
  expect(pathSegments([[0, 0, 0], null, [1, 0, 0], [2, 0, 0]]).map(([from, to]) => [from[0], to[0]])).toEqual([
    [0, 1],
    [1, 2],
  ]);
  const camera = { width: 4, height: 4, fx: 2, fy: 2, cx: 2, cy: 2 };
  const edges = frustumSegments({ x: 1, y: 2, z: 3, qx: 0, qy: 0, qz: 0, qw: 1 }, camera, 0.5);
  expect(edges).toHaveLength(8);
  expect(edges[0]?.[1]).toEqual([0.5, 1.5, 3.5]);
});

test('points on the card: room is made by doubling, and given back where there are none', () => {
  const cloud = new PointCloud();
  const drawn = () => cloud.object.geometry.drawRange.count;
  const room_made = () => cloud.object.geometry.getAttribute('position')?.count ?? 0;
  const points = room(0);
  const count = points.positions.length / 3;
  const none = { ...points, positions: new Float32Array() };
  cloud.set(points);
  expect(drawn()).toBe(count);
  expect(room_made()).toBeGreaterThanOrEqual(count);
  cloud.set(none);
  expect([drawn(), room_made()]).toEqual([0, 0]);
  cloud.set(points);
  expect(drawn()).toBe(count);
  expect(cloud.object.geometry.getAttribute('position').array.slice(0, 3)).toEqual(points.positions.slice(0, 3));
});
