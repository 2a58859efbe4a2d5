"""Scores of depth maps, normals, masks and shapes."""
import math

import numpy as np

import libsplat as splat
from shared import Case, values


class PriorScores(Case):
    """Good cases, options, and what is refused."""

    def test_depth(self) -> None:
        truth = values(7, 5) + 1
        scores = splat.compare_depth(2 * truth + 3, truth)
        self.assertAlmostEqual(scores.scale, 0.5, 6)
        self.assertAlmostEqual(scores.abs_rel, 0, 6)
        self.assertEqual((scores.pixels, scores.within), (35, (1, 1, 1)))
        truth[0] = 0
        self.assertEqual(splat.compare_depth(truth, truth).pixels, 30)
        self.assertEqual(splat.compare_depth(truth, truth, published=True).pixels, 35)
        mask = np.zeros((7, 5), np.uint8)
        mask[3] = 255
        self.assertEqual(splat.compare_depth(truth, truth, mask).pixels, 5)
        self.refused(splat.ShapeMismatch, "truth", splat.compare_depth, truth, truth[1:])
        self.refused(splat.InvalidArgument, "nan", splat.compare_depth, truth * np.float32("nan"),
                     truth)

    def test_normals(self) -> None:
        x, z = np.zeros((2, 4, 4, 3), np.float32)
        x[..., 0] = z[..., 2] = 1
        scores = splat.compare_normals(x, z, vectors=True)
        self.assertAlmostEqual(scores.mean, 90)
        self.assertAlmostEqual(splat.compare_normals((x + 1) / 2, (z + 1) / 2).median, 90)
        self.refused(splat.ShapeMismatch, "channels", splat.compare_normals, x[..., 0], z[..., 0])

    def test_planes(self) -> None:
        depth = np.full((8, 16), 2, np.float32)
        depth[:, 12:] = 3
        planes = splat.planes_from_depth(depth, 20, least_share=0.1)
        np.testing.assert_allclose(planes[0, ::12], [[0, 0, -1, 2], [0, 0, -1, 3]], atol=1e-6)
        np.testing.assert_array_equal(
            splat.planes_from_depth(depth, 20, planes[..., :3], least_share=0.3)[0, 12], 0)
        scores = splat.compare_planes(planes, planes)
        self.assertEqual((scores.covering, scores.recall, scores.true_planes), (1, 1, 2))
        moved = planes + np.array([0, 0, 0, 0.06], np.float32)
        self.assertEqual(splat.compare_planes(moved, planes).recall, 0)
        self.refused(splat.ShapeMismatch, "channels", splat.compare_planes, depth, planes)
        self.refused(splat.InvalidArgument, "angle", splat.planes_from_depth, depth, 20, max_degrees=91)

    def test_masks(self) -> None:
        alpha = np.array([[1, 0.25, 0]], np.float32)
        self.assertEqual(splat.compare_masks(alpha, alpha).true_pixels, 2)
        scores = splat.compare_masks(alpha, alpha, half=True)
        self.assertEqual((scores.true_pixels, scores.predicted_pixels), (1, 1))
        self.assertAlmostEqual(scores.iou, 1, 5)

    def test_fidelity(self) -> None:
        image = values(41, 45, 4)
        image[..., 3] = 1
        scores = splat.compare_fidelity(image, image, range_1=True, with_alpha=True)
        self.assertAlmostEqual(scores.vif, 1, 6)
        self.assertTrue(math.isnan(splat.compare_fidelity(image, image).channels[3]))
        self.refused(splat.ShapeMismatch, "41", splat.compare_fidelity, image[:40], image[:40])

    def test_filters(self) -> None:
        step = np.zeros((6, 8), np.float32)
        step[:, 4:] = 1
        self.assertEqual(splat.filter_map(step, "canny").sum(), 6)
        np.testing.assert_array_equal(splat.filter_map(step, "closing"), step)
        self.refused(splat.InvalidArgument, "sobel", splat.filter_map, step, "laplace")

    def test_points(self) -> None:
        path = self.folder / "square.obj"
        path.write_text("v 0 0 2\nv 1 0 2\nv 1 1 2\nv 0 1 2\nf 1 2 3 4\n", "utf-8")
        points = splat.mesh_points(path, 100, 7)
        self.assertEqual((points.shape, points[:, 2].min()), ((100, 3), 2))
        scores = splat.Scene(points).compare_points(points, 1e-6)
        self.assertEqual((scores.chamfer, scores.f_score, scores.gaussians), (0, 1, 100))
        self.refused(splat.NotFound, "no.obj", splat.mesh_points, self.folder / "no.obj", 1)
        depth = np.array([[0, 2], [0, 0]], np.float32)
        np.testing.assert_allclose(splat.depth_points(depth, splat.Camera(2, 2, 2)),
                                   [[0.5, -0.5, 2]])

