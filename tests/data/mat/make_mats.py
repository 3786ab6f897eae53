"""Scans as MATLAB's users keep them, in the ways that its files can hold them.

    pip install scipy==1.17.1
    python tests/data/mat/make_mats.py tests/data/mat
"""

import sys
from pathlib import Path

import numpy as np
from scipy.io import savemat

FOLDER = Path(sys.argv[1])
BEAMS, SCANS = 36, 4
beams = np.arange(BEAMS)
RANGES = np.round(2 + np.abs(np.sin(0.1 * np.arange(SCANS)[:, None] + 0.2 * beams)), 3)
ANGLES = np.deg2rad(-90 + 5.0 * beams)
TIMES = 100 + 0.1 * np.arange(SCANS)
POSES = np.stack([0.1 * np.arange(SCANS), np.zeros(SCANS), 0.01 * np.arange(SCANS)], axis=1)

savemat(FOLDER / "rows.mat", {"ranges": RANGES, "angles": ANGLES}, do_compression=True)
savemat(FOLDER / "columns.mat", {"scan": (1000 * RANGES.T).astype(np.uint16), "theta": np.rad2deg(ANGLES), "t": TIMES, "odom": POSES.T})
savemat(FOLDER / "struct.mat", {"laser": {"ranges": RANGES.T.astype(np.float32), "angles": ANGLES[:, None], "ts": TIMES}}, do_compression=True)
cells = np.empty((1, SCANS), dtype=object)
for scan in range(SCANS):
    cells[0, scan] = {"t": TIMES[scan], "pose": POSES[scan], "res": 5.0, "scan": RANGES[scan]}
savemat(FOLDER / "cells.mat", {"lidar": cells, "note": "a corridor"})
savemat(FOLDER / "uneven.mat", {"ranges": RANGES, "angles": ANGLES * np.abs(ANGLES), "gt_pose": POSES})
savemat(FOLDER / "level4.mat", {"ranges": RANGES.astype(np.int16), "angles": ANGLES}, format="4")
savemat(FOLDER / "poses.mat", {"truth": POSES, "name": "nothing else"})
