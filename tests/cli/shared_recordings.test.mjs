// @ts-check
/** Every recording of the shared data is read at once, and how many frames it has; what is none is told of. */
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { test } from 'node:test';
import * as engine from '../../npm/index.js';
import { readAs } from '../../scripts/recordings.mjs';
import { DATA, skipWithoutData as skip } from './support.mjs';

/** Path, what it is read as, frames. @type {readonly (readonly [string, import('../../npm/files/recording.js').Recording['kind'], number])[]} */
const RECORDINGS = [
  ['laser/zju10', 'planar_scans', 10],
  ['laser/fr079', 'planar_scans', 1464],
  ['laser/boxes', 'planar_scans', 2],
  ['laser/csm/failure2.json', 'planar_scans', 2],
  ['laser/csm/mbicp_datos.off', 'planar_scans', 2],
  ['laser/csm/raytracer_test01-scans.json', 'planar_scans', 1],
  ['laser/csm/stallo2_pair.json', 'planar_scans', 2],
  ['laser/radish/belgioioso.log', 'planar_scans', 395],
  ['laser/radish/edmonton.log', 'planar_scans', 340],
  ['laser/radish/freiburg-101.log', 'planar_scans', 292],
  ['laser/radish/infinite-corridor.log', 'planar_scans', 1941],
  ['laser/ros1_bag', 'planar_scans', 102],
  ['laser/ros2_scan_bag', 'planar_scans', 577],
  ['laser/text/breezyslam_exp1.dat', 'planar_scans', 756],
  ['laser/text/cmu_wean_robotdata1.log', 'planar_scans', 713],
  ['laser/text/lidar0f.csv', 'planar_scans', 1],
  ['laser/text/lidar1f.csv', 'planar_scans', 1],
  ['laser/text/rostopic_scan.csv', 'planar_scans', 199],
  ['laser/text/rostopic_odom.csv', 'nothing', 0],
  ['laser/text/cmu_wean_format.txt', 'nothing', 0],
  ['rgbd/apartment_first_floor', 'depth_images', 80],
  ['rgbd/apartment_second_floor', 'depth_images', 123],
  ['rgbd/fusion_demo50', 'depth_images', 50],
  ['rgbd/redwood5', 'depth_images', 5],
  ['rgbd/kinect_office', 'depth_images', 150],
  ['rgbd/d435_robot', 'depth_images', 120],
  ['rgbd/kinect_pioneer', 'depth_images', 50],
  ['rgbd/habitat_16bit', 'depth_images', 80],
  ['lidar/car_cloud', 'clouds', 2],
  ['lidar/kitti_pair', 'clouds', 2],
  ['lidar/pcl_room', 'clouds', 2],
  ['lidar/pcl_pairwise', 'clouds', 5],
  ['bags/derived_depth_pointcloud/depth_16UC1_db3', 'depth_images', 10],
  ['bags/derived_depth_pointcloud/depth_32FC1_mcap', 'depth_images', 10],
  ['bags/derived_depth_pointcloud/pointcloud2_kitti_pair_db3', 'clouds', 2],
  ['bags/derived_depth_pointcloud/pointcloud2_kitti_pair_mcap', 'clouds', 2],
  ['bags/nav2_turtlebot.mcap', 'nothing', 0],
  ['bags/rosbag2_resources/mcap_talker', 'nothing', 0],
  ['bags/rosbag2_resources/sqlite3_wrong_rmw_test', 'nothing', 0],
];

await engine.load();

for (const [path, kind, frames] of RECORDINGS) {
  test(`${path}: ${frames === 0 ? 'told of' : `${kind}, ${frames}`}`, { skip }, async () => {
    const found = await readAs(join(DATA, path));
    assert.deepEqual(found.complaints, []);
    assert.equal(found.kind, kind);
    assert.equal(found.frames, frames);
    assert.ok(frames > 0 || found.notes.length > 0);
  });
}
