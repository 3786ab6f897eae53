/** Types of messages that hold what a map could be made of, in a form that is not read: what they are, and how to get one that is. */

const played = (driver: string, topic: string) => `play the bag through the driver, ${driver}, and record ${topic}`;

const UNREAD: readonly (readonly [type: RegExp, what: string, remedy: string])[] = [
  [/^velodyne_msgs\//, 'packets of a Velodyne', played('velodyne_pointcloud', '/velodyne_points')],
  [/^ouster(_sensor)?_(msgs|ros)\/msg\/PacketMsg$/, 'packets of an Ouster', played('ouster_ros', '/ouster/points')],
  [/^(hesai|pandar)\w*\//, 'packets of a Hesai', played('hesai_ros_driver', '/lidar_points')],
  [/^rslidar_msgs?\//, 'packets of a RoboSense', played('rslidar_sdk', '/rslidar_points')],
  [
    /^sensor_msgs\/msg\/PointCloud$/,
    'clouds of the old type',
    'convert them to sensor_msgs/PointCloud2 and record that',
  ],
  [
    /^stereo_msgs\/msg\/DisparityImage$/,
    'disparities of two cameras',
    'run point_cloud_node of stereo_image_proc and record /points2',
  ],
  [
    /^(theora_image_transport|ffmpeg_image_transport_msgs|foxglove_msgs\/msg\/CompressedVideo)/,
    'films',
    'turn them into images with ros2 run image_transport republish',
  ],
  [
    /^nav_msgs\/msg\/OccupancyGrid$/,
    'finished maps',
    'to locate a recording in it, save it with ros2 run nav2_map_server map_saver_cli and open map.yaml under Localize',
  ],
];

/** Why messages of this type are not used, and what to do where something can be done. */
export function whyUnread(type: string) {
  const [, what, remedy] = UNREAD.find(([pattern]) => pattern.test(type)) ?? [];
  return what === undefined ? 'messages of this type are not used' : `${what}, which are not read: ${remedy}`;
}
