#!/usr/bin/env python3
"""Usage: SPLAT_LIBRARY=libsplat.so tests/interop/readers.py

Mocks of the layouts of SRN, CO3D, NMR, Objaverse and GSO. What the library reads of each split - names and their
order, conditioning and novel views, cameras relative to the first, focal lengths, colours - is compared with what
NumPy computes from the same files by the rules of the published code. Exit status 77: skipped, with the reason.
"""
import json
import math
import os
import sys
import tempfile

try:
    import numpy
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "../../bindings/python/src"))
import libsplat as splat  # noqa: E402
from png_file import write_png  # noqa: E402

SIDE = 8
GL_TO_CV = numpy.diag([1, -1, -1, 1])


def text(path, content):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w", encoding="utf-8") as file:
        file.write(content)


def picture(rng, path, channels=3):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    image = rng.integers(0, 256, (SIDE, SIDE, channels), dtype=numpy.uint8)
    write_png(path, image)
    return image


def camera(rng):
    """A camera-to-world matrix somewhere around the origin."""
    pose = numpy.eye(4)
    turn = numpy.linalg.qr(rng.normal(size=(3, 3)))[0]
    pose[:3, :3] = turn * numpy.linalg.det(turn)
    pose[:3, 3] = rng.normal(0, 2, 3)
    return pose


def relative(poses):
    """View-to-world matrices for row vectors, relative to the first, of camera-to-world matrices."""
    return numpy.array([(numpy.linalg.inv(poses[0]) @ pose).T for pose in poses])


def same(what, found, expected):
    if found != expected:
        sys.exit(f"FAILED: {what}: {found}, expected {expected}")


def near(what, found, expected, limit=2e-5):
    difference = numpy.abs(numpy.asarray(found, float) - numpy.asarray(expected, float)).max()
    if not difference <= limit:
        sys.exit(f"FAILED: {what}: differs by {difference:g}")


def compare(what, dataset, names, inputs, conditioning, count, object_of):
    """object_of(name) gives poses (camera to world), images (uint8 [n,S,S,3]) and focal lengths in pixels."""
    same(f"{what}: names", dataset.report["names"], names)
    evaluator = splat.Evaluator(dataset=dataset, method="images", inputs=inputs)
    for index, name in enumerate(names):
        given = conditioning(name)
        expected = given + [i for i in range(count) if i not in given]
        numbers = evaluator.read(index).numbers
        same(f"{what}, {name}: views", numbers, expected)
        poses, images, focals = object_of(name)
        views = dataset.read(index, numbers)
        near(f"{what}, {name}: poses", views["view_to_world"], relative([poses[i] for i in numbers]))
        near(f"{what}, {name}: focal lengths", views["focals"], [focals[i] for i in numbers])
        wanted = numpy.array([images[i] for i in numbers]).transpose(0, 3, 1, 2) / 255
        near(f"{what}, {name}: images", views["images"], wanted, 0.51 / 255)
    print(f"{what}: {len(names)} objects agree")


def srn(root, rng):
    """Views 64, or 64 and 128, of 251; PIL's first three channels; chairs_2.0_train."""
    made = {}
    for split, names, count, folder in (("train", ["b", "a"], 5, "chairs_train/chairs_2.0_train"),
                                        ("test", ["z", "0f"], 251, "chairs_test")):
        for name in names:
            object_folder = os.path.join(root, "srn_chairs", folder, name)
            text(os.path.join(object_folder, "intrinsics.txt"), "131.25 64 64 0.\n0. 0. 0.\n1.\n128 128\n")
            poses, images = [], []
            for i in range(count):
                pose = camera(rng)
                text(f"{object_folder}/pose/{i:06d}.txt", " ".join(f"{v:.9g}" for v in pose.flat))
                images.append(picture(rng, f"{object_folder}/rgb/{i:06d}.png", 4)[:, :, :3])
                poses.append(pose)
            made[name] = poses, images, [(131.25 / 128 * SIDE,) * 2] * count
    for inputs, given in ((1, [64]), (2, [64, 128])):
        compare(f"srn test, {inputs} inputs", splat.Dataset(root, split="test"), ["0f", "z"], inputs,
                lambda name, given=given: given, 251, made.get)
    same("srn train", splat.Dataset(root, split="train").report["names"], ["a", "b"])
    same("srn subset", splat.Dataset(root, split="test", limit=1).report["names"], ["0f"])


