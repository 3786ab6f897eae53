// @ts-check
/** What robots send in a made-up room, as messages. */
import { cameraInfo, image, laserScan, odometry, pointCloud, stampAt } from './bag_messages.mjs';
import { see, SIZE, WALK } from './depth_room.mjs';
import { ROOM_POSES, roomScan } from './support.mjs';

/** @typedef {import('./bag_writer.mjs').TopicToWrite} TopicToWrite @typedef {import('./bag_writer.mjs').MessageToWrite} MessageToWrite */
/** @typedef {{ topics: TopicToWrite[], messages: MessageToWrite[] }} Recorded */

const SECOND = 1_000_000_000n;
const at = (/** @type {number} */ index) => ({ stamp: stampAt(100 + index), time: BigInt(100 + index) * SECOND + 5n });

/** A depth camera with its CameraInfo. @returns {Recorded} */
export function depthWalk() {
  const [depth, camera] = ['/camera/depth/image_rect_raw', '/camera/depth/camera_info'];
  const half = SIZE / 2;
  const messages = WALK.flatMap((pose, index) => {
    const { stamp, time } = at(index);
    const data = new Uint8Array(see(pose).depth.buffer);
    const info = cameraInfo(stamp, SIZE, SIZE, [half, half, half, half]);
    const picture = image({ stamp, width: SIZE, height: SIZE, encoding: '16UC1', data, step: 2 * SIZE });
    return [
      { topic: camera, time, data: info },
      { topic: depth, time, data: picture },
    ];
  });
  const type = (/** @type {string} */ name) => `sensor_msgs/msg/${name}`;
  return {
    topics: [
      { name: depth, type: type('Image') },
      { name: camera, type: type('CameraInfo') },
    ],
    messages,
  };
}

/** What a lidar would see in the same room. @returns {Recorded} */
export function cloudWalk() {
  const topic = '/points';
  const messages = WALK.map((pose, index) => {
    const { stamp, time } = at(index);
    const { depth } = see(pose);
    const points = Float32Array.from({ length: (3 * SIZE * SIZE) / 4 }, (_, number) => {
      const point = Math.floor(number / 3);
      const [u, v] = [(2 * point) % SIZE, 2 * Math.floor((2 * point) / SIZE)];
      const z = (depth[v * SIZE + u] ?? 0) / 1000;
      return [((u - SIZE / 2) / (SIZE / 2)) * z, ((v - SIZE / 2) / (SIZE / 2)) * z, z][number % 3] ?? 0;
    });
    /** @type {[string, number, number][]} */
    const fields = [['x', 0, 7], ['y', 4, 7], ['z', 8, 7]]; // prettier-ignore
    const data = new Uint8Array(points.buffer);
    return { topic, time, data: pointCloud({ stamp, width: points.length / 3, fields, pointStep: 12, data }) };
  });
  return { topics: [{ name: topic, type: 'sensor_msgs/msg/PointCloud2' }], messages };
}

/** A laser and the wheels. @returns {Recorded} */
export function laserDrive() {
  const messages = ROOM_POSES.flatMap((pose, index) => {
    const { stamp, time } = at(index);
    const points = roomScan(pose).split('end_header\n')[1]?.trim().split('\n').map((line) => line.split(' ').map(Number)); // prettier-ignore
    const ranges = (points ?? []).map(([x = 0, y = 0]) => Math.hypot(x, y));
    const [x, y, heading] = pose;
    const wheels = odometry(stamp, 'odom', 'laser', [x, y, 0, 0, 0, Math.sin(heading / 2), Math.cos(heading / 2)]);
    return [
      { topic: '/odom', time, data: wheels },
      { topic: '/scan', time, data: laserScan(stamp, 0, Math.PI / 179, [0.05, 30], ranges) },
    ];
  });
  const topics = [
    { name: '/scan', type: 'sensor_msgs/msg/LaserScan' },
    { name: '/odom', type: 'nav_msgs/msg/Odometry' },
  ];
  return { topics, messages };
}
