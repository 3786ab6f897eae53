"""kiss-icp on the sweeps that `cargo measure lidar_sweeps --write DIR` writes, beside the engine's own table.

pip install kiss-icp numpy; taskset -c 0 python scripts/bench_kiss_icp.py DIR [--time NAME]
"""

import sys
import time
from pathlib import Path

import numpy as np
from kiss_icp.config import KISSConfig
from kiss_icp.kiss_icp import KissICP


def run(folder: Path, deskew: bool):
    config = KISSConfig()
    config.data.deskew = deskew
    config.data.min_range = 0.1
    config.data.max_range = 100.0
    config.mapping.voxel_size = 1.0
    odometry = KissICP(config)
    truth = np.loadtxt(folder / 'truth.txt')
    sweeps = [np.fromfile(file).reshape(-1, 4) for file in sorted(folder.glob('*.bin'))]
    places, start = [], time.process_time()
    for sweep in sweeps:
        times = sweep[:, 3] / 0.1
        odometry.register_frame(np.ascontiguousarray(sweep[:, :3]), times if deskew else np.empty(0))
        places.append(odometry.last_pose)
    milliseconds = 1e3 * (time.process_time() - start) / len(sweeps)
    # A sweep that is straightened has the pose of its end, where the next one begins; truth is at its beginning.
    estimated = np.array([place[:3, 3] for place in places])
    estimated, truth = (estimated[:-1], truth[1:]) if deskew else (estimated, truth)
    errors = np.linalg.norm(aligned(estimated, truth) - truth, axis=1)
    return np.sqrt(np.mean(errors**2)), errors.max(), milliseconds


def aligned(estimated, truth):
    """The best rigid motion onto the truth (Umeyama 1991): the first sweep, which is not straightened, would turn all others."""
    centers = estimated.mean(axis=0), truth.mean(axis=0)
    u, _, vt = np.linalg.svd((truth - centers[1]).T @ (estimated - centers[0]))
    rotation = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    return (estimated - centers[0]) @ rotation.T + centers[1]


def main():
    folder = Path(sys.argv[1])
    names = sys.argv[sys.argv.index('--time') + 1:] if '--time' in sys.argv else sorted(p.name for p in folder.iterdir())
    for name in names:
        rmse, most, milliseconds = run(folder / name, '--time' not in sys.argv)
        print(f'{name:24} {1e3 * rmse:8.1f} / {1e3 * most:.1f} mm, {milliseconds:.1f} ms of processor time a sweep')


main()
