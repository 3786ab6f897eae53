"""Scanstitch in a notebook: NumPy clouds in, the map on the screen, poses and map points out.

    import numpy as np
    from scanstitch import Scanstitch

    widget = Scanstitch([np.loadtxt(f"{i}.xy") for i in range(10)])  # arrays of N x 2 or N x 3, in metres
    widget

Files of any kind that the page takes, and folders of them:

    Scanstitch(files=["rgb", "depth", "camera.txt"])
    Scanstitch(files=["drive.mcap"])

In a later cell, when the map is on the screen:

    widget.poses       # n x 3: x y theta (m, m, rad) in the plane; n x 4 x 4 in space: T_world_sensor
    widget.map_points  # m x 2 or m x 3 (m)
    widget.statuses    # good, doubtful or lost, for each cloud
"""

from pathlib import Path

import anywidget
import numpy as np
import traitlets

__all__ = ["Scanstitch"]


def _bytes_from_page(value, _widget):
    """Buffers come as memory views."""
    return None if value is None else bytes(value)


class Scanstitch(anywidget.AnyWidget):
    """Registers clouds or files in the notebook's page.

    `clouds`: arrays of N x 2 or N x 3 in metres, each in its sensor's frame. `files`: paths of files and folders.
    """

    _esm = Path(__file__).parent / "widget.js"

    settings = traitlets.Unicode("", help="name=value&name=value, in metres and radians").tag(sync=True)
    height = traitlets.Int(600, help="pixels").tag(sync=True)
    error = traitlets.Unicode("", help="what went wrong; empty: nothing").tag(sync=True)
    statuses = traitlets.List(traitlets.Unicode(), help="good, doubtful or lost").tag(sync=True)
    _data = traitlets.List(traitlets.Bytes()).tag(sync=True)
    # Of files; empty where the data are clouds.
    _names = traitlets.List(traitlets.Unicode()).tag(sync=True)
    _poses = traitlets.Bytes(None, allow_none=True).tag(sync=True, from_json=_bytes_from_page)
    _map = traitlets.Bytes(b"").tag(sync=True, from_json=_bytes_from_page)
    _dimensions = traitlets.Int(0).tag(sync=True)

    def __init__(self, clouds=(), *, files=(), **options):
        super().__init__(**options)
        if files:
            self.files = files
        else:
            self.clouds = clouds

    @property
    def clouds(self):
        """The clouds as arrays of N x 3, 32-bit floats; empty where files are open."""
        return [] if self._names else [np.frombuffer(cloud, "<f4").reshape(-1, 3) for cloud in self._data]

    @clouds.setter
    def clouds(self, clouds):
        self._open([], [_bytes_of(index, cloud) for index, cloud in enumerate(clouds)])

    @property
    def files(self):
        """Names of the files that are open."""
        return list(self._names)

    @files.setter
    def files(self, paths):
        files = [file for path in map(Path, paths) for file in _files_at(path)]
        self._open([file.as_posix() for file in files], [file.read_bytes() for file in files])

    def _open(self, names, data):
        with self.hold_sync():
            self._poses, self._map, self.statuses, self.error = None, b"", [], ""
            self._names, self._data = names, data

    @property
    def poses(self):
        """Poses of the sensor, None before they are computed; not a number for clouds that are lost."""
        if self._poses is None:
            return None
        poses = np.frombuffer(self._poses, "<f8")
        return poses.reshape(-1, 3) if self._dimensions == 2 else poses.reshape(-1, 4, 4)

    @property
    def map_points(self):
        """Points of the map in the world frame (m), None before they are computed."""
        if self._poses is None:
            return None
        return np.frombuffer(self._map, "<f4").reshape(-1, self._dimensions)


def _files_at(path):
    """The file, or all files in the folder."""
    return sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path]


def _bytes_of(index, cloud):
    points = np.asarray(cloud, dtype="<f4")
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise ValueError(f"cloud {index} is of shape {points.shape}; give arrays of N x 2 or N x 3")
    flat = np.zeros((len(points), 3), dtype="<f4")
    flat[:, : points.shape[1]] = points
    return flat.tobytes()
