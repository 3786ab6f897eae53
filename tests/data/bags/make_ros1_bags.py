"""Makes ros1_none.bag, ros1_bz2.bag and ros1_lz4.bag beside this file: one recording, its chunks packed in three ways.

    pip install rosbags==0.11.9
    python tests/data/bags/make_ros1_bags.py
"""

import math
from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

STORE = get_typestore(Stores.ROS1_NOETIC)
STORE.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
T = STORE.types
FOLDER = Path(__file__).parent


def header(number, time, frame):
    stamp = T["builtin_interfaces/msg/Time"](sec=time // 10**9, nanosec=time % 10**9)
    return T["std_msgs/msg/Header"](seq=number, stamp=stamp, frame_id=frame)


def scan(number, time):
    ranges = np.array([2 + math.sin(0.1 * i + 0.01 * number) for i in range(90)], np.float32)
    return T["sensor_msgs/msg/LaserScan"](
        header=header(number, time, "laser"), angle_min=-1.5, angle_max=1.5, angle_increment=3 / 89,
        time_increment=0.0, scan_time=0.1, range_min=0.1, range_max=10.0, ranges=ranges, intensities=np.zeros(0, np.float32),
    )  # fmt: skip


def pose(number):
    turn = 0.02 * number
    position = T["geometry_msgs/msg/Point"](x=0.1 * number, y=0.0, z=0.0)
    return position, T["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=math.sin(turn / 2), w=math.cos(turn / 2))


def odometry(number, time):
    position, orientation = pose(number)
    vector = T["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
    twist = T["geometry_msgs/msg/Twist"](linear=vector, angular=vector)
    covariance = np.zeros(36)
    posed = T["geometry_msgs/msg/Pose"](position=position, orientation=orientation)
    return T["nav_msgs/msg/Odometry"](
        header=header(number, time, "/odom"), child_frame_id="/base_link",
        pose=T["geometry_msgs/msg/PoseWithCovariance"](pose=posed, covariance=covariance),
        twist=T["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=covariance),
    )  # fmt: skip


def mount(number, time):
    translation = T["geometry_msgs/msg/Vector3"](x=0.2, y=0.0, z=0.3)
    rotation = T["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=1.0, w=0.0)
    transform = T["geometry_msgs/msg/Transform"](translation=translation, rotation=rotation)
    stamped = T["geometry_msgs/msg/TransformStamped"](
        header=header(number, time, "/base_link"), child_frame_id="/laser", transform=transform
    )
    return T["tf2_msgs/msg/TFMessage"](transforms=[stamped])


def image(number, time):
    depth = np.full((6, 8), 1000 + number, "<u2")
    return T["sensor_msgs/msg/Image"](
        header=header(number, time, "camera"), height=6, width=8, encoding="16UC1", is_bigendian=0, step=16,
        data=depth.view(np.uint8).ravel(),
    )  # fmt: skip


TOPICS = {
    "/scan": ("sensor_msgs/msg/LaserScan", scan),
    "/odom": ("nav_msgs/msg/Odometry", odometry),
    "/tf": ("tf2_msgs/msg/TFMessage", mount),
    "/depth/image": ("sensor_msgs/msg/Image", image),
}

for name, packing in (("none", None), ("bz2", "BZ2"), ("lz4", "LZ4")):
    path = FOLDER / f"ros1_{name}.bag"
    path.unlink(missing_ok=True)
    writer = Writer(path)
    if packing:
        writer.set_compression(Writer.CompressionFormat[packing])
    writer.chunk_threshold = 4096
    with writer:
        connections = {topic: writer.add_connection(topic, kind, typestore=STORE) for topic, (kind, _) in TOPICS.items()}
        for number in range(12):
            time = 1_500_000_000_123_456_789 + number * 100_000_000
            for topic, (kind, make) in TOPICS.items():
                writer.write(connections[topic], time, STORE.serialize_ros1(make(number, time), kind))
