"""Scenes, cameras and images."""
import copy
import io
import math
import pickle
from typing import Any

import numpy as np

import libsplat as splat
from shared import Case, arrays, cameras, picture, scene, values


class Titled(splat.Scene):
    """A class of a caller."""

    def __init__(self, given: splat.Scene, title: str) -> None:
        super().__init__(given.means, log_scales=given.log_scales, rotations=given.rotations,
                         opacity_logits=given.opacity_logits, sh=given.sh)
        self.title = title


class Scenes(Case):
    """Arrays, files, changes."""

    def test_attributes(self) -> None:
        given = arrays(20, 2)
        made = splat.Scene(given["means"], **{k: v for k, v in given.items() if k != "means"})
        self.assertEqual((len(made), made.sh_degree, made.info.count), (20, 2, 20))
        for name, array in given.items():
            np.testing.assert_allclose(getattr(made, name), array, rtol=1e-5, atol=1e-6)
        made.means = given["means"] * 2
        np.testing.assert_array_equal(made.means, given["means"] * 2)
        np.testing.assert_allclose(made.log_scales, np.log(given["scales"]), rtol=1e-5)
        with made.tensor("opacities", self.device) as tensor:
            np.testing.assert_allclose(tensor, given["opacities"], rtol=1e-5, atol=1e-6)

    def test_any_layout(self) -> None:
        base = values(6, 8)
        for means in (base[::2, 1::3], base[:3, :3].T, base[::-1, 5:], base[:, 7:1:-2],
                      np.broadcast_to(base[0, :3], (4, 3)), np.asfortranarray(base[:, :3])):
            made = splat.Scene(means)
            np.testing.assert_array_equal(made.means, means)
            made.means = means[::-1]
            np.testing.assert_array_equal(made.means, means[::-1])

    def test_writes_into_copies_are_refused(self) -> None:
        made = scene(20)
        for name in ("means", "scales", "log_scales", "rotations", "opacities", "opacity_logits",
                     "sh"):
            array = getattr(made, name)
            self.refused(ValueError, "read-only", array.__setitem__, 0, 99)
            self.refused(ValueError, "", array.setflags, write=True)
            setattr(made, name, array.copy())
            made.read(name)[0] = 0  # a method is expected to give a new array

    def test_defaults_and_none_at_all(self) -> None:
        made = splat.Scene(values(3, 3))
        np.testing.assert_array_equal(made.rotations, [[1, 0, 0, 0]] * 3)
        np.testing.assert_array_equal(made.opacities, [0.5] * 3)
        empty = splat.Scene(np.zeros((0, 3), np.float32))
        self.assertEqual((len(empty), empty.means.shape), (0, (0, 3)))
        self.refused(splat.InvalidState, "Gaussians", empty.tensor, "means", self.device)

    def test_files_and_bytes(self) -> None:
        made = scene(20, 1)
        self.assertEqual({each["name"] for each in splat.scene_formats()} >= {"ply", "spz"}, True)
        names: Any = ("ply", "spz", "splat")
        for name in names:
            path = self.folder / f"a.{name}"
            made.save(path)
            self.assertEqual(path.read_bytes(), made.to_bytes(name))
            self.assertEqual(len(splat.Scene.load(path)), 20)
            self.assertEqual(len(splat.Scene.load(str(path))), 20)
            self.assertEqual(splat.Scene.peek(path, format=name),
                             (20, splat.Scene.load(path).sh_degree))
            again = splat.Scene.load(made.to_bytes(name), format=name)
            self.assertEqual(again.report["format"], name)
        np.testing.assert_array_equal(splat.Scene.load(made.to_bytes("ply")).sh, made.sh)
        self.assertEqual(splat.Scene.load(memoryview(made.to_bytes("ply")), sh_degree=0).sh_degree,
                         0)

    def test_changes(self) -> None:
        made = scene(20)
        means = made.means
        made.transform((0, 0, 0, 1), (1, 2, 3), 2)
        np.testing.assert_allclose(made.means, means * [-2, -2, 2] + [1, 2, 3], atol=1e-5)
        self.assertEqual(len(splat.Scene.merge([made, made])), 40)
        made.crop(made.means.min(0), made.means[0].tolist())
        self.assertLess(len(made), 20)
        left = made.means
        made.crop_sphere(left[0], 1e-6)
        np.testing.assert_array_equal(made.means, left[:1])
        self.assertRaises(splat.InvalidArgument, made.crop_sphere, (0, 0, 0), -1)
        made.set_sh_degree(2)
        self.assertEqual((made.sh_degree, made.sh.shape), (2, (1, 9, 3)))
        self.assertEqual(made.info.bytes, 4 * (3 + 3 + 4 + 1 + 27))
        self.assertRaises(splat.InvalidArgument, made.set_sh_degree, 4)
        made.filter(0.99, finite=True, sort=True)
        self.assertTrue((made.opacities >= 0.98).all())

    def test_parts(self) -> None:
        made = scene(20, 1)
        chosen = made.opacities > 0.5
        places: Any = (slice(3, 9), slice(None, None, -2), [4, 4, -1], np.array([0]), chosen)
        for index in places:
            part = made[index]
            for name in ("means", "log_scales", "rotations", "opacity_logits", "sh"):
                np.testing.assert_array_equal(part.read(name), made.read(name)[index])
        self.assertEqual((len(made[99:]), made[99:].sh_degree), (0, 1))
        self.refused(TypeError, "scene[3:4] is a Scene of one", lambda: made[3])
        self.refused(TypeError, "not indexed by a tuple", lambda: made[..., 0])
        self.refused(IndexError, "20", lambda: made[[20]])
        self.refused(TypeError, "iterate over an attribute", list, made)
        self.refused(TypeError, "", lambda: 3.5 in made)  # type: ignore[operator]

    def test_copies_and_pickles(self) -> None:
        made = scene(20, 2)
        made.rotations = made.rotations * np.float32(3)
        for again in (copy.copy(made), copy.deepcopy(made), pickle.loads(pickle.dumps(made)), made[:]):
            self.assertEqual(again, made)
            self.assertEqual(again.to_bytes("ply"), made.to_bytes("ply"))
            again.means = again.means + np.float32(1)
            self.assertNotEqual(again, made)
        self.assertNotEqual(made, made[:19])
        self.assertNotEqual(made, 3)
        self.assertNotEqual(scene(2, 1), scene(2, 2))
        broken = splat.Scene(np.full((2, 3), np.nan, np.float32))
        self.assertEqual(pickle.loads(pickle.dumps(broken)), broken)
        empty = scene(20, 3)[:0]
        self.assertEqual(copy.copy(empty), empty)
        flags = splat.DrawnFlags.ANTIALIASED | splat.DrawnFlags.LINEAR_COLORS
        made = splat.Scene(np.zeros((2, 3), np.float32), drawn_as=flags)
        for again in (copy.copy(made), pickle.loads(pickle.dumps(made)), made[:1]):
            self.assertEqual(again.info.drawn_as, flags)
        self.refused(splat.InvalidArgument, "drawn_as", splat.Scene, np.zeros((2, 3), np.float32), drawn_as=1)
        made = scene(20, 2)
        named = copy.copy(Titled(made, "a"))
        self.assertEqual((type(named), named.title, named), (Titled, "a", made))

    def test_notebooks_show_it(self) -> None:
        self.assertTrue((scene()._repr_png_() or b"").startswith(b"\x89PNG"))
        closed = scene()
        closed.close()
        for none in (scene()[:0], closed):
            self.assertIsNone(none._repr_png_())

    def test_open_files(self) -> None:
        made = scene(20)
        made.save(self.folder / "a.ply")
        (self.folder / "a.txt").write_text("ply")
        with open(self.folder / "a.ply", "rb") as file:
            self.assertEqual(splat.Scene.load(file), splat.Scene.load(self.folder / "a.ply"))
        self.assertEqual(len(splat.Scene.load(io.BytesIO(made.to_bytes("ply")))), 20)
        with open(self.folder / "a.txt") as text:
            self.refused(splat.InvalidArgument, "gives a str, expected a path, bytes, or a file that",
                         splat.Scene.load, text)
        self.refused(splat.InvalidArgument, "an int, expected a path, bytes, or", splat.Scene.load, 3)
        image, weights, views = picture(), splat.Weights({"a": values(2)}), cameras(2)
        packed = io.BytesIO(splat.Image(image).to_bytes())
        self.assertEqual(splat.Image.load(packed), splat.Image(image))
        self.assertEqual(splat.Weights.load(io.BytesIO(weights.to_bytes())), weights)
        self.assertEqual(len(splat.Camera.load(io.BytesIO(splat.cameras_to_bytes(views)))), 2)
        parts = (io.BytesIO(b"1 PINHOLE 40 30 50 50 20 15\n"), b"1 1 0 0 0 0 0 4 1 a.png\n\n")
        self.assertEqual(splat.Camera.load(parts)[0].name, "a.png")
        self.refused(splat.InvalidArgument, "the bytes of (cameras, images)", splat.Camera.load,
                     ("a", b""))
        packed.seek(0)
        cut, _ = splat.cut_picture(packed, 16)
        self.assertEqual(cut["image"], splat.cut_picture(image, 16)[0]["image"])

    def test_bad_input(self) -> None:
        make, means = splat.Scene, values(4, 3)
        self.refused(splat.ShapeMismatch, "expected [n,3]", make, values(4, 4))
        self.refused(splat.InvalidArgument, "has the type float64", make, means.astype(float))
        self.refused(splat.ShapeMismatch, "expected [4,4]", make, means, rotations=values(3, 4))
        self.refused(splat.InvalidArgument, "5 terms", make, means, sh=values(4, 5, 3))
        self.refused(splat.InvalidArgument, "exclude each other", make, means, scales=means,
                     log_scales=means)
        self.refused(splat.InvalidArgument, "opacities", make, means, opacities=means[:, 0] + 2)
        made = make(means)
        self.refused(splat.InvalidArgument, "no attribute 'colours'", made.read, "colours")
        self.refused(splat.ShapeMismatch, "expected [4]", made.write, "opacities", values(3))
        self.refused(splat.NotFound, "gone.ply", make.load, self.folder / "gone.ply")
        self.refused(splat.FormatError, "", make.load, b"ply nonsense")
        self.refused(splat.InvalidArgument, "expected one of ply", made.to_bytes, "obj")
        self.refused(splat.Unsupported, "", made.save, self.folder / "a.obj")
        self.refused(splat.InvalidArgument, "path", make.load, 3)
        self.refused(splat.InvalidArgument, "sh_degree", make.load, b"", sh_degree=-1)
        made.close()
        self.refused(splat.InvalidHandle, "this Scene was closed", getattr, made, "means")


