"""Meshes: arrays, files, pictures with exact maps."""
import numpy as np

import libsplat as splat
from shared import Case


def square() -> splat.Mesh:
    """From -1 to 1 in the plane z = 0, facing +z."""
    return splat.Mesh([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])


class Meshes(Case):
    """A square."""

    def test_measures(self) -> None:
        mesh = square()
        self.assertEqual((mesh.info.triangles, mesh.info.area, mesh.info.high), (2, 4, (1, 1, 0)))
        mesh.normalise("unit_cube")
        self.assertEqual(mesh.info.area, 1)
        points = mesh.sample(50, 3)
        self.assertEqual((points.shape, np.abs(points).max() <= 0.5), ((50, 3), True))
        np.testing.assert_array_equal(mesh.sample(20, 3), points[:20])
        self.assertEqual(mesh.report, {"warnings": []})

    def test_pictures(self) -> None:
        camera = splat.Camera.look_at([0, 0, 2], [0, 0, 0], [0, 1, 0], width=16, height=12, fov_x=np.pi / 2)
        maps = square().render(camera, ["color", "mask", "depth", "normal"], device=self.device, unlit=True,
                               background=(0, 0, 1))
        inside = np.zeros((12, 16), bool)
        inside[2:10, 4:12] = True
        np.testing.assert_array_equal(maps["mask"], inside)
        np.testing.assert_allclose(maps["depth"], 2 * inside, rtol=1e-6)
        np.testing.assert_allclose(maps["normal"][..., 2], -1.0 * inside, atol=1e-6)
        np.testing.assert_array_equal(maps["color"], np.where(inside[..., None], [1, 1, 1], [0, 0, 1]))
        both = square().render([camera, camera], device=self.device)
        self.assertEqual([each["color"].shape for each in both], [(12, 16, 3)] * 2)

    def test_files(self) -> None:
        path = self.folder / "a.obj"
        path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        self.assertEqual(splat.Mesh.load(path).info.area, 0.5)
        self.refused(splat.NotFound, "no.obj", splat.Mesh.load, self.folder / "no.obj")

    def test_data_sets(self) -> None:
        views = splat.MeshViews(self.folder / "views", size=16, train_views=2, points=20, protocol="orbit",
                                elevation=0.3, prepared="as_given", maps=["mask", "depth"], y_up=True)
        self.assertFalse(views.has("square"))
        mesh = square()
        mesh.normalise("unit_diagonal")
        views.write(mesh, "square", device=self.device)
        self.assertTrue(views.has("square"))
        data = splat.Dataset(self.folder / "views")
        self.assertEqual((len(data), data.views(0)), (1, 2))
        self.assertEqual(sorted(data.report["maps"]), ["depth", "mask"])
        self.refused(splat.InvalidArgument, "in the split train", views.has, "square", "val")
        self.refused(splat.InvalidArgument, "'edges'", splat.MeshViews, self.folder, maps=["edges"])
        other = splat.MeshViews(self.folder / "views", size=8)
        self.refused(splat.InvalidArgument, "made with other values", other.write, mesh, "b", device=self.device)

    def test_refusals(self) -> None:
        places = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        self.refused(splat.InvalidArgument, "vertex 3", splat.Mesh, places, [[0, 1, 3]])
        self.refused(splat.InvalidArgument, "-1", splat.Mesh, places, [[0, 1, -1]])
        self.refused(splat.InvalidArgument, "whole numbers", splat.Mesh, places, [[0, 1, 2.0]])
        self.refused(splat.ShapeMismatch, "normals", splat.Mesh, places, [[0, 1, 2]],
                     normals=np.zeros((2, 3), np.float32))
        camera = splat.Camera.look_at([0, 0, 2], [0, 0, 0], [0, 1, 0], width=4, height=4, fov_x=1)
        self.refused(splat.InvalidArgument, "'edges'", square().render, camera, ["edges"])
        self.refused(splat.InvalidArgument, "samples", square().render, camera, samples=3)
