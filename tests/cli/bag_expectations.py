"""What the PyPI package rosbags reads in bags, as numbers: those of ROS 2 in a folder, those of ROS 1 by their names.

    pip install rosbags==0.11.9
    python tests/cli/bag_expectations.py ../shared/data/bags > tests/cli/bag_expectations.json
    python tests/cli/bag_expectations.py tests/data/bags/*.bag ../shared/data/laser/ros1_bag/*.bag > tests/cli/ros1_expectations.json

Each checksum is the CRC-32 of numbers written one after the other, little endian: times as 64-bit integers, coordinates as
doubles, images and clouds as their bytes.
"""

import json
import struct
import sys
import zlib
from pathlib import Path

from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
ROS1_STORE = get_typestore(Stores.ROS1_NOETIC)
for name in ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"):
    ROS1_STORE.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", name))


def pose(translation, rotation):
    values = (translation.x, translation.y, translation.z, rotation.x, rotation.y, rotation.z, rotation.w)
    return struct.pack("<7d", *values)


def contents(kind, message):
    """The numbers of a message that are read; None where its type is not."""
    match kind:
        case "sensor_msgs/msg/Image" | "sensor_msgs/msg/PointCloud2":
            return message.data.tobytes()
        case "sensor_msgs/msg/CameraInfo":
            return struct.pack("<9d", *message.k)
        case "nav_msgs/msg/Odometry" | "geometry_msgs/msg/PoseWithCovarianceStamped":
            return pose(message.pose.pose.position, message.pose.pose.orientation)
        case "sensor_msgs/msg/LaserScan":
            shape = (message.angle_min, message.angle_increment, message.range_min, message.range_max)
            return struct.pack("<4f", *shape) + message.ranges.tobytes()
        case "tf2_msgs/msg/TFMessage":
            return b"".join(pose(t.transform.translation, t.transform.rotation) for t in message.transforms)
    return None


def stamps(kind, message):
    headers = [t.header for t in message.transforms] if kind == "tf2_msgs/msg/TFMessage" else [message.header]
    return b"".join(struct.pack("<q", h.stamp.sec * 10**9 + h.stamp.nanosec) for h in headers)


def read(path):
    is_ros1 = path.suffix == ".bag"
    reader = {".bag": Ros1Reader, ".mcap": McapReader}.get(path.suffix, Sqlite3Reader)(path)
    deserialize = ROS1_STORE.deserialize_ros1 if is_ros1 else STORE.deserialize_cdr
    reader.open()
    topics = {}
    for connection in reader.connections:
        kind = connection.msgtype.replace("tf/msg/tfMessage", "tf2_msgs/msg/TFMessage")
        topics[connection.topic] = {"type": kind, "count": 0, "times": 0, "messages": 0}
    spans = {}
    for connection, time, raw in reader.messages(reader.connections):
        topic = topics[connection.topic]
        topic["count"] += 1
        first, last = spans.get(connection.topic, (time, time))
        spans[connection.topic] = (min(first, time), max(last, time))
        topic["times"] = zlib.crc32(struct.pack("<q", time), topic["times"])
        topic["messages"] = zlib.crc32(raw, topic["messages"])
        try:
            message = deserialize(raw, connection.msgtype)
        except KeyError:
            continue
        numbers = contents(topic["type"], message)
        if numbers is not None:
            topic["stamps"] = zlib.crc32(stamps(topic["type"], message), topic.get("stamps", 0))
            topic["numbers"] = zlib.crc32(numbers, topic.get("numbers", 0))
    for name, (first, last) in spans.items():
        topics[name]["first"], topics[name]["last"] = str(first), str(last)
    reader.close()
    return topics


given = [Path(argument) for argument in sys.argv[1:]]
bags = {path.name: path for path in given if path.is_file()}
for root in filter(Path.is_dir, given):
    bags |= {path.relative_to(root).as_posix(): path for path in root.rglob("*") if path.suffix in (".db3", ".mcap")}
json.dump({name: read(path) for name, path in bags.items()}, sys.stdout, indent=2, sort_keys=True)
print()
