"""The rasterizer: images, outputs, gradients, several states."""
from typing import Any, Dict, Tuple

import numpy as np

import libsplat as splat
from shared import Case, arrays, cameras, scene, values

OUTPUTS: Dict[Any, Tuple[int, ...]] = {
    "rgb": (2, 32, 48, 3), "alpha": (2, 32, 48), "depth": (2, 32, 48),
    "expected_depth": (2, 32, 48), "contributors": (2, 32, 48), "normals": (2, 32, 48, 3),
    "means2d": (2, 50, 2), "radii": (2, 50, 2), "conics": (2, 50, 3), "depths": (2, 50),
    "visibility": (2, 50), "ids": (2, 32, 48), "median_depth": (2, 32, 48)}


class Drawing(Case):
    """Forward calls and their outputs."""

    def make(self, **options: object) -> splat.Rasterizer:
        return splat.Rasterizer(self.device, 50, 48, 32, views=2, **options)  # type: ignore

    def test_all_outputs(self) -> None:
        rasterizer = self.make(depth=True, normals=True, ids=True, median_depth=True)
        rasterizer.forward(scene(), cameras(2), (1, 0.5, 0))
        for name, shape in OUTPUTS.items():
            array = rasterizer.read(name)
            self.assertEqual((array.shape, array.dtype), (shape, np.dtype(np.float32)), name)
            self.assertGreater(np.abs(array).max(), 0, name)
            np.testing.assert_array_equal(rasterizer.output(name), array)
        self.assertEqual(rasterizer.info().views, 2)
        tensor = splat.Tensor.zeros(self.device, (2, 32, 48))
        self.assertIs(rasterizer.output(splat.Output.ALPHA, into=tensor), tensor)

    def test_the_maximum_along_rays(self) -> None:
        rasterizer = self.make(convention="ray_maximum", median_depth=True)
        rasterizer.forward(scene(), cameras(2))
        median = rasterizer.read("median_depth")
        np.testing.assert_array_equal(median > 0, rasterizer.read("alpha") > 0)
        self.refused(splat.InvalidState, "ray_maximum", rasterizer.read, "conics")
        self.refused(splat.InvalidArgument, "without gradients", self.make, convention="ray_maximum", backward=True)

    def test_messages_name_what_python_has(self) -> None:
        rasterizer = self.make()
        rasterizer.forward(scene(), cameras(2), (1, 1, 1))
        error = self.refused(splat.InvalidState, "depth=True", rasterizer.read, "depth")
        self.assertNotIn("SPLAT_", str(error))

    def test_images_are_what_read_gives(self) -> None:
        rasterizer = self.make()
        rasterizer.forward(scene(), cameras(2), (1, 1, 1))
        rgb, alpha = rasterizer.read("rgb"), rasterizer.read("alpha")
        images = rasterizer.images(channels=4)
        self.assertEqual(len(images), 2)
        expected = np.rint(255 * np.clip(np.concatenate([rgb, alpha[..., None]], -1), 0, 1))
        np.testing.assert_array_equal(np.stack([np.asarray(each) for each in images]), expected)
        np.testing.assert_array_equal(rasterizer.images(dtype=np.float32)[1], rgb[1])
        self.assertEqual(rasterizer.images("alpha")[0].array.shape, (32, 48))
        picture = splat.render(scene(), cameras(2)[0], device=self.device)
        np.testing.assert_array_equal(picture, images[0].array[:, :, :3])
        self.assertEqual(splat.render(scene(), cameras()[0], alpha=True).channels, 4)

    def test_views_in_one_call(self) -> None:
        views = [cameras(3)[1], *cameras(1, 20, 24)]
        drawn = splat.render(scene(), views, background=None, alpha=True)
        self.assertEqual([each.array.shape for each in drawn], [(32, 48, 4), (24, 20, 4)])
        for view, image in zip(views, drawn):
            rasterizer = splat.Rasterizer(self.device, 50, view.width, view.height)
            rasterizer.forward(scene(), view)
            np.testing.assert_array_equal(rasterizer.images(channels=4)[0], image)
        self.assertEqual(splat.render(scene(), []), [])
        self.refused(splat.ShapeMismatch, "background", splat.render, scene(), views,
                     background=(1,))
        self.refused(TypeError, "expected a Camera", splat.render, scene(), [3])

    def test_as_the_scene_says(self) -> None:
        view, given = cameras()[0], arrays(50)
        usual = splat.render(scene(), view)
        flags = splat.DrawnFlags
        for flag, name in ((flags.ANTIALIASED, "antialiased"), (flags.CUT_3_SIGMA, "cut_3_sigma"),
                           (flags.LINEAR_COLORS, "linear_colors")):
            told = splat.Scene(given["means"], scales=given["scales"], rotations=given["rotations"],
                               opacities=given["opacities"], sh=given["sh"], drawn_as=flag)
            drawn = splat.render(told, view)
            self.assertNotEqual(drawn, usual)
            self.assertEqual(splat.render(told, view, drawn_as=0), usual)
            self.assertEqual(splat.render(scene(), view, drawn_as=flag), drawn)
            options: Any = {name: True}
            rasterizer = splat.Rasterizer(self.device, 50, view.width, view.height, **options)
            rasterizer.forward(told, view, background=(1, 1, 1))
            self.assertEqual(rasterizer.images()[0], drawn)

    def test_any_number_of_views(self) -> None:
        rasterizer = splat.Rasterizer(self.device, 50, 48, 32)
        for count in (1, 4, 2):
            rasterizer.forward(scene(), cameras(count))
            exact = splat.Rasterizer(self.device, 50, 48, 32, views=count)
            exact.forward(scene(), cameras(count))
            np.testing.assert_array_equal(rasterizer.read(), exact.read())

    def test_arrays_and_tensors_draw_alike(self) -> None:
        rasterizer, given = self.make(), arrays(50)
        rasterizer.forward_arrays(cameras(2), **given)
        rgb = rasterizer.read()
        made = scene()
        tensors = {name: made.tensor(name, self.device) for name in given}
        rasterizer.forward_arrays(cameras(2), None, means=tensors["means"],
                                  scales=tensors["scales"], rotations=tensors["rotations"],
                                  opacities=tensors["opacities"], sh=tensors["sh"])
        np.testing.assert_allclose(rasterizer.read(), rgb, atol=1e-4)
        colors = self.make(direct_colors=True)
        del given["sh"]
        colors.forward_arrays(cameras(1), colors=values(50, 3), **given)
        self.assertEqual(colors.read().shape, (1, 32, 48, 3))
        empty = {name: array[:0] for name, array in arrays(50).items()}
        rasterizer.forward_arrays(cameras(1), (0, 0, 1), **empty)
        np.testing.assert_array_equal(rasterizer.read()[0, 0, 0], [0, 0, 1])

    def test_bad_input(self) -> None:
        rasterizer, given = self.make(), arrays(50)
        self.refused(splat.InvalidState, "no view", rasterizer.read)
        self.refused(splat.InvalidArgument, "", rasterizer.forward, scene(), cameras(2, 40, 33))
        self.refused(splat.InvalidArgument, "", rasterizer.forward, scene(51), cameras(2))
        self.refused(splat.InvalidArgument, "", rasterizer.forward, scene(), cameras(3))
        self.refused(TypeError, "expected a Camera", rasterizer.forward, scene(), [3])
        self.refused(splat.ShapeMismatch, "background", rasterizer.forward, scene(), cameras(), (1,))
        rasterizer.forward(scene(), cameras())
        self.refused(splat.InvalidState, "output 'depth' needs", rasterizer.read, "depth")
        self.refused(splat.InvalidArgument, "expected one of rgb", rasterizer.read, "red")
        self.refused(splat.InvalidArgument, "which is none", rasterizer.read, 99)
        self.refused(splat.InvalidArgument, "", rasterizer.images, "means2d")
        self.refused(splat.ShapeMismatch, "", rasterizer.images, channels=2)
        self.refused(splat.ShapeMismatch, "scales", rasterizer.forward_arrays, cameras(),
                     **{**given, "scales": values(49, 3)})
        self.refused(splat.InvalidArgument, "float64", rasterizer.forward_arrays, cameras(),
                     **{**given, "means": np.zeros((50, 3))})
        with splat.Device() as other:
            self.refused(splat.InvalidArgument, "device", rasterizer.forward_arrays, cameras(),
                         **{**given, "means": splat.Tensor(other, given["means"])})
        mapped = splat.Tensor(self.device, given["means"])
        with mapped.map():
            self.refused(splat.InvalidState, "mapped", rasterizer.forward_arrays, cameras(),
                         **{**given, "means": mapped})
        self.refused(splat.InvalidArgument, "degree 9", self.make, sh_degree=9)
        self.refused(splat.InvalidArgument, "sh_degree", self.make, sh_degree=2, direct_colors=True)
        self.refused(splat.InvalidArgument, "gaussians is -1", splat.Rasterizer, self.device, -1, 4,
                     4)


