#!/usr/bin/env python3
"""A network whose head takes depths, as users train it and predict with it: f3d_test.py VKRUN FOLDER"""

import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import unittest
import zlib

VKRUN, FOLDER = map(pathlib.Path, sys.argv[1:3])
SMALL = ["model.head=f3d", "data.use_mask=true", "data.training_resolution=16", "model.base_dim=16",
         "model.attention_resolutions=[8]", "model.opacity_bias=1", "model.scale_bias=0.1", "opt.iterations=4",
         "opt.batch_size=2", "opt.imgs_per_obj=2", "opt.cycle.every=2", "logging.val_log=0", "logging.val_objects=1",
         "logging.val_views=1"]


def vkrun(status, *words):
    done = subprocess.run([VKRUN, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          env=dict(os.environ), check=False)
    if done.returncode != status:
        raise AssertionError(f"{words} ended with {done.returncode}, expected {status}: {done.stdout} {done.stderr}")
    return done.stdout + done.stderr


def png(path, width, height, channels, bits, values):
    """A PNG of samples by row, column and channel."""
    line, order = width * channels, ">%dH" if bits == 16 else ">%dB"
    rows = b"".join(b"\0" + struct.pack(order % line, *values[y * line:(y + 1) * line]) for y in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, bits, {1: 0, 3: 2}[channels], 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) +
                     chunk(b"IEND", b""))


class F3d(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        FOLDER.mkdir(parents=True)
        vkrun(0, "data", "synth", FOLDER / "data", "--objects", 2, "--test", 1, "--size", 16, "--seed", 1)
        sets = [word for key in SMALL for word in ("--set", key)]
        vkrun(0, "train", "small", "--data", FOLDER / "data", "--out", FOLDER / "run", *sets)
        cls.weights = FOLDER / "run" / "weights_last.safetensors"
        png(FOLDER / "photo.png", 40, 30, 3, 8, [(37 * i) % 256 for i in range(3600)])
        png(FOLDER / "depth.png", 40, 30, 1, 16, [2000 + 20 * (i % 40) for i in range(1200)])
        png(FOLDER / "square.png", 30, 30, 1, 8, [i % 251 for i in range(900)])

    def predict(self, status, *words):
        return vkrun(status, "predict", FOLDER / "photo.png", "--weights", self.weights, "--views", 2, "--out",
                     FOLDER / "out", *words)

    def test_training_makes_it_and_predicts_objects(self):
        config = json.loads((FOLDER / "run" / "config.json").read_text(encoding="utf-8"))
        self.assertEqual(config["model"]["head"]["like"], "f3d")
        self.assertEqual(config["opt"]["cycle"]["every"], 2)
        said = json.loads(vkrun(0, "predict", "--data", FOLDER / "data", "--object", 0, "--weights", self.weights,
                                "--views", 2, "--out", FOLDER / "object", "--json"))
        self.assertEqual(said["gaussians"] + said["faint"], 256)
        self.assertGreater(said["psnr_input"], 3)

    def test_photographs_need_depth(self):
        self.assertIn("the network takes depth and no normal map: give --depth", self.predict(2))
        said = json.loads(self.predict(0, "--depth", FOLDER / "depth.png", "--json"))
        self.assertEqual(said["gaussians"] + said["faint"], 256)
        self.assertEqual(said["photo"]["mask"], "nothing")
        self.assertEqual(said["photo"]["square"][2], 30)
        self.assertNotIn("warnings", said)
        self.assertIn("expected the proportion of the image's 40 x 30",
                      self.predict(4, "--depth", FOLDER / "square.png"))
        self.assertIn("--foreground: the network takes whole pictures",
                      self.predict(2, "--depth", FOLDER / "depth.png", "--foreground", 0.5))

    def test_larger_is_nearer_or_farther(self):
        scenes = []
        for word in ("nearer", "farther"):
            self.predict(0, "--depth", FOLDER / "depth.png", "--larger", word)
            scenes.append((FOLDER / "out" / "scene.ply").read_bytes())
        self.predict(0, "--depth", FOLDER / "depth.png")
        self.assertEqual((FOLDER / "out" / "scene.ply").read_bytes(), scenes[0])
        self.assertNotEqual(scenes[0], scenes[1])
        self.assertIn("--larger goes with --depth", self.predict(2, "--larger", "nearer"))
        self.assertIn("--larger: the head of the network takes no depths",
                      vkrun(2, "predict", FOLDER / "photo.png", "--depth", FOLDER / "depth.png", "--larger", "nearer"))

    def test_larger_is_nearer_in_maps_of_geometry(self):
        model = FOLDER / "moge-2-vits-normal.safetensors"
        subprocess.run([os.environ["WRITE_SMALL_MOGE"], model], check=True)
        vkrun(0, "priors", "depth", FOLDER / "photo.png", "--out", FOLDER / "maps", "--model", model)
        self.predict(0, "--depth", FOLDER / "maps" / "depth" / "photo.png", "--larger", "nearer")
        scene = (FOLDER / "out" / "scene.ply").read_bytes()
        config = json.loads((FOLDER / "run" / "config.json").read_text(encoding="utf-8"))
        config["model"]["head"]["depth_maps"] = "farther"
        (FOLDER / "farther.json").write_text(json.dumps(config), encoding="utf-8")
        said = json.loads(self.predict(0, "--geometry", model, "--config", FOLDER / "farther.json", "--json"))
        self.assertEqual(said["photo"]["geometry"]["used"], ["depth"])
        self.assertEqual((FOLDER / "out" / "scene.ply").read_bytes(), scene)

    def test_geometry_that_is_not_needed_is_told(self):
        depth = ["--depth", FOLDER / "depth.png"]
        self.assertIn("there is no preset 'nonsense'", self.predict(4, *depth, "--geometry", "nonsense"))
        self.assertIn("warning: --geometry moge-2-vits was not used",
                      self.predict(0, *depth, "--geometry", "moge-2-vits"))
        self.assertIn("--geometry goes with one IMAGE", self.predict(2, FOLDER / "photo.png", "--geometry", "x"))

    def test_depths_are_compared_as_they_are_drawn(self):
        errors = []
        for name in ("3dgs", "ray_maximum"):
            said = json.loads(self.predict(0, "--depth", FOLDER / "depth.png", "--true-depth", FOLDER / "depth.png",
                                           "--convention", name, "--json"))
            errors.append(said["depth"]["error"])
        self.assertNotEqual(errors[0], errors[1])

    def test_drawn_views_are_joined(self):
        said = json.loads(self.predict(0, "--depth", FOLDER / "depth.png", "--aggregate", 3, "--json"))
        self.assertEqual(said["gaussians"] + said["faint"], 4 * 256)
        scene = (FOLDER / "out" / "scene.ply").read_bytes()
        self.predict(0, "--depth", FOLDER / "depth.png", "--aggregate", 3, "--convention", "ray_maximum")
        self.assertNotEqual((FOLDER / "out" / "scene.ply").read_bytes(), scene)
        self.assertIn("aggregation over 1 views, expected 0, or 2 to 64",
                      self.predict(2, "--depth", FOLDER / "depth.png", "--aggregate", 1))


shutil.rmtree(FOLDER, ignore_errors=True)
unittest.main(argv=sys.argv[:1])
