#!/usr/bin/env python3
"""Usage: tests/interop/co3d.py VKRUN

'vkrun data co3d' on a small mock of CO3D's release, compared with the same steps in NumPy and PyTorch, one by one as
the published preprocessing and PyTorch3D's loader describe them: box and crop, resizing to 800 pixels and back,
the camera's intrinsics through both, sampling around the principal point, LANCZOS, masks, normalised cameras.
Exit status 77: skipped, with the reason.
"""
import gzip
import json
import math
import os
import subprocess
import sys
import tempfile

try:
    import numpy
    import torch
    import torch.nn.functional as F
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

from pillow_lanczos import lanczos
from png_file import write_png

SIZE = 128
LOADED = 800  # pixels of the loader's images


def rotation(rng):
    """Cameras around y, tilted a little."""
    yaw, tilt = rng.uniform(0, 2 * math.pi), rng.normal(0, 0.1)
    about_y = numpy.array([[math.cos(yaw), 0, math.sin(yaw)], [0, 1, 0],
                           [-math.sin(yaw), 0, math.cos(yaw)]])
    about_x = numpy.array([[1, 0, 0], [0, math.cos(tilt), -math.sin(tilt)],
                           [0, math.sin(tilt), math.cos(tilt)]])
    return about_y @ about_x


def write_points(path, points):
    with open(path, "wb") as file:
        file.write(b"ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
                   b"property float z\nproperty uchar red\nend_header\n" % len(points))
        for point in points:
            file.write(point.astype("<f4").tobytes() + b"\x07")


def write_release(root, rng):
    """Two sequences; sizes, boxes and formats of intrinsics differ. Returns what is in it."""
    frames, sequences, truth = [], [], {}
    for name, (height, width), count in (("12_100_3", (210, 330), 5), ("9_40_41", (260, 170), 4)):
        folder = os.path.join(root, "hydrant", name)
        os.makedirs(os.path.join(folder, "images"))
        os.makedirs(os.path.join(folder, "masks"))
        points = rng.normal(0.3, 1, (500, 3)) * (1, 2, 0.5)
        write_points(os.path.join(folder, "pointcloud.ply"), points)
        turn = numpy.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn *= numpy.linalg.det(turn)
        truth[name] = {"points": points.astype(numpy.float32), "frames": []}
        for i in range(count):
            image = rng.integers(0, 256, (height, width, 3), dtype=numpy.uint8)
            y, x = numpy.mgrid[:height, :width]
            blob = ((x - width * 0.55) / (width * 0.2)) ** 2 + ((y - height * 0.45) / (height * 0.3)) ** 2
            mask = (255 * numpy.clip(1.5 - blob, 0, 1)).astype(numpy.uint8)
            paths = [f"hydrant/{name}/{kind}/frame{i:06d}.png" for kind in ("images", "masks")]
            for path, pixels in zip(paths, (image, mask)):
                write_png(os.path.join(root, path), pixels)
            legacy = i == 1
            annotation = {
                "sequence_name": name, "frame_number": 10 + 3 * i, "frame_timestamp": (count - i) * 0.1,
                "image": {"path": paths[0], "size": [height, width]}, "depth": {"path": "unused"},
                "mask": {"path": paths[1], "mass": 3.5,
                         "bounding_box_xywh": None if i == 0 else [width * 0.3 + i, height * 0.1, width * 0.5,
                                                                  height * 0.7]},
                "viewpoint": {"R": (turn @ rotation(rng)).tolist(), "T": rng.normal(0, 3, 3).tolist(),
                              "focal_length": [2.5 + 0.1 * i, 2.6], "principal_point": [0.05 * i, -0.04],
                              **({} if legacy else {"intrinsics_format": "ndc_isotropic"})},
                "meta": {"a": "text with ] and \" in it"}}
            frames.append(annotation)
            truth[name]["frames"].append((annotation, image, mask))
        sequences.append({"sequence_name": name, "category": "hydrant", "viewpoint_quality_score": 1.5,
                          "point_cloud": {"path": f"hydrant/{name}/pointcloud.ply", "n_points": 500}})
    frames.append({"sequence_name": "7_7_7", "frame_number": 1, "meta": "of no split"})
    lists = {"train": [], "val": [["9_40_41", 10, ""]], "test": []}
    order = rng.permutation(len(frames) - 1)
    for i in order:
        lists["train"].append([frames[i]["sequence_name"], frames[i]["frame_number"], frames[i]["image"]["path"]])
    os.makedirs(os.path.join(root, "hydrant", "set_lists"))
    with open(os.path.join(root, "hydrant/set_lists/set_lists_fewview_dev.json"), "w", encoding="utf-8") as file:
        json.dump(lists, file)
    for name, rows in (("frame", frames), ("sequence", sequences)):
        with gzip.open(os.path.join(root, f"hydrant/{name}_annotations.jgz"), "wt") as file:
            json.dump(rows, file)
    for i, row in enumerate(lists["train"]):
        truth[row[0]].setdefault("places", {})[row[1]] = i
    return truth


