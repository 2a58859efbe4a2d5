"""Data sets that tools/bench/ablation derives from one in SRN's layout: pictures and cameras are links to its files.

    estimated          depth, normals and masks with errors as large as those of published estimators
    edges_of_depth     Sobel edges of the exact depth, in the place of depth
    edges_of_pictures  those of the pictures, as an edge detector finds them
    planes             planes that `vkrun priors plane` finds in the exact depth and normals
    estimated_planes   those in the estimated ones
    conditioned        one embedding of each view: as constant maps, as a vector (embedding.npz), as tokens (tokens.npz)

All is decided by the object's name: the same data set gives the same files. Needs NumPy and the library's Python
package.

Errors are fields that are smooth over an eighth of the picture, as those of networks are, of these sizes:

    depth    0.045 of the distance on average: AbsRel of Depth Anything V2 (ViT-L) on NYUv2 after the best scale and
             shift (Yang et al. 2024, arXiv:2406.09414). Each map then has a scale of 0.7 to 1 and a shift of
             its own, which such a network leaves open.
    normals  median 8.4 and mean 16.4 degrees, a log-normal distribution: DSINE on NYUv2 (Bae and Davison 2024,
             arXiv:2403.00712)
    masks    0.044 of the picture on average, along the outline: MAE of U2-Net on DUTS-TE (Qin et al. 2020,
             arXiv:2005.09007)

Pictures of one object before white are easier than those photographs: the errors are rather too large.
"""

import json
import math
import os
import pathlib
import zlib

import numpy as np

ABSREL, MEDIAN_ANGLE, MEAN_ANGLE, MASK_MAE = 0.045, 8.4, 16.4, 0.044
# Distances of white and of black in the maps of `vkrun data synth`, whose white is the nearest pixel of each picture: about
# that of the mean, so that distances, and errors as shares of them, are right to some percent.
NEAREST, FARTHEST = 0.85, 1.8
CELLS = 8  # cells of a field across the picture
VERSION = 1


class NotSuitable(Exception):
    """A data set that nothing can be derived from, with the reason."""


def objects_of(source):
    """Folders of the objects below a data set in SRN's layout, and their names: split/object."""
    found = []
    for folder, folders, files in os.walk(source):
        if "intrinsics.txt" in files:
            folders.clear()
            path = pathlib.Path(folder)
            found.append((path, f"{path.parent.name.rpartition('_')[2]}/{path.name}"))
    if not found:
        raise NotSuitable(f"{source} has no object in SRN's layout (a folder with intrinsics.txt), which this group "
                          "derives its data from; make one by 'vkrun data synth', or 'vkrun data export --to srn'")
    return sorted(found)


def random_of(name, kind):
    return np.random.default_rng([VERSION, zlib.crc32(name.encode()), kind])


def smooth(random, views, side):
    """Normal numbers [views, side, side] of variance 1."""
    places = (np.arange(side) + 0.5) / side * CELLS
    weights = np.maximum(0, 1 - np.abs(places[:, None] - np.arange(CELLS + 1)))
    weights /= np.sqrt((weights ** 2).sum(axis=1, keepdims=True))
    return weights @ random.standard_normal((views, CELLS + 1, CELLS + 1)) @ weights.T


def estimated_depth(nearness, random):
    """Maps [views, side, side] of 0 to 1 with errors, and the mean relative error of the distances."""
    views, side, _ = nearness.shape
    low, high = 1 / FARTHEST, 1 / NEAREST
    distance = 1 / (low + nearness * (high - low))
    # The mean of |e| of a normal distribution is sqrt(2 / pi) of its deviation.
    error = smooth(random, views, side) * ABSREL * math.sqrt(math.pi / 2)
    found = distance * np.maximum(0.5, 1 + error)
    seen = nearness > 0
    maps = np.where(seen, np.clip((1 / found - low) / (high - low), 0, 1), 0)
    scale = random.uniform(0.7, 1, (views, 1, 1))
    shift = random.uniform(0, 1, (views, 1, 1)) * (1 - scale)
    return scale * maps + shift, np.abs(found / distance - 1)[seen]


