#!/usr/bin/env python3
"""Writes the random scenes of BENCHMARKS.md, and the one of docs/knot.png: NAME.ply, all but knot with cameras in
NAME.json for `vkrun bench raster NAME.ply --cameras NAME.json`.

scenes.py OUT_DIR    needs NumPy

si128_trained  16,384 Gaussians as a network predicts them: one for each pixel of a view of an ellipsoid, spherical
               harmonics of degree 1, the ellipsoid opaque, what is around it of opacity 0.0067; 4 views of 128 x 128
si128_init     the same as a new network predicts them: every standard deviation 0.02, every opacity 0.047
synth500k      500,000 Gaussians of 1.5 pixels in the median; one view of 1280 x 720
faint          16,000 Gaussians of 2 to 8 pixels and opacities of 0.005 to 0.04: each pixel blends its whole list, so that
               only the inner loops of blending take time; one view of 256 x 256
million        1,000,000 Gaussians of 1 pixel in the median and spherical harmonics of degree 3; one view of 1280 x 720
knot           234,224 flat Gaussians, one for each patch of a striped trefoil knot and of the disc below it; docs/knot.png by
               `vkrun render knot.ply --orbit 1 --elevation 38 --size 288x288 --background 1,1,1`

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


def normalized(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def quaternions_of(axes):
    """w, x, y, z of the rotations [n,3,3] whose columns are the axes."""
    xx, yy, zz = (axes[:, i, i] for i in range(3))
    w, x, y, z = (np.sqrt(np.maximum(0, 1 + sum_)) for sum_ in (xx + yy + zz, xx - yy - zz, yy - xx - zz, zz - xx - yy))
    signs = (axes[:, 2, 1] - axes[:, 1, 2], axes[:, 0, 2] - axes[:, 2, 0], axes[:, 1, 0] - axes[:, 0, 1])
    return np.column_stack([w, *(np.copysign(part, sign) for part, sign in zip((x, y, z), signs))]) / 2


def knot_surface(light):
    """Means, axes (the normal last), standard deviations and lit colours of the knot's patches."""
    along, around_tube, radius, turn = 1600, 90, 0.48, 2 * np.pi
    t = np.repeat(np.linspace(0, turn, along, endpoint=False), around_tube)
    phi = np.tile(np.linspace(0, turn, around_tube, endpoint=False), along)

    def curve(t):
        return np.column_stack([np.sin(t) + 2 * np.sin(2 * t), 0.9 * np.sin(3 * t), np.cos(t) - 2 * np.cos(2 * t)])

    tangent = normalized(curve(t + 1e-4) - curve(t - 1e-4))
    side = normalized(np.cross(tangent, [0, 1, 0]))
    normal = np.cos(phi)[:, None] * side + np.sin(phi)[:, None] * np.cross(side, tangent)
    step = np.linalg.norm(curve(t + np.pi / along) - curve(t - np.pi / along), axis=1)
    sigmas = np.column_stack([0.55 * step, np.full(len(t), 0.55 * turn * radius / around_tube), np.full(len(t), 0.004)])
    stripe = np.clip(4 * np.sin(24 * t + 2 * phi) - 1.7, 0, 1)[:, None]
    paint = 0.5 + 0.38 * np.cos(t[:, None] + np.array([0, 2.1, 4.2]))
    half = normalized(light + normalized(np.array([0, -0.8, -1])))
    bright = 0.28 + 0.11 * (1 - normal[:, 1]) + 0.62 * np.clip(normal @ light, 0, 1)
    gloss = 0.35 * np.clip(normal @ half, 0, 1)[:, None] ** 40
    colors = (stripe * 0.93 + (1 - stripe) * paint) * bright[:, None] + gloss
    return curve(t) + radius * normal, np.stack([tangent, np.cross(normal, tangent), normal], axis=2), sigmas, colors


def disc_surface(light, casters):
    """The same of a chequered disc, with the shadow of the points `casters`."""
    extent, height, cells, side = 4.4, 1.55, 200, 340
    u, v = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-extent, extent, side)] * 2))
    u, v = (axis[np.hypot(u, v) < extent] for axis in (u, v))
    hits = casters + ((casters[:, 1] - height) / light[1])[:, None] * -light
    shadow = np.minimum(1, np.histogram2d(hits[:, 0], hits[:, 2], cells, [[-extent, extent]] * 2)[0] / 3)
    for axis in (0, 1) * 3:
        shadow = (np.roll(shadow, 1, axis) + shadow + np.roll(shadow, -1, axis)) / 3
    cell = [np.minimum(((axis + extent) / (2 * extent) * cells).astype(int), cells - 1) for axis in (u, v)]
    light_square = ((np.floor(u / 0.8) + np.floor(v / 0.8)) % 2)[:, None] > 0
    colors = np.where(light_square, [0.86, 0.87, 0.9], [0.55, 0.58, 0.64]) * (1 - 0.55 * shadow[tuple(cell)])[:, None]
    axes = np.broadcast_to(np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), (len(u), 3, 3))
    spacing = 2 * extent / (side - 1)
    sigmas = np.broadcast_to([0.55 * spacing, 0.55 * spacing, 0.004], (len(u), 3))
    return np.column_stack([u, np.full(len(u), height), v]), axes, sigmas, colors


def knot(path):
    light = normalized(np.array([-0.5, -1, -0.35]))  # towards it; y points down
    tube = knot_surface(light)
    means, axes, sigmas, colors = (np.concatenate(pair) for pair in zip(tube, disc_surface(light, tube[0])))
    sh = (np.clip(colors, 0, 1) - 0.5)[:, None, :] / 0.28209479177387814
    write_ply(path, means, np.log(sigmas), quaternions_of(axes), np.full(len(means), 4.0), sh)


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(1)
    wide(folder / "synth500k", random, 500000, 1.5, 1)
    si128(folder, random)
    faint(folder, random)
    wide(folder / "million", random, 1000000, 1.0, 16)
    knot(folder / "knot.ply")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]))
