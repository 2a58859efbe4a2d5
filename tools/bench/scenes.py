#!/usr/bin/env python3
"""Writes the random scenes of BENCHMARKS.md: NAME.ply and NAME.json for `vkrun bench raster NAME.ply --cameras NAME.json`.

scenes.py OUT_DIR    needs NumPy

si128_trained  16,384 Gaussians as a network predicts them: one for each pixel of a view of an ellipsoid, spherical
               harmonics of degree 1, the ellipsoid opaque, what is around it of opacity 0.0067; 4 views of 128 x 128
si128_init     the same as a new network predicts them: every standard deviation 0.02, every opacity 0.047
synth500k      500,000 Gaussians of 1.5 pixels in the median; one view of 1280 x 720
faint          16,000 Gaussians of 2 to 8 pixels and opacities of 0.005 to 0.04: each pixel blends its whole list, so that
               only the inner loops of blending take time; one view of 256 x 256

million        1,000,000 Gaussians of 1 pixel in the median and spherical harmonics of degree 3; one view of 1280 x 720

The si128 scenes are drawn on white (--background 1,1,1)."""
import json
import pathlib
import sys

import numpy as np


def write_ply(path, means, log_scales, rotations, logits, sh):
    """sh [N,K,3]; the other coefficients of a channel stand together in files of 3D Gaussian splatting."""
    rest = sh[:, 1:].transpose(0, 2, 1).reshape(len(means), -1)
    names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", *(f"f_rest_{i}" for i in range(rest.shape[1])), "opacity",
             "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(means)}",
              *(f"property float {name}" for name in names), "end_header", ""]
    rows = np.column_stack([means, sh[:, 0], rest, logits, log_scales, rotations])
    path.write_bytes("\n".join(header).encode() + rows.astype("<f4").tobytes())


def write_cameras(path, width, height, focal, views):
    """views: world to camera, z forward and y down; the file has OpenGL's axes, camera to world."""
    frames = [{"file_path": f"{i}.png", "transform_matrix": (np.linalg.inv(view) @ np.diag([1.0, -1, -1, 1])).tolist()}
              for i, view in enumerate(views)]
    path.write_text(json.dumps({"w": width, "h": height, "fl_x": focal, "fl_y": focal, "cx": width / 2,
                                "cy": height / 2, "frames": frames}, indent=1))


def random_rotations(random, count):
    quaternions = random.normal(size=(count, 4))
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)


def wide(path, random, count, pixels, terms):
    width, height, focal = 1280, 720, 1000.0
    z = random.uniform(2, 10, count)
    x, y = (random.uniform(-1.05, 1.05, count) * side / 2 for side in (width, height))
    size = pixels * z / focal * np.exp(random.normal(0, 0.5, count))
    log_scales = np.log(size)[:, None] + random.normal(0, 0.5, (count, 3))
    rotations = random_rotations(random, count)
    logits, constants = random.normal(0, 1.5, count), random.normal(0, 0.8, (count, 1, 3))
    sh = np.concatenate([constants, random.normal(0, 0.1, (count, terms - 1, 3))], axis=1)
    write_ply(path.with_suffix(".ply"), np.column_stack([x * z / focal, y * z / focal, z]), log_scales, rotations, logits, sh)
    write_cameras(path.with_suffix(".json"), width, height, focal, [np.eye(4)])


def around(degrees, distance):
    """A camera that looks at (0, 0, distance) from there, at an angle around the y axis."""
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    view = np.eye(4)
    view[:3, :3] = [[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]
    view[:3, 3] = (np.eye(3) - view[:3, :3]) @ [0, 0, distance]
    return view


def si128(folder, random):
    side, count = 128, 128 * 128
    focal = side / 2 / np.tan(np.radians(51.98948897809546) / 2)  # field of view of the published cars model
    row, column = np.mgrid[0:side, 0:side]
    x, y = ((pixel + 0.5 - side / 2).ravel() / focal for pixel in (column, row))
    radius = np.hypot(x / 0.35, y / 0.22)
    z = 1.3 - 0.25 * np.sqrt(np.clip(1 - radius**2, 0, 1))
    means = np.column_stack([x * z, y * z, z]) + random.normal(0, 0.004, (count, 3))
    rotations = random_rotations(random, count)
    sh = np.concatenate([random.normal(0, 0.8, (count, 1, 3)), random.normal(0, 0.1, (count, 3, 3))], axis=1)
    log_scales = np.log(0.010) + random.normal(0, 0.4, (count, 3))
    logits = np.where(radius < 1, random.normal(2.5, 1, count), -5.0)
    write_ply(folder / "si128_trained.ply", means, log_scales, rotations, logits, sh)
    write_ply(folder / "si128_init.ply", means, np.full((count, 3), np.log(0.02)), rotations, np.full(count, -3.0), sh)
    for name in ("si128_trained", "si128_init"):
        write_cameras(folder / f"{name}.json", side, side, focal, [around(angle, 1.3) for angle in (0, 30, 90, 180)])


def faint(folder, random):
    count, side, focal = 16000, 256, 256.0
    z = random.uniform(2, 10, count)
    x, y = random.uniform(-side / 2, side / 2, (count, 2)).T
    rotations = random_rotations(random, count)
    opacities = random.uniform(0.005, 0.04, count)
    sh = random.normal(0, 0.8, (count, 1, 3))
    log_scales = np.log(random.uniform(2, 8, (count, 3)) * z[:, None] / focal)
    write_ply(folder / "faint.ply", np.column_stack([x * z / focal, y * z / focal, z]), log_scales, rotations,
              np.log(opacities / (1 - opacities)), sh)
    write_cameras(folder / "faint.json", side, side, focal, [np.eye(4)])


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(1)
    wide(folder / "synth500k", random, 500000, 1.5, 1)
    si128(folder, random)
    faint(folder, random)
    wide(folder / "million", random, 1000000, 1.0, 16)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]))