class Cameras(Case):
    """Formulas and files."""

    def test_poses(self) -> None:
        camera = splat.Camera.look_at((0, 0, -5), (0, 0, 0), width=40, height=30, fov_x=1.0)
        self.assertAlmostEqual(camera.intrinsics[0], 20 / math.tan(0.5))
        np.testing.assert_allclose(camera.world_to_camera @ [0, 0, 0, 1], [0, 0, 5, 1], atol=1e-12)
        again = splat.Camera.from_opengl(camera.to_opengl(), width=40, height=30, fov_x=1.0)
        np.testing.assert_allclose(again.world_to_camera, camera.world_to_camera, atol=1e-12)
        made = splat.Camera(40, 30, 50, world_to_camera=camera.world_to_camera)
        self.assertEqual(made.intrinsics, (50, 50, 20, 15))
        made.world_to_camera = np.eye(4)
        np.testing.assert_array_equal(made.world_to_camera, np.eye(4))

    def test_writes_into_the_matrix_are_refused(self) -> None:
        camera = cameras()[0]
        self.refused(ValueError, "read-only", camera.world_to_camera.__setitem__, (0, 3), 5)
        matrix = camera.world_to_camera.copy()
        matrix[0, 3] = 5
        camera.world_to_camera = matrix
        self.assertEqual(camera.world_to_camera[0, 3], 5)
        camera.to_opengl()[0, 3] = 5

    def test_files(self) -> None:
        made = cameras(3)
        for index, camera in enumerate(made):
            camera.name = f"view{index}.png"
        splat.save_cameras(self.folder / "transforms.json", made)
        data = splat.cameras_to_bytes(made)
        self.assertEqual((self.folder / "transforms.json").read_bytes(), data)
        for again in (splat.Camera.load(self.folder / "transforms.json"), splat.Camera.load(data)):
            self.assertEqual([each.name for each in again], [each.name for each in made])
            for a, b in zip(again, made):
                np.testing.assert_allclose(a.world_to_camera, b.world_to_camera, atol=1e-9)

    def test_colmap(self) -> None:
        (self.folder / "cameras.txt").write_text("1 PINHOLE 40 30 50 50 20 15\n")
        (self.folder / "images.txt").write_text("1 1 0 0 0 0 0 4 1 a.png\n\n")
        found = splat.Camera.load(self.folder)
        self.assertEqual((found[0].name, found[0].intrinsics), ("a.png", (50, 50, 20, 15)))
        parts = ((self.folder / "cameras.txt").read_bytes(),
                 (self.folder / "images.txt").read_bytes())
        self.assertEqual(splat.Camera.load(parts), found)

    def test_copies(self) -> None:
        camera = cameras()[0]
        self.assertEqual(pickle.loads(pickle.dumps(camera)), camera)
        self.assertEqual(copy.deepcopy(camera), camera)

    def test_bad_input(self) -> None:
        self.refused(splat.InvalidArgument, "", splat.Camera.look_at, (0, 0, 0), (0, 0, 0))
        self.refused(splat.ShapeMismatch, "expected [3]", splat.Camera.look_at, (0, 0), (0, 0, 0))
        self.refused(splat.ShapeMismatch, "expected [4,4]", splat.Camera, 4, 4, 5,
                     world_to_camera=np.eye(3))
        self.refused(splat.InvalidArgument, "width is 1.5", splat.Camera, 1.5, 4, 5)
        self.refused(splat.InvalidArgument, "", splat.Camera.from_fov, 4, 4, 7)
        self.refused(splat.FormatError, "", splat.Camera.load, b"{")
        self.refused(splat.NotFound, "", splat.Camera.load, self.folder / "transforms.json")
        self.refused(splat.InvalidArgument, "count is -1", splat.Camera.orbit, scene(), -1)
        self.assertEqual(len(splat.Camera.orbit(scene(), np.int64(2))), 2)  # type: ignore[arg-type]
        self.refused(splat.InvalidArgument, "expected a whole number", splat.Camera.orbit, scene(),
                     np.ones(2, int))
        self.assertEqual(splat.Camera.orbit(scene(), 0), [])
        self.assertEqual(splat.Scene.merge([]).info.count, 0)
        self.refused(splat.InvalidArgument, "different poses", splat.Camera.path, [splat.Camera(4, 4, 5)], 3)

    def test_path(self) -> None:
        keys = splat.Camera.orbit(scene(), 6)
        path = splat.Camera.path(keys, 12, closed=True)
        self.assertEqual(len(path), 12)
        np.testing.assert_allclose(path[2].world_to_camera, keys[1].world_to_camera, atol=1e-9)
        self.assertEqual(path[0].fx, keys[0].fx)


