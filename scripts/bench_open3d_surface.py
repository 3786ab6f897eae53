"""Open3D's surfaces of depth images at known poses, for comparison with ours: python scripts/bench_open3d_surface.py FOLDER OUT [VOXEL]...

FOLDER is one that `cargo measure surface_scores --write DIR` leaves: depth images (PNG), poses.txt (4 x 4, camera to world, row by row) and
camera.txt (fx fy cx cy). Writes OUT/{voxel_block_grid,scalable}-VOXEL.ply, which `cargo measure surface_scores --score FILE --flats N`
scores, and prints the processor time of a frame and of the extraction (ms). Run it on one core: `taskset -c 0`. Truncation: four voxels,
as in Open3D's examples. A pixel's value is the depth times 1000; give --depth-scale 25.5 for 8 bits.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np
import open3d as o3d

TRUNCATION_VOXELS = 4.0
DEPTH_MAX = 10.0


def scalable(images, camera, poses, voxel_size, depth_scale):
    """The ScalableTSDFVolume of the legacy pipeline."""
    volume = o3d.pipelines.integration.ScalableTSDFVolume(
        voxel_length=voxel_size,
        sdf_trunc=TRUNCATION_VOXELS * voxel_size,
        color_type=o3d.pipelines.integration.TSDFVolumeColorType.RGB8,
    )
    height, width = images[0].shape
    intrinsic = o3d.camera.PinholeCameraIntrinsic(width, height, *camera)
    color = o3d.geometry.Image(np.zeros((height, width, 3), np.uint8))
    start = time.process_time()
    for image, pose in zip(images, poses):
        rgbd = o3d.geometry.RGBDImage.create_from_color_and_depth(
            color, o3d.geometry.Image(image), depth_scale=depth_scale, depth_trunc=DEPTH_MAX, convert_rgb_to_intensity=False
        )
        volume.integrate(rgbd, intrinsic, np.linalg.inv(pose))
    fused = time.process_time()
    mesh = volume.extract_triangle_mesh()
    return mesh, fused - start, time.process_time() - fused


def voxel_block_grid(images, camera, poses, voxel_size, depth_scale):
    """The VoxelBlockGrid of the tensor pipeline, on the processor."""
    core = o3d.core
    grid = o3d.t.geometry.VoxelBlockGrid(
        ("tsdf", "weight"), (core.float32, core.float32), ((1), (1)), voxel_size, 8, 100_000, core.Device("CPU:0")
    )
    fx, fy, cx, cy = camera
    # It cuts off the position in the image to find the pixel, where the centre of a pixel is a whole number here.
    intrinsic = core.Tensor([[fx, 0, cx + 0.5], [0, fy, cy + 0.5], [0, 0, 1]], core.float64)
    start = time.process_time()
    for image, pose in zip(images, poses):
        depth = o3d.t.geometry.Image(core.Tensor(image))
        extrinsic = core.Tensor(np.linalg.inv(pose), core.float64)
        blocks = grid.compute_unique_block_coordinates(
            depth, intrinsic, extrinsic, depth_scale, DEPTH_MAX, TRUNCATION_VOXELS
        )
        grid.integrate(blocks, depth, intrinsic, extrinsic, depth_scale, DEPTH_MAX, TRUNCATION_VOXELS)
    fused = time.process_time()
    mesh = grid.extract_triangle_mesh(weight_threshold=1.0).to_legacy()
    return mesh, fused - start, time.process_time() - fused


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("voxels", type=float, nargs="*", default=[0.01, 0.02])
    parser.add_argument("--depth-scale", type=float, default=1000.0)
    arguments = parser.parse_args()
    poses = np.loadtxt(arguments.folder / "poses.txt").reshape(-1, 4, 4)
    camera = np.loadtxt(arguments.folder / "camera.txt").tolist()
    images = [
        np.asarray(o3d.io.read_image(str(arguments.folder / f"{index}.png"))).astype(np.uint16)
        for index in range(len(poses))
    ]
    arguments.out.mkdir(parents=True, exist_ok=True)
    print(f"Open3D {o3d.__version__}, Python {sys.version.split()[0]}, {len(images)} images of {arguments.folder.name}")
    for voxel_size in arguments.voxels:
        for make in (scalable, voxel_block_grid):
            mesh, fusing, extracting = make(images, camera, poses, voxel_size, arguments.depth_scale)
            path = arguments.out / f"{make.__name__}-{voxel_size}.ply"
            if not mesh.has_triangles():
                print(f"{make.__name__:18}{voxel_size:6} m: no surface")
                continue
            o3d.io.write_triangle_mesh(str(path), mesh)
            print(
                f"{make.__name__:18}{voxel_size:6} m: {1000 * fusing / len(images):7.1f} ms a frame, "
                f"mesh {1000 * extracting:6.0f} ms, {len(mesh.triangles):8} triangles, {path}"
            )


main()