def estimated_normals(normals, random):
    """Unit vectors [views, side, side, 3] turned, and the angles in degrees."""
    views, side, _, _ = normals.shape
    spread = math.sqrt(2 * math.log(MEAN_ANGLE / MEDIAN_ANGLE))  # the mean of a log-normal is exp(s^2 / 2) medians
    angle = np.minimum(MEDIAN_ANGLE * np.exp(spread * smooth(random, views, side)), 90)
    turn = np.arctan2(smooth(random, views, side), smooth(random, views, side))[..., None]
    seen = np.linalg.norm(normals, axis=-1) > 0.5
    unit = normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-6)
    least = np.eye(3)[np.abs(unit).argmin(axis=-1)]
    across = np.cross(unit, least)
    across /= np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-6)
    along = np.cos(turn) * across + np.sin(turn) * np.cross(unit, across)
    radians = np.radians(angle)[..., None]
    turned = np.cos(radians) * unit + np.sin(radians) * along
    return np.where(seen[..., None], turned, normals), angle[seen]


def blurred(masks):
    """Means over 5 x 5 pixels."""
    padded = np.pad(masks, ((0, 0), (2, 2), (2, 2)), mode="edge")
    rows = sum(padded[:, i:i + masks.shape[1], :] for i in range(5))
    return sum(rows[:, :, i:i + masks.shape[2]] for i in range(5)) / 25


def estimated_masks(masks, random):
    """Masks of 0 and 1 with other outlines, and the share of wrong pixels of each."""
    soft, field = blurred(masks), smooth(random, *masks.shape[:2])
    low, high = 0.0, 4.0
    for _ in range(20):  # the error grows with the field's size
        size = (low + high) / 2
        wrong = ((soft + size * field > 0.5) != (masks > 0.5)).mean()
        low, high = (size, high) if wrong < MASK_MAE else (low, size)
    made = (soft + low * field > 0.5).astype(float)
    return made, np.abs(made - (masks > 0.5)).mean(axis=(1, 2))


def read_maps(splat, folder, kind):
    """The names of an object's maps, and the maps: [views, side, side] or [views, side, side, 3] of 0 to 1."""
    if not (folder / kind).is_dir():
        raise NotSuitable(f"{folder} has no {kind}/, expected exact maps beside rgb/, as 'vkrun data synth' writes")
    paths = sorted((folder / kind).glob("*.png"))
    return [path.name for path in paths], np.stack([np.asarray(splat.Image.load(path)) for path in paths]) / 255.0


def write_maps(splat, folder, names, maps):
    folder.mkdir(exist_ok=True)
    for name, pixels in zip(names, np.rint(np.clip(maps, 0, 1) * 255).astype(np.uint8)):
        # Image.save() waits for the disk, which takes minutes for as many files.
        (folder / name).write_bytes(splat.Image(np.ascontiguousarray(pixels)).to_bytes())


def write_estimated(splat, objects, place):
    errors = {"depth": [], "normal": [], "mask": []}
    for folder, name in objects:
        to = place(folder)
        for number, (kind, function) in enumerate((("depth", estimated_depth), ("normal", estimated_normals),
                                                   ("mask", estimated_masks))):
            names, maps = read_maps(splat, folder, kind)
            made, wrong = function(maps * 2 - 1 if kind == "normal" else maps, random_of(name, number))
            errors[kind].append(wrong.ravel())
            write_maps(splat, to / kind, names, (made + 1) / 2 if kind == "normal" else made)
    depth, normal, mask = (np.concatenate(errors[kind]) for kind in ("depth", "normal", "mask"))
    return {"depth_absrel": round(float(depth.mean()), 4), "normal_mean_degrees": round(float(normal.mean()), 2),
            "normal_median_degrees": round(float(np.median(normal)), 2), "mask_mae": round(float(mask.mean()), 4)}


def sobel(images):
    """Magnitudes of images [views, side, side], each divided by its greatest, as `vkrun priors edges` makes them."""
    padded = np.pad(images, ((0, 0), (1, 1), (1, 1)), mode="reflect")
    smoothed = padded[:, :-2] + 2 * padded[:, 1:-1] + padded[:, 2:]
    across = smoothed[:, :, 2:] - smoothed[:, :, :-2]
    smoothed = padded[:, :, :-2] + 2 * padded[:, :, 1:-1] + padded[:, :, 2:]
    down = smoothed[:, 2:] - smoothed[:, :-2]
    made = np.hypot(across, down)
    return made / (made.max(axis=(1, 2), keepdims=True) + 1e-8)


def write_edges(splat, objects, place, kind):
    for folder, _ in objects:
        names, images = read_maps(splat, folder, kind)
        if kind == "rgb":
            images = images[..., :3] @ [0.299, 0.587, 0.114]
        write_maps(splat, place(folder) / "depth", names, sobel(images))
    return {}


