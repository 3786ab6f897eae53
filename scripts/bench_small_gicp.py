"""Times small_gicp on one thread: registering a pair of clouds, prepared with voxels of 25 cm, from the identity.

python bench_small_gicp.py TARGET.ply SOURCE.ply WARM_UP_MS SAMPLES; prints one line a method: its name and the
nanoseconds of each sample.
"""

import sys
import time

import small_gicp

VOXEL = 0.25
METHODS = {"point_to_plane": "PLANE_ICP", "gicp": "GICP", "vgicp": "VGICP"}


def positions(path):
    return small_gicp.read_ply(path).points()


def main():
    target_path, source_path, warm_up_ms, samples = sys.argv[1:5]
    raw = [positions(path) for path in (target_path, source_path)]
    (target, tree), (source, _) = (
        small_gicp.preprocess_points(points, downsampling_resolution=VOXEL, num_threads=1) for points in raw
    )
    voxels = small_gicp.GaussianVoxelMap(1.0)
    voxels.insert(target)

    def register(method):
        if method == "VGICP":
            return small_gicp.align(voxels, source, max_correspondence_distance=1.0, num_threads=1)
        return small_gicp.align(
            target, source, tree, registration_type=method, max_correspondence_distance=1.0, num_threads=1
        )

    jobs = {f"small_gicp_{name}": lambda method=method: register(method) for name, method in METHODS.items()}
    jobs["small_gicp_prepare"] = lambda: small_gicp.preprocess_points(
        raw[0], downsampling_resolution=VOXEL, num_threads=1
    )
    for name, job in jobs.items():
        end = time.perf_counter_ns() + int(warm_up_ms) * 1_000_000
        while time.perf_counter_ns() < end:
            job()
        times = []
        for _ in range(int(samples)):
            start = time.perf_counter_ns()
            job()
            times.append(time.perf_counter_ns() - start)
        print(name, *times)


main()