def box_of(mask, annotation):
    """Left, top, right and bottom of the crop, in float32 as the loader has them."""
    box = annotation["mask"]["bounding_box_xywh"]
    if box is None:
        threshold, chosen = 0.4, numpy.zeros_like(mask)
        while chosen.sum() <= 1:
            chosen = (mask > threshold).astype(numpy.float32)
            threshold -= 0.05
        columns, rows = numpy.flatnonzero(chosen.sum(0)), numpy.flatnonzero(chosen.sum(1))
        box = [columns[0], rows[0], columns[-1] + 1 - columns[0], rows[-1] + 1 - rows[0]]
    box = torch.tensor([float(v) for v in box])
    box[0] -= box[2] * 0.3 / 2
    box[1] -= box[3] * 0.3 / 2
    box[2] += box[2] * 0.3
    box[3] += box[3] * 0.3
    box[2:] = box[2:].clamp(2) + box[:2]
    height, width = mask.shape
    box[[0, 2]] = box[[0, 2]].clamp(0, width)
    box[[1, 3]] = box[[1, 3]].clamp(0, height)
    return [int(v) for v in box.round().long()]


def loaded_camera(annotation, box):
    """Focal lengths and principal point (NDC) of the crop at 800 pixels."""
    height, width = annotation["image"]["size"]
    view = annotation["viewpoint"]
    size = numpy.array([width, height], float)
    focal, point = numpy.array(view["focal_length"]), numpy.array(view["principal_point"])
    if "intrinsics_format" not in view:
        focal, point = focal * size / size.min(), point * size / size.min()
    scale = size.min() / 2
    focal_px, point_px = focal * scale, size / 2 - point * scale
    cropped = numpy.array([box[2] - box[0], box[3] - box[1]], float)
    point_px = point_px - box[:2]
    factor = (LOADED / cropped).min()
    return focal_px * factor / (LOADED / 2), (LOADED / 2 - point_px * factor) / (LOADED / 2)


def square_samples(image, half, x, y):
    """[c,h,w] at the centres of the square's pixels, as grid_sample gives them."""
    count = math.floor(2 * half)
    margin = 0.5 / count
    columns = torch.linspace(x - half + margin, x + half - margin, count)
    rows = torch.linspace(y - half + margin, y + half - margin, count)
    grid = torch.stack(torch.meshgrid(rows, columns, indexing="ij")[::-1], -1)
    size = torch.tensor([image.shape[2], image.shape[1]]) / 2
    return F.grid_sample(image[None], ((grid - size) / size)[None], align_corners=False)[0]


def prepared(annotation, image, mask):
    """Image, mask and focal lengths of a frame."""
    rgb = torch.from_numpy(image).permute(2, 0, 1).float() / 255
    probability = torch.from_numpy(mask).float() / 255
    box = box_of(probability.numpy(), annotation)
    width, height = box[2] - box[0], box[3] - box[1]
    crop = probability[None, None, box[1]:box[3], box[0]:box[2]]
    loaded = F.interpolate(crop, scale_factor=min(LOADED / height, LOADED / width), mode="nearest",
                           recompute_scale_factor=True)
    whole = torch.zeros_like(probability)[None]
    whole[:, box[1]:box[3], box[0]:box[2]] = F.interpolate(loaded, (height, width), mode="bilinear",
                                                          align_corners=False)[0]
    focal, point = loaded_camera(annotation, box)
    scale = max(width, height) / LOADED
    x = (LOADED / 2 - point[0] * LOADED / 2) * scale + box[0]
    y = (LOADED / 2 - point[1] * LOADED / 2) * scale + box[1]
    half = min(x, image.shape[1] - x, y, image.shape[0] - y)
    cut = (square_samples(rgb, half, x, y) * 255).byte().permute(1, 2, 0).numpy()
    small = torch.from_numpy(lanczos(cut, SIZE)).permute(2, 0, 1).float() / 255
    alpha = F.interpolate(square_samples(whole, half, x, y)[None], (SIZE, SIZE), mode="bilinear",
                          align_corners=False)[0]
    return small.numpy(), alpha.numpy(), focal * max(width, height) / (2 * half)


def normalised(sequence):
    """R and T in the frame of the published data."""
    frames = ordered(sequence)
    r = numpy.array([f[0]["viewpoint"]["R"] for f in frames])
    t = numpy.array([f[0]["viewpoint"]["T"] for f in frames])
    points = sequence["points"].astype(float)
    center = points.mean(0)
    points = points - center
    t = center @ r + t
    axes = r[:, :, 0] - r[:, :, 0].mean(0)
    v = numpy.linalg.svd(axes)[2].T
    up = v[:, 2:]
    if up[:, 0] @ r[0][:, 1] < 0:
        up = -up
    basis = numpy.concatenate([v[:, :1], up, numpy.cross(v[:, :1], up, axis=0)], 1)
    r = basis.T @ r
    points = points @ basis
    shift = numpy.array([0, points[:, 1].max() - (points[:, 1].max() - points[:, 1].min()) / 2, 0])
    t = shift @ r + t
    return r, t * (1.2 * 0.95 / (2 * numpy.abs(points - shift).max()))