def plane_map(splat, nearness, normals, focal):
    """The map of `vkrun priors plane`: (n + 1) / 2, and the distance as a share of the greatest; 0 without a plane."""
    found = splat.planes_from_depth(nearness.astype(np.float32), focal, normals.astype(np.float32),
                                    distances=(NEAREST, FARTHEST))
    distance = found[..., 3:]
    share = np.maximum(distance / max(distance.max(), 1e-6), 1 / 255)
    return np.where(distance > 0, np.concatenate([(found[..., :3] + 1) / 2, share], axis=-1), 0)


def write_planes(splat, objects, place, estimated):
    on_planes = []
    for folder, name in objects:
        focal = float((folder / "intrinsics.txt").read_text().split()[0])
        names, depth = read_maps(splat, folder, "depth")
        normals = read_maps(splat, folder, "normal")[1] * 2 - 1
        surface = (depth > 0).sum()  # estimated maps are shifted
        if estimated:
            depth, _ = estimated_depth(depth, random_of(name, 0))
            normals, _ = estimated_normals(normals, random_of(name, 1))
        maps = np.stack([plane_map(splat, *pair, focal) for pair in zip(depth, normals)])
        on_planes.append((maps[..., 3] > 0).sum() / max(1, surface))
        write_maps(splat, place(folder) / "plane", names, maps)
    return {"share_of_surface_on_planes": round(float(np.mean(on_planes)), 3)}


def embedding_of(folder, name, masks):
    """[views, 5] of 0 to 1 in steps of 1/255: the camera's direction from the object, class, area of the instance."""
    places = []
    for path in sorted((folder / "pose").glob("*.txt")):
        place = np.loadtxt(path).reshape(4, 4)[:3, 3]
        places.append(place / np.linalg.norm(place))
    chair = 1.0 if name.endswith("_chair") else 0.0
    area = masks.mean(axis=(1, 2))
    values = np.column_stack([(np.stack(places) + 1) / 2, np.full(len(places), chair), area])
    return np.rint(values * 255) / 255


def write_conditioned(splat, objects, place):
    """The same five numbers of a view in three forms. A token has three numbers and says which of them it is."""
    vectors, tokens = {}, {}
    for folder, name in objects:
        to = place(folder)
        names, masks = read_maps(splat, folder, "mask")
        values = embedding_of(folder, name, masks)
        views, side = len(values), masks.shape[1]
        plane = np.ones((1, side, side, 1))
        write_maps(splat, to / "normal", names, values[:, None, None, :3] * plane)
        write_maps(splat, to / "depth", names, values[:, None, None, 3] * plane[..., 0])
        # A map of nothing but 0 and 1 would be read as 0 and 255.
        write_maps(splat, to / "mask", names, np.maximum(2 / 255, values[:, None, None, 4] * plane[..., 0]))
        vectors[name] = np.concatenate([values, np.zeros((views, 7))], axis=1).astype(np.float32)
        made = np.zeros((views, 6, 3), np.float32)
        made[:, :3, 0], made[:, 0, 1], made[:, 0, 2] = values[:, :3], values[:, 3], values[:, 4]
        made[:, [3, 4, 5], [0, 1, 2]] = 1
        tokens[name] = made
    np.savez(place(objects[0][0]).parents[1] / "embedding.npz", **vectors)
    np.savez(place(objects[0][0]).parents[1] / "tokens.npz", **tokens)
    return {}


WRITERS = {
    "estimated": write_estimated,
    "edges_of_depth": lambda *given: write_edges(*given, "depth"),
    "edges_of_pictures": lambda *given: write_edges(*given, "rgb"),
    "planes": lambda *given: write_planes(*given, False),
    "estimated_planes": lambda *given: write_planes(*given, True),
    "conditioned": write_conditioned,
}


def derive(kind, source, to, splat):
    """Make the data set of this kind in the folder `to`, unless it is there."""
    done = to / "derived.json"
    if done.exists():
        return
    objects = objects_of(source)

    def place(folder):
        """The folder of an object: without maps, with links to its pictures and cameras."""
        made = to / folder.parent.name / folder.name
        made.mkdir(parents=True, exist_ok=True)
        for name in "rgb", "pose", "intrinsics.txt":
            if not (made / name).is_symlink():
                (made / name).symlink_to((folder / name).resolve())
        return made

    about = {"kind": kind, "objects": len(objects), **WRITERS[kind](splat, objects, place)}
    done.write_text(json.dumps(about, indent=2) + "\n")
