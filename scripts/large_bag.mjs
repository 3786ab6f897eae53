// @ts-check
/**
 * A large bag, for measuring and for being stopped: depth and colour images of 640 x 480 pixels, a camera that walks to and
 * fro in a made-up room, with its CameraInfo and reference trajectory.
 */
import { cameraInfo, image, poseStamped, stampAt } from '../tests/cli/bag_messages.mjs';
import { writeDb3, writeMcap } from '../tests/cli/bag_writer.mjs';
import { see } from '../tests/cli/depth_room.mjs';

const [WIDTH, HEIGHT] = [640, 480];
const TOPICS = [
  { name: '/camera/depth/image_raw', type: 'sensor_msgs/msg/Image' },
  { name: '/camera/color/image_raw', type: 'sensor_msgs/msg/Image' },
  { name: '/camera/depth/camera_info', type: 'sensor_msgs/msg/CameraInfo' },
  { name: '/ground_truth', type: 'geometry_msgs/msg/PoseStamped' },
];

/** @param {number} gigabytes @param {number} numViews */
function* messages(gigabytes, numViews) {
  const views = Array.from({ length: numViews }, (_, i) => {
    const share = i / numViews;
    /** @type {import('../tests/cli/depth_room.mjs').Pose} */
    const pose = [0.3 * share, 0, 0.5 * share, 0.5 * share];
    return { pose, ...see(pose, WIDTH, HEIGHT) };
  });
  const bytesPerFrame = 5 * WIDTH * HEIGHT + 1000;
  const numFrames = Math.ceil((gigabytes * 2 ** 30) / bytesPerFrame);
  for (let i = 0; i < numFrames; i += 1) {
    const round = i % (2 * numViews);
    const view = views[round < numViews ? round : 2 * numViews - 1 - round];
    if (!view) continue;
    const stamp = stampAt(1000 + i / 30);
    const time = BigInt(stamp.sec) * 1_000_000_000n + BigInt(stamp.nsec);
    const [x, y, z, yaw] = view.pose;
    const shape = { stamp, width: WIDTH, height: HEIGHT };
    const data = [
      image({ ...shape, encoding: '16UC1', data: new Uint8Array(view.depth.buffer) }),
      image({ ...shape, encoding: 'rgb8', data: view.colours }),
      cameraInfo(stamp, WIDTH, HEIGHT, [WIDTH / 2, WIDTH / 2, WIDTH / 2, HEIGHT / 2]),
      poseStamped(stamp, 'world', [x, y, z, 0, Math.sin(yaw / 2), 0, Math.cos(yaw / 2)]),
    ];
    for (const [topic, bytes] of data.entries()) yield { topic: TOPICS[topic]?.name ?? '', time, data: bytes };
  }
}

/**
 * Writes the bag, message by message.
 * @param {string} path
 * @param {number} gigabytes
 * @param {string} [format] mcap or db3
 * @param {number} [numViews] that are rendered, a second or more each; the walk repeats them to and fro
 */
export function writeLargeBag(path, gigabytes, format = 'mcap', numViews = 40) {
  (format === 'db3' ? writeDb3 : writeMcap)(path, TOPICS, messages(gigabytes, numViews));
}
