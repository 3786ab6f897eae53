// @ts-check
/** Bags of robots with which something is wrong or missing: each is told with the topic, what is wrong, and what to do or what was done. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { openRecording } from '../../npm/recording_reader.js';
import { mcapBytes } from './bag_files.mjs';
import { cameraInfo, image, laserScan, odometry, pointCloud, stampAt, transforms } from './bag_messages.mjs';

/** @typedef {import('./bag_writer.mjs').TopicToWrite} TopicToWrite @typedef {import('./bag_writer.mjs').MessageToWrite} MessageToWrite */
/** @typedef {{ topic: TopicToWrite, messages: MessageToWrite[] }} Told */
/** @typedef {[number, number, number, number, number, number, number]} Pose */

const COUNT = 4;
const nanoseconds = (/** @type {number} */ seconds) => BigInt(Math.round(seconds * 1e9));
const AT_ORIGIN = /** @type {Pose} */ ([0, 0, 0, 0, 0, 0, 1]);

/**
 * Messages of a topic, a tenth of a second apart from 100 s on.
 * @param {string} name @param {string} type @param {(time: number, index: number) => Uint8Array} encode @param {string} [format]
 * @returns {Told}
 */
function topic(name, type, encode = () => new Uint8Array(64), format = 'cdr') {
  const messages = Array.from({ length: COUNT }, (_, index) => {
    const seconds = 100 + index / 10;
    return { topic: name, time: nanoseconds(seconds), data: encode(seconds, index) };
  });
  return { topic: { name, type, format }, messages };
}

/** @type {[string, number, number][]} */
const XYZ = [['x', 0, 7], ['y', 4, 7], ['z', 8, 7]]; // prettier-ignore
/** @param {string} [name] @param {{ stamp?: (time: number) => number, changes?: Partial<Parameters<typeof pointCloud>[0]> }} [options] */
function clouds(name = '/points', { stamp = (time) => time, changes = {} } = {}) {
  return topic(name, 'sensor_msgs/msg/PointCloud2', (time) =>
    pointCloud({
      ...{ stamp: stampAt(stamp(time)), width: 4, fields: XYZ, pointStep: 12, data: new Uint8Array(48) },
      ...changes,
    }),
  );
}

const RANGES = [1, 1.1, 1.2, 1.3];
/** @param {string} [name] @param {string} [frame] */
const scans = (name = '/scan', frame = 'laser', step = 0.1, limits = /** @type {[number, number]} */ ([0.1, 9])) =>
  topic(name, 'sensor_msgs/msg/LaserScan', (time) => laserScan(stampAt(time), 0, step, limits, RANGES, frame));

/** @param {Partial<Parameters<typeof image>[0]>} [changes] */
const depth = (name = '/camera/depth/image_raw', changes = {}) =>
  topic(name, 'sensor_msgs/msg/Image', (time) =>
    image({
      ...{ stamp: stampAt(time), width: 4, height: 3, encoding: '16UC1', data: new Uint8Array(24).fill(7) },
      ...changes,
    }),
  );
const camera = (width = 4, height = 3) =>
  topic('/camera/depth/camera_info', 'sensor_msgs/msg/CameraInfo', (time) =>
    cameraInfo(stampAt(time), width, height, [4, 4, 2, 1.5]),
  );
const wheels = (child = 'base') =>
  topic('/odom', 'nav_msgs/msg/Odometry', (time) => odometry(stampAt(time), 'odom', child, AT_ORIGIN));
/** @param {[parent: string, child: string, pose?: Pose][]} frames */
const tf = (frames, name = '/tf_static') =>
  topic(name, 'tf2_msgs/msg/TFMessage', (time) =>
    transforms(frames.map(([parent, child, pose = AT_ORIGIN]) => [stampAt(time), parent, child, pose])),
  );