def co3d(root, rng):
    """Views 0, or 0 and 30; excluded sequences; PyTorch3D's cameras."""
    names, frames = ["106_12648_23157", "10_1_2", "9_8_7"], 34
    folder = os.path.join(root, "co3d_hydrant_for_gs", "test")
    made, rotations, translations = {}, {}, {}
    for name in names:
        images = rng.integers(0, 256, (frames, SIDE, SIDE, 3))
        focals = rng.uniform(2, 4, (frames, 1, 2)).astype(numpy.float32)
        poses = [camera(rng) for _ in range(frames)]
        w2c = [numpy.linalg.inv(pose) for pose in poses]
        # p_camera = p_world R + T with x left and y up.
        flip = numpy.diag([-1.0, -1, 1])
        rotations[name] = numpy.array([(flip @ w[:3, :3]).T for w in w2c], numpy.float32)
        translations[name] = numpy.array([flip @ w[:3, 3] for w in w2c], numpy.float32)
        os.makedirs(os.path.join(folder, name))
        array = (images.transpose(0, 3, 1, 2) / 255).astype(numpy.float32)
        numpy.save(os.path.join(folder, name, "images_fg.npy"), array)
        numpy.save(os.path.join(folder, name, "images_full.npy"), 1 - array)
        numpy.save(os.path.join(folder, name, "focal_lengths.npy"), focals)
        text(os.path.join(folder, name, "frame_order.txt"), "".join(f"{i:05d}.png\n" for i in range(frames)))
        made[name] = poses, list(images), focals[:, 0] * SIDE / 2
    os.makedirs(os.path.join(folder, "1_bad_sequence"))  # the preprocessing leaves one with NaN like this
    numpy.savez(os.path.join(folder, "camera_Rs.npz"), **rotations)
    numpy.savez(os.path.join(folder, "camera_Ts.npz"), **translations)
    text(os.path.join(root, "bad_sequences.py"), "EXCLUDE_SEQUENCE = {\n    \"hydrant\": ['10_1_2', '4_4_4'],\n}\n")
    left = [name for name in sorted(names) if name != "10_1_2"]
    for inputs, given in ((1, [0]), (2, [0, 30])):
        dataset = splat.Dataset(root, split="test", excluded_file="bad_sequences.py")
        compare(f"co3d, {inputs} inputs", dataset, left, inputs, lambda name, given=given: given, frames, made.get)
    distances = splat.Dataset(root, split="test").read(0)["origin_distances"]
    # The origin along the axis of the absolute camera: -t z.
    near("co3d: distances", distances, [-pose[:3, 3] @ pose[:3, 2] for pose in made[sorted(names)[0]][0]])