class Gradients(Case):
    """Backward calls."""

    def test_gradients_are_differences(self) -> None:
        rasterizer = splat.Rasterizer(self.device, 50, 48, 32, backward=True, convention="gsplat")
        given, weight = arrays(50), values(1, 32, 48, 3, seed=9)

        def loss(sh: Any) -> float:
            rasterizer.forward_arrays(cameras(), **{**given, "sh": sh})
            return float((rasterizer.read().astype(float) * weight).sum())

        loss(given["sh"])
        gradient = rasterizer.backward(["sh"], rgb=weight)["sh"].numpy()
        direction = values(50, 1, 3, seed=5) - np.float32(0.5)  # the image is linear in it
        change = loss(given["sh"] + direction / 8) - loss(given["sh"] - direction / 8)
        self.assertAlmostEqual(change * 4 / float((gradient * direction).sum()), 1, 4)

    def test_smaller_views_tiles_and_what_gaussians_add(self) -> None:
        rasterizer = splat.Rasterizer(self.device, 50, 48, 32, ids=True, contributions=True,
                                      grad_intrinsics=True, convention="gsplat")
        tiles = np.ones((1, 2, 3), bool)
        tiles[0, 0, 2] = False
        rasterizer.forward_arrays(cameras(), (1, 1, 1), active_tiles=tiles, **arrays(50))
        alpha, ids = rasterizer.read("alpha"), rasterizer.read("ids")
        self.assertEqual(np.abs(alpha[0, :16, 32:]).max(), 0)
        np.testing.assert_array_equal(ids >= 0, alpha > 0)
        self.assertLess(ids.max(), 50)
        given = rasterizer.backward(["intrinsics", "contributions"], rgb=values(1, 32, 48, 3))
        self.assertTrue(given["intrinsics"].numpy().all())
        weights, pixels = given["contributions"].numpy().T
        self.assertAlmostEqual(float(weights.sum() / alpha.sum()), 1, 4)
        self.assertGreaterEqual(pixels.max(), weights.max())
        rasterizer.forward(scene(), cameras(1, 20, 20), (1, 1, 1))
        rgb = rasterizer.read()
        self.assertEqual((rgb[0, 20:].max(), rgb[0, :, 20:].max()), (0, 0))
        self.assertGreater(rgb[0, :20, :20].mean(), 0.1)
        self.refused(splat.InvalidArgument, "a mask of 2 tiles, expected 6",
                     rasterizer.forward_arrays, cameras(), active_tiles=[1, 0], **arrays(50))

    def test_views_see_ranges(self) -> None:
        rasterizer = splat.Rasterizer(self.device, 50, 48, 32, items=80, views=3, ids=True, grad_means2d=True)
        ranges = np.array([[20, 30], [0, 20], [20, 30]])
        rasterizer.forward(scene(), cameras(3), ranges=ranges)
        drawn, ids = rasterizer.read(), rasterizer.read("ids")
        self.assertEqual(rasterizer.info().items, 80)
        self.assertEqual(rasterizer.read("means2d").shape, (80, 2))
        self.assertTrue((ids[0][ids[0] >= 0] >= 20).all() and (ids[1] < 20).all() and ids.max() >= 20)
        given = rasterizer.backward(["means", "means2d"], rgb=values(3, 32, 48, 3))
        self.assertEqual(given["means2d"].shape, (80, 2))
        part = {name: value[20:] for name, value in arrays(50).items()}
        one = splat.Rasterizer(self.device, 30, 48, 32, grad_means2d=True)
        one.forward_arrays([cameras(3)[0], cameras(3)[2]], **part)
        rasterizer.forward_arrays(cameras(3), ranges=ranges, **arrays(50))
        np.testing.assert_array_equal(one.read(), rasterizer.read()[[0, 2]])
        np.testing.assert_allclose(rasterizer.read(), drawn, atol=1e-5)  # activated by NumPy and by the library
        self.refused(splat.InvalidArgument, "view 1 sees Gaussians 31 to 51, but there are 50",
                     rasterizer.forward, scene(), cameras(3), ranges=[[0, 9], [31, 20], [0, 0]])
        self.refused(splat.InvalidArgument, "expected whole numbers",
                     rasterizer.forward, scene(), cameras(3), ranges=[0, 9])
        self.refused(splat.InvalidArgument, "expected whole numbers",
                     rasterizer.forward, scene(), cameras(3), ranges=[[-1, 9]] * 3)

    def test_states_and_accumulation(self) -> None:
        rasterizer = splat.Rasterizer(self.device, 50, 48, 32, backward=True, grad_depth=True,
                                      grad_means2d=True, depth=True)
        state = rasterizer.state()
        rasterizer.forward(scene(), cameras(2)[0])
        rasterizer.forward(scene(), cameras(2)[1], state=state)
        weight = values(1, 32, 48, 3)
        names = ["means", "scales", "rotations", "opacities", "sh", "means2d", "means2d_abs"]
        first = rasterizer.backward(names, rgb=weight, alpha=values(1, 32, 48),
                                    depth=values(1, 32, 48))
        kept = {name: tensor.numpy() for name, tensor in first.items()}
        second = rasterizer.backward(names, rgb=weight, state=state)
        self.assertFalse(np.array_equal(kept["means"], second["means"].numpy()))
        sums = rasterizer.backward(["means"], rgb=weight, alpha=values(1, 32, 48),
                                   depth=values(1, 32, 48), into={"means": first["means"]},
                                   accumulate=True)
        np.testing.assert_array_equal(sums["means"], 2 * kept["means"])

    def test_bad_input(self) -> None:
        rasterizer = splat.Rasterizer(self.device, 50, 48, 32, backward=True)
        self.refused(splat.InvalidState, "no view", rasterizer.backward, [])
        rasterizer.forward(scene(), cameras())
        self.refused(splat.InvalidArgument, "no gradient 'colour'", rasterizer.backward, ["colour"])
        self.refused(splat.ShapeMismatch, "rgb has the shape", rasterizer.backward, ["means"],
                     rgb=values(2, 32, 48, 3))
        self.refused(splat.InvalidState, "", rasterizer.backward, ["means2d"])
        plain = splat.Rasterizer(self.device, 50, 48, 32)
        plain.forward(scene(), cameras())
        self.refused(splat.InvalidState, "backward=True", plain.backward, ["means"])
        self.refused(splat.InvalidArgument, "state", rasterizer.forward, scene(), cameras(),
                     state=plain.state())
        rasterizer.close()
        self.refused(splat.InvalidHandle, "this Rasterizer was closed", rasterizer.read)