def ordered(sequence):
    return sorted(sequence["frames"], key=lambda f: (f[0]["frame_timestamp"], f[0]["frame_number"]))


def within(what, found, expected, limit):
    difference = numpy.abs(numpy.asarray(found, float) - numpy.asarray(expected, float)).max()
    if not difference <= limit:
        sys.exit(f"FAILED: {what}: differs by {difference:g}, expected at most {limit:g}")


def compare_sequence(folder, name, sequence):
    arrays = {kind: numpy.load(os.path.join(folder, name, kind + ".npy"))
              for kind in ("images_full", "images_fg", "masks", "focal_lengths")}
    frames = ordered(sequence)
    off = 0
    for i, frame in enumerate(frames):
        full, mask, focal = prepared(*frame)
        # Whole numbers are truncated: float32 sums of the square's samples may fall below one.
        within(f"{name}, frame {i}, image", arrays["images_full"][i], full, 1.01 / 255)
        off += (numpy.abs(arrays["images_full"][i] - full) > 1e-6).mean() / len(frames)
        within(f"{name}, frame {i}, mask", arrays["masks"][i], mask, 2e-5)
        within(f"{name}, frame {i}, foreground", arrays["images_fg"][i],
               arrays["images_full"][i] * arrays["masks"][i], 1e-7)
        within(f"{name}, frame {i}, focal lengths", arrays["focal_lengths"][i, 0], focal, 1e-5)
    if off > 0.02:
        sys.exit(f"FAILED: {name}: {off:.1%} of the samples are a level off")
    with open(os.path.join(folder, name, "frame_order.txt"), encoding="utf-8") as file:
        order = file.read().split()
    if order != [f"{sequence['places'][f[0]['frame_number']]:05d}.png" for f in frames]:
        sys.exit(f"FAILED: {name}: frame_order.txt is {order}")
    r, t = (numpy.load(os.path.join(folder, f"camera_{kind}s.npz"))[name] for kind in "RT")
    expected_r, expected_t = normalised(sequence)
    # The sign of an eigenvector is free: half a turn about the vertical.
    if (r[0][0] @ expected_r[0][0]) < 0:
        expected_r = numpy.diag([-1, 1, -1]) @ expected_r
    within(f"{name}, rotations", r, expected_r, 1e-5)
    within(f"{name}, translations", t, expected_t, 1e-5)
    print(f"{name}: {len(frames)} frames agree; {off:.2%} of the samples are a level off")


def main():
    rng = numpy.random.default_rng(3)
    with tempfile.TemporaryDirectory() as folder:
        release, out = os.path.join(folder, "release"), os.path.join(folder, "out")
        truth = write_release(release, rng)

        def vkrun(*arguments):
            done = subprocess.run([sys.argv[1], "data", *arguments, "--json"], capture_output=True, text=True,
                                  check=False)
            if done.returncode != 0:
                sys.exit(f"FAILED: vkrun data {' '.join(arguments)}: {done.stderr}{done.stdout}")
            return json.loads(done.stdout)

        command = ("co3d", release, out, "--category", "hydrant", "--split", "train")
        first, again = (vkrun(*command)["splits"][0] for _ in range(2))
        if (first["sequences"], first["frames"], first["kept"], again["kept"]) != (2, 9, 0, 2):
            sys.exit(f"FAILED: {first}, then {again}")
        train = os.path.join(out, "co3d_hydrant_for_gs/train")
        for name, sequence in truth.items():
            compare_sequence(train, name, sequence)
        checked = vkrun("check", os.path.join(out, "co3d_hydrant_for_gs"))
        split = checked["splits"][0]
        if not checked["ok"] or split["format"] != "co3d" or split["maps"] != ["mask"]:
            sys.exit(f"FAILED: the result is no data set: {checked}")
        stored = os.path.join(folder, "stored")
        vkrun("co3d", release, stored, "--category", "hydrant", "--split", "train", "--stored-poses", "--limit", "1")
        with numpy.load(os.path.join(stored, "co3d_hydrant_for_gs/train/camera_Rs.npz")) as file:
            if list(file) != ["12_100_3"]:
                sys.exit(f"FAILED: --limit 1 gave {list(file)}")
            within("stored rotations", file["12_100_3"],
                   [f[0]["viewpoint"]["R"] for f in ordered(truth["12_100_3"])], 1e-6)
    print("all agree")


main()
