"""Arguments of wrong kinds, refused by their names; sentences in the words of Python."""
import copy
import pickle
import re
import unittest
from unittest import mock
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Tuple

import numpy as np

import libsplat as splat
from libsplat import _native
from libsplat._text import checked
from libsplat._errors import in_python
from shared import Case, cameras, picture, scene, values

SOURCES = Path(__file__).resolve().parents[3] / "src"


class Kinds(Case):
    """TypeErrors before anything else happens, one mechanism for all functions."""

    def test_objects_of_other_classes(self) -> None:
        made, camera, make = scene(), cameras()[0], splat.Camera
        cases: Tuple[Any, ...] = (
            ("Predictor(): device is a str, expected a Device or None", splat.Predictor, "a.pth"),
            ("Camera.orbit(): scene is a str, expected a Scene", make.orbit, "scene.ply", 1),
            ("Scene.merge(): scenes[0] is a str, expected a Scene", splat.Scene.merge, ["a"]),
            ("Scene.merge(): scenes is a Scene, expected a sequence", splat.Scene.merge, made),
            ("Tensor(): device is None, expected a Device", splat.Tensor, None, [1]),
            ("render(): scene is a Camera, expected a Scene", splat.render, camera, made),
            ("render(): scene is a str, expected a Scene", splat.render, "x.ply", camera),
            ("render(): cameras[1] is None, expected a Camera", splat.render, made, [camera, None]),
            ("render(): cameras is an int, expected a Camera or", splat.render, made, 3),
            ("Camera(): fx is a str, expected a number", make, 3, 4, "a"),
            ("Camera(): fx is a list, expected a number", make, 3, 4, [5]),
            ("Scene.transform(): scale is None, expected a number", made.transform, (1, 0, 0, 0),
             (0, 0, 0), None),
            ("save_cameras(): cameras[0] is a str, expected a Camera", splat.save_cameras, "a", ["a"]),
            ("Lpips(): weights is a Weights, expected a sequence", splat.Lpips, splat.Weights({}), 9),
            ("Op(): inputs[0] is an int, expected a Tensor or None", splat.Op, self.device, "silu",
             [3], [4]),
            ("Weights(): arrays is a list, expected a mapping", splat.Weights, [1]),
            ("Evaluator(): predictor is a str, expected a Predictor", splat.Evaluator, "a"),
            ("Model.load(): weights is a str, expected a Weights", splat.Model.load, None, "a"),
            ("set_log(): callback is an int, expected a function or None", splat.set_log, 3),
            ("depth_points(): camera is a numpy.ndarray", splat.depth_points, values(3, 3), values(3))
        )
        for words, function, *given in cases:
            error = self.refused(TypeError, words, function, *given)
            self.assertIsNone(error.__context__)
        self.refused(TypeError, "render(): device is a str, expected a Device or None",
                     splat.render, made, camera, device="cpu")

    def test_every_method_that_takes_an_object_refuses_another(self) -> None:
        tried = 0
        for name in splat.__all__:
            kind = getattr(splat, name)
            for method in (vars(kind).values() if isinstance(kind, type) else [kind]):
                function = getattr(method, "__func__", method)
                hints = list(getattr(function, "__annotations__", {}).items())
                if not callable(function) or not hints or hints[0][0] == "return" or hints[0][1] not in (
                        splat.Scene, splat.Device, splat.Dataset, splat.Weights, splat.Batch):
                    continue
                arguments = [None] * (not isinstance(method, staticmethod) and isinstance(kind, type))
                self.refused(TypeError, f"{hints[0][0]} is an object, expected a", function,
                             *arguments, object())
                tried += 1
        self.assertGreater(tried, 12)

    def test_numbers_that_c_takes(self) -> None:
        for number in (5, 5.0, np.float32(5), np.int64(5), np.array(5.0), True):
            self.assertEqual(splat.Camera(4, 4, number).fx, float(number))  # type: ignore[arg-type]

    def test_what_it_leaves_alone(self) -> None:
        def plain(a: float, *more: float, path: "Missing" = None,  # type: ignore[name-defined] # noqa: F821
                  **named: Any) -> Any:
            """Text."""
            return a, more, path, named

        function: Any = checked(plain)
        self.assertEqual(function(1, "b", path=3, c=4), (1, ("b",), 3, {"c": 4}))
        self.assertEqual((function.__name__, function.__doc__), ("plain", "Text."))
        self.refused(TypeError, "missing 1 required", function)
        self.refused(TypeError, "plain(): a is a bytes", function, b"1")

    def test_names_that_are_missing(self) -> None:
        weights = splat.Weights({"a": values(2), "b": values(3)})
        error = self.refused(splat.MissingName, "'zz'", lambda: weights["zz"])
        self.assertIsInstance(error, KeyError)
        self.assertIsInstance(error, splat.NotFound)
        again = pickle.loads(pickle.dumps(error))
        self.assertEqual((type(again), str(again)), (splat.MissingName, str(error)))
        for call in (weights.view, weights.info):
            self.refused(splat.MissingName, "'zz'", call, "zz")
        self.assertIsInstance(weights, Mapping)
        self.assertIsNone(weights.get("zz"))
        self.assertEqual(weights.keys(), {"a", "b"})
        self.assertEqual([name for name, _ in weights.items()], ["a", "b"])
        self.assertEqual([len(array) for array in weights.values()], [2, 3])
        self.assertEqual(weights, splat.Weights({"b": values(3), "a": values(2)}))
        self.assertEqual(weights, {"a": values(2), "b": values(3)})
        self.assertNotEqual(weights, splat.Weights({"a": values(2), "b": -values(3)}))
        self.assertNotEqual(weights, splat.Weights({"a": values(2)}))

    def test_other_kinds_of_arrays(self) -> None:
        self.refused(splat.InvalidArgument, "expected numbers in an array", splat.Scene, object())
        self.refused(splat.InvalidArgument, "means is a str, expected numbers in an array",
                     splat.Scene, "abc")
        self.refused(TypeError, "means of a Scene cannot be deleted", delattr, scene(), "means")
        with self.assertRaises(splat.ShapeMismatch):
            scene().means = 5  # type: ignore[assignment]
        usable: bool = self.device.info.usable
        self.assertIs(usable, True)
        self.assertEqual(splat.Tensor.zeros(self.device, np.int64(3)).shape,  # type: ignore[arg-type]
                         (3,))

    def test_numbers_beyond_a_type(self) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            self.refused(splat.InvalidArgument, "data has 1e+300, which float32 cannot hold",
                         splat.Tensor, self.device, [1.0, 1e300])
            tensor = splat.Tensor(self.device, np.zeros(2, np.int32))
            self.refused(splat.InvalidArgument, "which int32 cannot hold", tensor.write, [1, 2.5])
            self.refused(splat.InvalidArgument, "which int32 cannot hold", tensor.write, [1, 1 << 31])
            tensor.write([1, 2.0])
            infinite = splat.Tensor(self.device, [float("inf"), float("nan")]).numpy()
        self.assertEqual((infinite[0], infinite[1] != infinite[1]), (np.inf, True))


