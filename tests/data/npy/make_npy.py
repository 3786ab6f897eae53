"""Arrays as NumPy writes them, read by tests/cli/numpy.test.mjs: python make_npy.py (NumPy 2.4)."""

import pathlib

import numpy as np

HERE = pathlib.Path(__file__).parent
angles = np.deg2rad(np.arange(-90, 90, 5.0))
ranges = 2 + 0.1 * np.arange(3)[:, None] + 0.01 * np.arange(36)[None, :]
np.savez_compressed(HERE / "scans.npz", ranges=ranges.astype(np.float32), angles=angles, t=[0.0, 0.1, 0.2])
pixels = 1000 + 100 * np.arange(2)[:, None, None] + np.arange(24)[None, :, None] + 0 * np.arange(32)[None, None, :]
np.save(HERE / "depth.npy", pixels.astype(np.uint16))
np.savez(HERE / "0000.npz", depth=pixels[0].astype(np.float32) / 1000, rgb=np.full((24, 32, 3), [10, 20, 30], np.uint8))
np.save(HERE / "objects.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
