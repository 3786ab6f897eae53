// @ts-check
const COUNT = 12_000;
/** Half of the sides of the room (m), whose middle is 0.3 m above the sensor. */
const HALF = [4, 3, 1.5];

/** A cloud of a lidar in a room of 8 x 6 x 3 m, its floor 1.2 m below the sensor, as a PLY file. @param {number} number */
export function roomCloud(number) {
  const sensor = [0.3 * number, 0, -0.3];
  const points = Array.from({ length: COUNT }, (_, at) => {
    // Evenly over the sphere: Fibonacci's lattice.
    const [z, azimuth] = [1 - (2 * at + 1) / COUNT, at * Math.PI * (3 - Math.sqrt(5)) + number];
    const level = Math.sqrt(1 - z * z);
    const ray = [level * Math.cos(azimuth), level * Math.sin(azimuth), z];
    const along = ray.map((of, axis) => (Math.sign(of) * (HALF[axis] ?? 0) - (sensor[axis] ?? 0)) / of);
    return ray.map((of) => (of * Math.min(...along)).toFixed(4)).join(' ');
  });
  const axes = ['x', 'y', 'z'].map((axis) => `property float ${axis}`).join('\n');
  return `ply\nformat ascii 1.0\nelement vertex ${COUNT}\n${axes}\nend_header\n${points.join('\n')}\n`;
}