class Cameras(Case):
    """Numbers of a camera, refused where they are given."""

    def test_numbers_can_be_read_and_set(self) -> None:
        camera = splat.Camera(40, 30, 50)
        camera.fx, camera.cy = 60, 14.5
        self.assertEqual((camera.fx, camera.fy, camera.cx, camera.cy), (60, 50, 20, 14.5))
        self.assertEqual(camera.intrinsics, (60, 50, 20, 14.5))
        other = camera.__replace__(fy=70, name="b")
        self.assertEqual((other.intrinsics, other.name), ((60, 70, 20, 14.5), "b"))
        self.assertEqual(camera.__replace__(), camera)
        replace = getattr(copy, "replace", None)  # Python has it since 3.13
        if replace is not None:
            self.assertEqual(replace(camera, width=41).width, 41)

    def test_what_render_would_refuse(self) -> None:
        make, camera = splat.Camera, splat.Camera(4, 4, 5)
        cases: Tuple[Any, ...] = (
            ("focal lengths", {"fx": -1}), ("focal lengths", {"fx": float("nan")}),
            ("focal lengths", {"fy": 0}), ("principal point", {"cx": float("inf")}),
            ("0 x 4 pixels", {"width": 0}))
        for words, given in cases:
            self.refused(splat.InvalidArgument, words, make, **{"width": 4, "height": 4, "fx": 5,
                                                                **given})
        for name, value in (("fx", -1), ("fy", float("nan")), ("cx", float("inf")), ("cy", 1e30)):
            self.refused(splat.InvalidArgument, "", setattr, camera, name, value)
        self.refused(TypeError, "fx is a str, expected a number", setattr, camera, "fx", "a")
        moved, mirror, flat, lost = (np.eye(4) for _ in range(4))
        moved[3, 0], mirror[0, 0], flat[1, 1], lost[0, 3] = 2, -1, 0, np.nan
        for words, matrix in (("last row", moved), ("mirrors", mirror), ("singular", flat),
                              ("not finite", lost)):
            self.refused(splat.InvalidArgument, words, make, 4, 4, 5, world_to_camera=matrix)
            self.refused(splat.InvalidArgument, words, setattr, camera, "world_to_camera", matrix)
        self.assertEqual(camera, splat.Camera(4, 4, 5))
        half = splat.Camera(4, 4, 5, world_to_camera=np.diag([0.5, 0.5, 0.5, 1]))
        splat.render(scene(), half)