/** @type {Record<string, { told: Told[], said: RegExp[], kind?: string }>} */
const CASES = {
  'packets of a Velodyne alone': {
    told: [topic('/velodyne_packets', 'velodyne_msgs/msg/VelodyneScan')],
    said: [
      /robot\.mcap: not used: \/velodyne_packets .*packets of a Velodyne.*velodyne_pointcloud, and record \/velodyne_points/,
    ],
    kind: 'nothing',
  },
  'packets of an Ouster with its gyro': {
    told: [
      topic('/ouster/lidar_packets', 'ouster_sensor_msgs/msg/PacketMsg'),
      topic('/ouster/imu', 'sensor_msgs/msg/Imu'),
    ],
    said: [
      /\/ouster\/lidar_packets .*packets of an Ouster.*record \/ouster\/points/,
      /\/ouster\/imu: not used: it helps to register clouds/,
    ],
    kind: 'nothing',
  },
  'packets of a Hesai': {
    told: [topic('/lidar_packets', 'hesai_ros_driver/msg/UdpFrame')],
    said: [/packets of a Hesai.*hesai_ros_driver, and record \/lidar_points/],
    kind: 'nothing',
  },
  'packets of a RoboSense': {
    told: [topic('/rslidar_packets', 'rslidar_msg/msg/RslidarPacket')],
    said: [/packets of a RoboSense.*rslidar_sdk, and record \/rslidar_points/],
    kind: 'nothing',
  },
  'clouds of the old type': {
    told: [topic('/cloud', 'sensor_msgs/msg/PointCloud')],
    said: [/\/cloud .*clouds of the old type.*convert them to sensor_msgs\/PointCloud2/],
    kind: 'nothing',
  },
  'disparities and films': {
    told: [
      topic('/stereo/disparity', 'stereo_msgs/msg/DisparityImage'),
      topic('/film', 'ffmpeg_image_transport_msgs/msg/FFMPEGPacket'),
    ],
    said: [/\/stereo\/disparity .*stereo_image_proc and record \/points2/, /\/film .*image_transport republish/],
    kind: 'nothing',
  },
  'a finished map': {
    told: [topic('/map', 'nav_msgs/msg/OccupancyGrid')],
    said: [/\/map .*finished maps.*map_saver_cli and open map\.yaml under Localize/],
    kind: 'nothing',
  },
  'clouds serialised by another library': {
    told: [topic('/points', 'foxglove.PointCloud', undefined, 'protobuf')],
    said: [/\/points .*serialised as protobuf.*record it with the default middleware/],
    kind: 'nothing',
  },
  'several lidars with their mounting': {
    told: [
      clouds('/front/points', { changes: { frame: 'front' } }),
      clouds('/rear/points', { changes: { frame: 'rear' } }),
      tf([
        ['base', 'front'],
        ['base', 'rear', [-1, 0, 0, 0, 0, 1, 0]],
      ]),
    ],
    said: [
      /\/front\/points: one sensor is used at a time, this one; not used: \/rear\/points \(frame rear\)\. Choose it as clouds/,
    ],
    kind: 'clouds',
  },
  'several laser scanners': {
    told: [scans('/scan_front', 'front'), scans('/scan_rear', 'rear')],
    said: [/\/scan_front: one sensor.*not used: \/scan_rear \(frame rear\)\. Choose it as scans/],
    kind: 'planar_scans',
  },
  'a lidar whose mounting nobody tells': {
    told: [scans(), wheels()],
    said: [
      /\/odom: there is no static transform from base to the sensor's frame, laser: the trajectory of base is used/,
    ],
  },
  'a frame that lies in two': {
    told: [
      scans(),
      wheels(),
      tf([
        ['base', 'laser'],
        ['mast', 'laser'],
      ]),
    ],
    said: [/\/tf_static: laser is said to lie in base and in mast: the first is used \(4 times\)/],
  },
  'transforms that are none': {
    told: [scans(), wheels(), tf([['base', 'laser', [0, 0, 0, 0, 0, 0, 0]]])],
    said: [
      /\/tf_static: the transform from base to laser is not finite, or has no unit quaternion \(4 times\)/,
      /\/odom: there is no static transform/,
    ],
  },
  'transforms that do not carry the sensor': {
    told: [clouds(), tf([['odom', 'base']], '/tf')],
    said: [/\/tf: not used: it gives no trajectory of the sensor's frame, lidar/],
  },
  'times that are not set': {
    told: [clouds('/points', { stamp: () => 0 })],
    said: [/\/points: the times in its headers are not set: the times of recording are used/],
  },
  'a time that is not set once': {
    told: [clouds('/points', { stamp: (time) => (time === 100 ? 0 : time) })],
    said: [/\/points: 1 message left out: the time in the header is not set/],
  },
  'times that run backwards': {
    told: [clouds('/points', { stamp: (time) => (time > 100.25 ? 100.15 : time) })],
    said: [/\/points: time runs backwards at 1 message; all are taken in the order of their times/],
  },
  'a clock that was set': {
    told: [clouds('/points', { stamp: (time) => (time > 100.25 ? time - 50 : time) })],
    said: [/\/points: time jumps back once, as where a clock is set: the times of recording are used/],
  },
  'messages that came seconds late': {
    told: [clouds('/points', { stamp: (time) => 100 + ([30, 0, 20, 10][Math.round(10 * (time - 100))] ?? 0) })],
    said: [/\/points: time runs backwards at 3 messages; all are taken in the order of their times/],
  },
  'times that begin anew': {
    told: [clouds('/points', { stamp: (time) => 100 + (Math.round(20 * (time - 100)) % 6) })],
    said: [/\/points: time jumps back once; the longest stretch is used, 3 of 4 messages/],
  },
  'one time for all': {
    told: [clouds('/points', { stamp: () => 100 })],
    said: [/\/points: 3 messages left out: another one has the same time/],
  },
  'colours by another clock': {
    told: [
      depth(),
      camera(),
      depth('/camera/color/image_raw', { encoding: 'rgb8', data: new Uint8Array(36), stamp: stampAt(1.7e9) }),
    ],
    said: [/\/camera\/color\/image_raw: none of its times lies within 0\.02 s of a depth image: .*without colours/],
  },
  'a camera of other images': {
    told: [depth(), camera(640, 400)],
    said: [/\/camera\/depth\/camera_info: describes images of 640 x 400 pixels, and the depth has 4 x 3; not used/],
  },
  'a camera of larger images': {
    told: [depth(), camera(640, 480)],
    said: [/camera_info: describes images of 640 x 480 pixels, and the depth has 4 x 3: it is scaled to these/],
  },
  'depth without its camera': {
    told: [depth()],
    said: [/no CameraInfo.*in a file beside the bag, or set field_of_view/],
  },
  'pictures alone': {
    told: [depth('/camera/color/image_raw', { encoding: 'rgb8', data: new Uint8Array(36) })],
    said: [/\/camera\/color\/image_raw: not used: pictures without depth images.*ros2 bag record .*depth/],
    kind: 'nothing',
  },
  'clouds without a height': {
    told: [clouds('/points', { changes: { fields: XYZ.slice(0, 2) } })],
    said: [/\/points .*its points have no x, y and z/],
    kind: 'nothing',
  },
  'clouds shorter than they say': {
    told: [clouds('/points', { changes: { width: 9, rowStep: 108 } })],
    said: [
      /clouds\/100\.000000000\.pcd: Message 1 of \/points: The cloud is shorter than its header says: 9 x 1 points/,
    ],
  },
  'angles in no unit': {
    told: [scans('/scan', 'laser', 900)],
    said: [/scan\.log: None of its scans can be read\..*cover 154699 degrees: its angles are not in radians/],
  },
  'limits that leave no reading': {
    told: [scans('/scan', 'laser', 0.1, [9, 0.1])],
    said: [/None of its scans can be read\. .*No reading can lie between the scan's range_min, 9/],
  },
  'a laser that hangs upside down': {
    told: [scans(), wheels(), tf([['base', 'laser', [0, 0, 0, 1, 0, 0, 0]]])],
    said: [/\/scan: laser hangs upside down by \/tf: its readings are turned over/],
  },
};

/** All that is said of a bag when it is opened and read. @param {Told[]} told */
async function saidOf(told) {
  const bytes = mcapBytes(
    told.map(({ topic }) => topic),
    told.flatMap(({ messages }) => messages),
  );
  const recording = await openRecording([{ path: 'robot.mcap', blob: new Blob([bytes]) }]);
  const notes = recording.notes.map(({ file, reason }) => `${file}: ${reason}`);
  const frames = [...recording.scans, ...recording.clouds, ...recording.depth_frames.map(({ depth }) => depth)];
  const read = await Promise.allSettled(frames.map((path) => recording.read(path)));
  const faults = read.flatMap((one) => (one.status === 'rejected' ? [String(one.reason.message)] : []));
  return { kind: recording.kind, said: [...notes, ...faults].join('\n') };
}

for (const [name, { told, said, kind }] of Object.entries(CASES)) {
  test(`${name}: told with what to do`, async () => {
    const opened = await saidOf(told);
    for (const one of said) assert.match(opened.said, one);
    if (kind !== undefined) assert.equal(opened.kind, kind);
  });
}

test('a bag with which nothing is wrong is not talked about', async () => {
  const { said } = await saidOf([scans(), wheels(), tf([['base', 'laser']])]);
  assert.equal(said, '');
});
