"""What programs of others read in the files that are exported.

    pip install rosbags==0.11.9 gtsam==4.3.0 pillow pyyaml rasterio ezdxf trimesh
    node tests/cli/exported_files.mjs FOLDER && python tests/cli/export_readings.py FOLDER > tests/cli/export_readings.json
    npx prettier --write tests/cli/export_readings.json

Grids as nav2's map_server serves them (nav2_map_server/src/map_io.cpp) from what Pillow and PyYAML read. The SHA-256 of each file
tells the test whether it is still the one that was read.
"""

import hashlib
import json
import sys
from pathlib import Path

import ezdxf
import gtsam
import numpy as np
import rasterio
import trimesh
import yaml
from PIL import Image
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
STORE.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))


def served(path):
    """Per cent of each cell from the lowest row up, -1 unknown."""
    fields = yaml.safe_load(path.read_text())
    grey = np.asarray(Image.open(path.with_name(fields["image"])).convert("L"), float)
    occupancy = (grey if fields["negate"] else 255 - grey) / 255
    free, occupied = fields["free_thresh"], fields["occupied_thresh"]
    between = 100 * (occupancy - free) / (occupied - free) if fields.get("mode") == "scale" else np.full_like(occupancy, -1)
    cells = np.where(occupancy > occupied, 100, np.where(occupancy < free, 0, np.rint(between)))
    return {"resolution": fields["resolution"], "origin": fields["origin"], "cells": cells[::-1].astype(int).tolist()}


def point(p):
    return [p.x, p.y, p.z]


def content(kind, message):
    match kind:
        case "nav_msgs/msg/OccupancyGrid":
            info = message.info
            size, origin = [info.width, info.height], point(info.origin.position)
            return {"size": size, "resolution": float(info.resolution), "origin": origin, "cells": message.data.tolist()}
        case "nav_msgs/msg/Path":
            return [point(pose.pose.position) for pose in message.poses]
        case "sensor_msgs/msg/PointCloud2":
            steps = message.point_step // 4
            values = np.frombuffer(message.data.tobytes(), np.float32).reshape(-1, steps)
            return {"frame": message.header.frame_id, "points": np.round(values[:, :3].astype(float), 6).tolist()}
        case "tf2_msgs/msg/TFMessage":
            transforms = [(t.header.frame_id, t.child_frame_id, t.transform) for t in message.transforms]
            return [[a, b, point(t.translation), [t.rotation.z, t.rotation.w]] for a, b, t in transforms]


def mcap(path):
    reader, topics = McapReader(path), {}
    reader.open()
    for connection, time, raw in reader.messages(reader.connections):
        message = STORE.deserialize_cdr(raw, connection.msgtype)
        read = {"time": str(time), "read": content(connection.msgtype, message)}
        topics.setdefault(connection.topic, {"type": connection.msgtype, "messages": []})["messages"].append(read)
    reader.close()
    return topics


def graph(path):
    factors, poses = gtsam.readG2o(str(path), False)
    factors = gtsam.NonlinearFactorGraph(factors)
    chi_squared = 2 * factors.error(poses)
    first = min(poses.keys())
    factors.add(gtsam.PriorFactorPose2(first, poses.atPose2(first), gtsam.noiseModel.Isotropic.Sigma(3, 1e-4)))
    optimum = gtsam.LevenbergMarquardtOptimizer(factors, poses).optimize()
    return {"poses": poses.size(), "chi_squared": chi_squared, "optimum": 2 * factors.error(optimum)}


def raster(path):
    with rasterio.open(path) as file:
        return {"transform": list(file.transform)[:6], "nodata": file.nodata, "greys": file.read(1).tolist()}


def outlines(path):
    lines = ezdxf.readfile(path).modelspace().query("POLYLINE")
    return [[list(vertex.dxf.location)[:2] for vertex in line.vertices] for line in lines if line.is_closed]


def walls(path):
    mesh = trimesh.load(path)
    return {"is_watertight": bool(mesh.is_watertight), "volume": float(mesh.volume)}


READERS = {".yaml": served, ".mcap": mcap, ".g2o": graph, ".tif": raster, ".dxf": outlines, ".stl": walls}
NAMES = ["map.yaml", "keepout_mask.yaml", "speed_mask.yaml", "map.mcap", "graph.g2o", "map.tif", "walls.dxf", "walls.stl"]


def of(path):
    pictures = [path.with_suffix(".pgm")] if path.suffix == ".yaml" else []
    digest = hashlib.sha256(b"".join(file.read_bytes() for file in [path, *pictures])).hexdigest()
    return {"sha256": digest, "read": READERS[path.suffix](path)}


folder = Path(sys.argv[1])
json.dump({name: of(folder / name) for name in NAMES}, sys.stdout, indent=1)
print()
