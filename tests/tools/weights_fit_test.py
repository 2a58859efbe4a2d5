#!/usr/bin/env python3
"""Weights without a configuration, as vkrun takes them: weights_fit_test.py VKRUN FOLDER

The files have those tensors of the published networks by which they are told apart, so that the configuration is
found and loading then misses a tensor.
"""

import array
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import unittest

VKRUN, FOLDER = map(pathlib.Path, sys.argv[1:3])
ENCODER = "network_with_offset.encoder.enc."
FIT = "the published one of cars, which it fits, is taken"


def write(path, size=128, base=128, blocks=4, fov=51.98948897809546):
    """A file like those of SRN cars and chairs."""
    tensors = {f"{ENCODER}{size}x{size}_conv.weight": [base, 3, 3, 3], "network_with_offset.out.weight": [24, 24, 1, 1]}
    for level in range(4):
        width, side = base * (1 if level == 0 else 2), size >> level
        for block in range(blocks):
            name = f"{ENCODER}{side}x{side}_block{block}"
            tensors |= {f"{name}.norm0.weight": [width], f"{name}.conv1.bias": [width]}
            if side == 16:
                tensors[f"{name}.qkv.weight"] = [3 * width, width, 1, 1]
    last = math.tan(math.radians(fov / 2)) * (size - 1) / size
    row = [last * (2 * i / (size - 1) - 1) for i in range(size)]
    data = bytearray(array.array("f", row * 3 * size).tobytes())
    header = {"ray_dirs": {"dtype": "F32", "shape": [1, 3, size, size], "data_offsets": [0, len(data)]}}
    for name, shape in tensors.items():
        start = len(data)
        data += bytes(4 * math.prod(shape))
        header[name] = {"dtype": "F32", "shape": shape, "data_offsets": [start, len(data)]}
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    path.write_bytes(len(text).to_bytes(8, "little") + text + data)


def vkrun(status, *words):
    done = subprocess.run([VKRUN, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          env=dict(os.environ), check=False)
    if done.returncode != status:
        raise AssertionError(f"{words} ended with {done.returncode}, expected {status}: {done.stdout} {done.stderr}")
    return done.stdout + done.stderr


class WeightsFit(unittest.TestCase):
    def setUp(self):
        self.folder = FOLDER / self.id().split(".")[-1]
        self.folder.mkdir(parents=True)

    def weights(self, name, **shape):
        write(self.folder / name, **shape)
        return self.folder / name

    def predict(self, status, weights):
        return vkrun(status, "predict", self.folder / "photo.png", "--weights", weights, "--out", self.folder / "out")

    def test_name_decides_between_cars_and_chairs(self):
        said = self.predict(4, self.weights("model_cars.safetensors"))
        self.assertIn(f"no configuration lies beside '{self.folder}/model_cars.safetensors'; {FIT}", said)
        self.assertIn("has no tensor 'network_with_offset.encoder", said)
        said = self.predict(2, self.weights("mine.safetensors"))
        self.assertIn("its tensors fit the published configurations cars, chairs: name one with --config", said)

    def test_field_of_view_decides(self):
        said = self.predict(2, self.weights("model_cars.safetensors", fov=49.134342641202636))
        self.assertIn("fit the published configurations gso, objaverse: name one", said)
        said = self.predict(4, self.weights("model_latest.safetensors", fov=49.13))
        self.assertIn("the published one of objaverse, which it fits, is taken", said)

    def test_nearest_and_what_differs_are_named(self):
        said = self.predict(2, self.weights("model_cars.safetensors", base=64, blocks=2))
        self.assertIn("its tensors fit no published configuration; the nearest is cars, but model.base_dim is 64 "
                      "(there 128), model.num_blocks is 2 (there 4): name one with --config", said)
        said = self.predict(2, self.weights("model_cars.safetensors", fov=60))
        self.assertIn("the field of view of ray_dirs is 60 degrees (there 51.99 degrees)", said)

    def test_conversion_writes_what_was_found(self):
        named = self.weights("model_cars.safetensors")
        vkrun(0, "weights", "convert", named, self.folder / "mine.npz")
        config = json.loads((self.folder / "mine.json").read_text(encoding="utf-8"))
        self.assertEqual(config["data"]["category"], "cars")
        self.assertNotIn("no configuration", self.predict(4, self.folder / "mine.npz"))
        said = vkrun(0, "weights", "convert", self.weights("other.safetensors"), self.folder / "other.npz")
        self.assertIn("so none beside", said)
        self.assertIn("fit the published configurations cars, chairs", said)

    def test_report_says_it(self):
        shown = json.loads(vkrun(0, "weights", "show", self.weights("model_chairs.safetensors"), "--json"))
        self.assertEqual(shown["published"], {"fit": ["chairs"], "head": "splatter", "nearest": "", "differences": [],
                                              "sentence": "its tensors fit the published configuration chairs"})
        self.assertIn("fit the published configurations cars, chairs; model.head is splatter",
                      vkrun(0, "weights", "show", self.weights("x.safetensors")))


shutil.rmtree(FOLDER, ignore_errors=True)
unittest.main(argv=sys.argv[:1])