class Equality(Case):
    """What holds arrays can be compared."""

    def test_pictures(self) -> None:
        a, b = splat.Picture(picture(), focal=3), splat.Picture(picture(), focal=3)
        self.assertEqual(a, b)
        b.image = picture()[:9]
        self.assertNotEqual(a, b)
        self.assertNotEqual(a, 5)

    def test_predictions(self) -> None:
        predictor = splat.Predictor(self.device)
        one, two = predictor.predict(picture()), predictor.predict(picture()[::-1])
        self.assertEqual(one, one)
        self.assertNotEqual(one, two)


class Protocols(unittest.TestCase):
    """What Python expects of containers and values."""

    def test_a_tensor_without_dimensions_has_no_elements_to_visit(self) -> None:
        with self.assertRaisesRegex(TypeError, "0-d"):
            list(splat.Tensor(splat.default_device(), 5.0))

    def test_keys_that_are_no_text_are_missing(self) -> None:
        weights = splat.Weights({"a": [1.0]})
        for key in ("b", "a\0"):
            self.assertIsNone(weights.get(key))
            with self.assertRaises(KeyError):
                weights[key]  # pylint: disable=pointless-statement

    def test_others_decide_what_they_equal(self) -> None:
        camera = splat.Camera(4, 4, 5)
        self.assertEqual(camera, mock.ANY)
        self.assertNotEqual(camera, 3)

    def test_numbers_beyond_all_types_have_the_name_of_their_argument(self) -> None:
        with self.assertRaisesRegex((TypeError, ValueError), "fx"):
            splat.Camera(4, 4, 10**400)

    def test_parts_of_cameras_are_bytes(self) -> None:
        with self.assertRaisesRegex(splat.InvalidArgument, "bytes"):
            splat.Camera.load(("", b"x"))


class Sentences(unittest.TestCase):
    """Names of Python in what the library says."""

    def test_functions_and_arguments(self) -> None:
        for given, wanted in (
                ("tensor 'a' is mapped; end that first (splat_tensor_unmap)",
                 "tensor 'a' is mapped; end that first (the block of Tensor.map)"),
                ("splat_device_cancel cancelled the call", "Device.cancel cancelled the call"),
                ("splat_model_desc.objects is 9", "objects is 9"),
                ("splat_evaluator_desc: dataset and data_path are both given",
                 "Evaluator: dataset and data_path are both given"),
                ("call splat_rasterizer_forward first", "call Rasterizer.forward first"),
                ("the flags ask for SPLAT_RASTERIZER_DEPTH", "the flags ask for depth=True"),
                ("the model's 'splat_image.ply' (or 'my splat_model_desc.x') of splat_model_load",
                 "the model's 'splat_image.ply' (or 'my splat_model_desc.x') of Model.load"),
                ("raise timeout_ns, from_param or grad_means", "raise timeout, from_param or means"),
                ("a/splat_image.ply is no file", "a/splat_image.ply is no file"),
                ("cannot open 'it's splat_scene.ply'", "cannot open 'it's splat_scene.ply'"),
                ("what is 7, expected SPLAT_EXPORT_*", "what is 7, expected a name of Export"),
                ("out of memory", "out of memory"), ("libsplat_x of someone", "libsplat_x of someone")):
            self.assertEqual(in_python(given), wanted)

    def test_every_sentence_of_the_library(self) -> None:
        if not SOURCES.is_dir():
            self.skipTest("the sources of the library are not here")
        said = [text for path in SOURCES.rglob("*.cpp")
                for line in path.read_text("utf-8").splitlines() if "#include" not in line
                for text in re.findall(r'"((?:[^"\\]|\\.)*)"', line) if "splat_" in text]
        self.assertGreater(len(said), 70)
        functions = {row[0] for row in _native.FUNCTIONS}
        left = {name for text in said for name in re.findall(r"splat_\w+", in_python(text.replace("%s", "x")))}
        marks = {"splat_synthetic_write", "splat_co3d_prepare"}  # folders name their maker
        self.assertEqual(left & functions, marks)

    def test_names_of_choices_are_the_documented_ones(self) -> None:
        with self.assertRaisesRegex(splat.InvalidArgument, "'bogus', expected one of 3dgs, gsplat"):
            splat.Rasterizer(None, 1, 4, 4, convention="bogus")  # type: ignore[arg-type]