class Images(Case):
    """Files, bytes, scores."""

    def test_files_and_bytes(self) -> None:
        for array in (picture(), picture()[:, :, :3], picture()[:, :, 0], picture()[::-1, ::2]):
            image = splat.Image(array)
            self.assertEqual(image.channels, array.shape[2] if array.ndim == 3 else 1)
            np.testing.assert_array_equal(splat.Image.load(image.to_bytes()), array)
            image.save(self.folder / "a.png")
            np.testing.assert_array_equal(splat.Image.load(self.folder / "a.png"), array)
        image = splat.Image(values(5, 6, 3))
        np.testing.assert_array_equal(splat.Image.load(image.to_bytes("npy")), image)
        self.assertEqual(splat.Image.load(image.to_bytes(), dtype=np.float16).array.dtype,
                         np.float16)
        self.assertTrue(image._repr_png_().startswith(b"\x89PNG"))

    def test_numpy_asks_for_no_copy(self) -> None:
        image = splat.Image(picture())
        self.assertIs(image.__array__(copy=False), image.array)
        self.assertIs(image.__array__(np.uint8), image.array)
        self.refused(ValueError, "without a copy", image.__array__, np.float32, copy=False)
        self.assertEqual(image.__array__(np.float32).dtype, np.float32)
        self.assertIsNot(image.__array__(np.uint8, copy=True), image.array)
        if np.lib.NumpyVersion(np.__version__) >= "2.0.0":
            self.refused(ValueError, "copy", np.asarray, image, np.float32, copy=False)

    def test_like_an_array(self) -> None:
        for array in (picture(), picture()[::-1, ::2, 0], values(4, 5, 3)):
            image: Any = splat.Image(array)
            self.assertEqual((image.shape, image.dtype, image.ndim, image.size, len(image)),
                             (array.shape, array.dtype, array.ndim, array.size, len(array)))
            np.testing.assert_array_equal(image[1:3, 2], array[1:3, 2])
            np.testing.assert_array_equal(list(image), array)
            self.assertTrue((image == array).all() and (array == image).all())
            self.assertEqual(image, splat.Image(array.copy()))
            self.assertEqual(image.tobytes(), array.tobytes())
            shared = np.asarray(image)
            self.assertTrue(np.shares_memory(shared, image.array))
            self.assertFalse(np.shares_memory(np.array(image), image.array))
            del image
            np.testing.assert_array_equal(shared, array)
            np.testing.assert_array_equal(np.from_dlpack(splat.Image(array)), array)
        self.assertNotEqual(splat.Image(picture()), splat.Image(picture()[1:]))
        self.assertNotEqual(splat.Image(picture()), "a")
        self.refused(AttributeError, "", setattr, splat.Image(picture()), "array", picture())

    def test_pil_takes_it(self) -> None:
        try:
            from PIL import Image  # pyright: ignore[reportMissingImports]
        except ImportError:
            self.skipTest("no PIL; apt-get install python3-pil")
        for array in (picture(), picture()[::2, ::-1, :3], picture()[:, :, 0]):
            np.testing.assert_array_equal(np.asarray(Image.fromarray(splat.Image(array))), array)

    def test_limits_of_files(self) -> None:
        self.addCleanup(splat.set_decode_limits)
        file = splat.Image(picture() * np.uint8(0)).to_bytes()
        splat.set_decode_limits(bytes_times_file=1, bytes_besides=1000)
        self.refused(splat.FormatError, "set_decode_limits", splat.Image.load, file)
        splat.set_decode_limits(bytes_besides=1 << 20, items=1, jpeg_scans=1)
        splat.Image.load(file)
        arrays = {"a": values(2), "b": values(2)}
        self.refused(splat.FormatError, "", splat.Weights.load, splat.Weights(arrays).to_bytes())
        splat.set_decode_limits()
        self.assertEqual(len(splat.Weights.load(splat.Weights(arrays).to_bytes())), 2)
        self.refused(splat.InvalidArgument, "items is -1", splat.set_decode_limits, items=-1)

    def test_animations(self) -> None:
        frames = [values(5, 6, 3, seed=seed) for seed in range(3)]
        names: Any = ("gif", "png")
        for name in names:
            splat.save_animation(self.folder / f"a.{name}", frames, 50)
            self.assertEqual((self.folder / f"a.{name}").read_bytes(),
                             splat.animation_to_bytes(frames, 50, name))

    def test_scores(self) -> None:
        image = splat.Image(picture())
        self.assertEqual(splat.compare_images(image, image).psnr, math.inf)
        scores = splat.compare_images(values(3, 16, 16), values(3, 16, 16) * 0.9)
        self.assertAlmostEqual(scores.squared_error, float(np.mean((values(3, 16, 16) * 0.1)**2)),
                               6)
        self.refused(splat.ShapeMismatch, "expected [3,16,16]", splat.compare_images,
                     values(3, 16, 16), values(3, 8, 8))

    def test_bad_input(self) -> None:
        self.refused(splat.InvalidArgument, "expected uint8", splat.Image, np.zeros((4, 4)))
        self.refused(splat.ShapeMismatch, "1 to 4 channels", splat.Image, values(4, 4, 5))
        self.refused(splat.ShapeMismatch, "no pixels", splat.Image, values(0, 4))
        self.refused(splat.FormatError, "", splat.Image.load, b"nonsense")
        self.refused(splat.NotFound, "", splat.Image.load, self.folder / "a.png")
        self.refused(splat.Unsupported, "", splat.Image(picture()).save, self.folder / "a.tiff")
        self.refused(splat.InvalidArgument, "", splat.save_animation, self.folder / "a.png", [])
