"""Models of depth, normals and masks. Those that run need ONNX Runtime: tests/interop/onnx.sh sets
SPLAT_ONNXRUNTIME_LIBRARY, and SPLAT_ONNX_SAMPLES is a folder of write_onnx_samples."""
import os
import unittest
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import libsplat as splat
from shared import Case, picture

SAMPLES = os.environ.get("SPLAT_ONNX_SAMPLES")


class Presets(Case):
    """Kinds of models."""

    def test_presets_are_dicts(self) -> None:
        names = splat.prior_presets()
        self.assertIn("u2net", names)
        preset = splat.prior_preset("u2net")
        self.assertEqual((preset["name"], preset["outputs"][0]["map"]), ("u2net", "mask"))
        with self.assertRaisesRegex(splat.NotFound, "did you mean 'u2net'"):
            splat.prior_preset("u3net")

    def test_wrong_models_are_refused(self) -> None:
        with self.assertRaisesRegex(splat.InvalidArgument, "neither a preset nor"):
            splat.PriorModel()
        with self.assertRaisesRegex(splat.InvalidArgument, "needs a text 'name'"):
            splat.PriorModel({"input": {}}, "model.onnx")
        with self.assertRaisesRegex(splat.NotFound, "no.so"):
            splat.PriorModel("u2net", __file__, runtime="/nowhere/no.so")
        with TemporaryDirectory() as folder:  # weights by their content get a device
            splat.Weights({"a": np.zeros(1, np.float32)}).save(f"{folder}/a.npz")
            with self.assertRaisesRegex(splat.FormatError, "not the weights of MoGe-2"):
                splat.PriorModel("moge-2-vits-normal", f"{folder}/a.npz")


@unittest.skipUnless(SAMPLES, "run by tests/interop/onnx.sh: needs ONNX Runtime")
class Models(Case):
    """Maps of a picture."""

    def test_maps_of_a_picture(self) -> None:
        model = splat.PriorModel("moge-2-vits", Path(str(SAMPLES)) / "moge-2-vits.onnx")
        self.assertEqual((model.info.maps, model.info.width), (splat._native.DataFlags(7), 0))
        rgb = picture()[:, :, :3]
        maps = model.run(rgb)
        self.assertEqual(sorted(maps), ["depth", "mask", "normal"])
        self.assertEqual(maps["normal"].shape, rgb.shape)
        self.assertEqual((maps["depth"].min(), maps["depth"].max()), (0, 255))
        floats = model.run(rgb, ["depth"], np.float32)["depth"]
        self.assertLessEqual(np.abs(maps["depth"] - np.floor(floats * 255)).max(), 1)
        with self.assertRaisesRegex(splat.InvalidArgument, "'edges'"):
            model.run(rgb, ["edges"])
        model.close()
        with self.assertRaises(splat.InvalidHandle):
            model.run(rgb)