def nmr(root, rng):
    """Lists of each category, the list of source views for tests, names "category_object"."""
    made = {}
    for category in ("02691156", "04530566"):
        for name in ("a1", "b2", "c3"):
            folder = os.path.join(root, category, name)
            images = [picture(rng, f"{folder}/image/{i:04d}.png") for i in range(24)]
            poses, arrays = [], {}
            for i in range(24):
                c2w = camera(rng)
                if name == "b2":
                    arrays[f"world_mat_{i}"] = numpy.linalg.inv(c2w)[:3]
                else:
                    arrays[f"world_mat_inv_{i}"] = c2w
                arrays[f"camera_mat_{i}"] = numpy.diag([3.7320509, 3.7320509, 1, 1])
                turn = numpy.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
                poses.append(turn @ c2w @ GL_TO_CV @ GL_TO_CV)
            numpy.savez(f"{folder}/cameras.npz", **arrays)
            made[f"{category}_{name}"] = poses, images, [(3.7320509 * SIDE / 2,) * 2] * 24
        text(os.path.join(root, category, "softras_train.lst"), "c3\na1\n")
        text(os.path.join(root, category, "softras_val.lst"), "b2\n")
        text(os.path.join(root, category, "softras_test.lst"), "a1\n")
    sources = {"04530566_b2": 7, "02691156_a1": 0, "02691156_c3": 23}
    text(os.path.join(root, "src_dvr.txt"),
         "".join(f"{' '.join(name.split('_'))} {view}\n" for name, view in sources.items()))
    compare("nmr val", splat.Dataset(root, split="val"), ["02691156_b2", "04530566_b2"], 1, lambda _: [0], 24,
            made.get)
    same("nmr train", splat.Dataset(root, split="train", views_file="src_dvr.txt").report["names"],
         ["02691156_c3", "02691156_a1", "04530566_c3", "04530566_a1"])
    test = splat.Dataset(root, split="test", views_file="src_dvr.txt")
    compare("nmr test", test, list(sources), 1, lambda name: [sources[name]], 24, made.get)
    compare("nmr test, 2 inputs", test, list(sources), 2,
            lambda name: [sources[name], 1 if sources[name] == 0 else 0], 24, made.get)


def renders(rng, folder, count):
    """RGBA and world-to-camera [3,4] with OpenGL's axes. Poses are scaled so that view 0 is 2 away."""
    poses, images = [], []
    for i in range(count):
        image = picture(rng, f"{folder}/{i:03d}.png", 4).astype(float)
        alpha = image[:, :, 3:] / 255
        images.append(image[:, :, :3] * alpha + 255 * (1 - alpha))
        pose = camera(rng)
        numpy.save(f"{folder}/{i:03d}.npy", (GL_TO_CV @ numpy.linalg.inv(pose))[:3])
        poses.append(pose)
    scale = 2 / numpy.linalg.norm(poses[0][:3, 3])
    for pose in poses:
        pose[:3, 3] *= scale
    return poses, images, [(140 / 128 * SIDE,) * 2] * count


def objaverse(root, rng):
    """The first 99 % of a list, rounded down, are for training."""
    names = [f"{i:02d}{'abc'[i % 3]}" for i in range(7)]
    made = {name: renders(rng, os.path.join(root, name), 3) for name in names}
    order = [names[i] for i in (5, 2, 6, 0, 3)]
    text(os.path.join(root, "lvis.json"), json.dumps(order))
    cut = math.floor(len(order) / 100.0 * 99.0)
    options = {"objects_file": "lvis.json", "background": (1, 1, 1)}
    same("objaverse train", splat.Dataset(root, split="train", **options).report["names"], order[:cut])
    compare("objaverse val", splat.Dataset(root, split="val", **options), order[cut:], 1, lambda _: [0], 3, made.get)
    try:
        splat.Dataset(root, split="test", **options)
        sys.exit("FAILED: Objaverse has a split for tests")
    except splat.NotFound as error:
        same("objaverse test", "no split 'test'" in str(error), True)


def gso(root, rng):
    """All objects and all 25 views are evaluated from view 0; nothing is trained."""
    made = {name: renders(rng, os.path.join(root, name, "render_mvs_25", "model"), 25)
            for name in ("Shoe_B", "Ark_2", "box")}
    for split in ("val", "test"):
        compare(f"gso {split}", splat.Dataset(root, split=split, background=(1, 1, 1)), sorted(made), 1,
                lambda _: [0], 25, made.get)
    try:
        splat.Dataset(root, split="train")
        sys.exit("FAILED: GSO has a split for training")
    except splat.NotFound as error:
        same("gso train", "for evaluation only" in str(error), True)


def main():
    rng = numpy.random.default_rng(11)
    for layout in (srn, co3d, nmr, objaverse, gso):
        with tempfile.TemporaryDirectory() as folder:
            layout(folder, rng)
    print("all agree")


main()
