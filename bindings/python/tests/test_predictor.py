"""Predictors, the evaluator, LPIPS and comparisons."""
import json
import math
import warnings
from typing import Any

import numpy as np

import libsplat as splat
from shared import PYTHON, Case, picture, run_program, values
from libsplat.picture import picture_array

VGG = ((0, 3, 64), (2, 64, 64), (5, 64, 128), (7, 128, 128), (10, 128, 256), (12, 256, 256),
       (14, 256, 256), (17, 256, 512), (19, 512, 512), (21, 512, 512), (24, 512, 512),
       (26, 512, 512), (28, 512, 512))

# 36 x 24 gray pixels; its Exif data say that on film of 36 x 24 mm the focal length were 50 mm.
JPEG = bytes.fromhex(
    "ffd8ffe10034457869660000" "4d4d002a00000008" "00018769000400000001 0000001a00000000"
    "0001a405000300000001 0032000000000000" "ffdb004300" + 64 * "ff" +
    "ffc0000b080018002401011100" "ffc40015000101" + 14 * "00" + "0001" "ffc400141001" + 16 * "00" +
    "ffda0008010100003f0080000000ffd9")


class Predictors(Case):
    """Pictures to scenes."""

    predictor: splat.Predictor

    @classmethod
    def setUpClass(cls) -> None:
        super().setUpClass()
        cls.predictor = splat.Predictor(cls.device)

    def test_sources_predict_alike(self) -> None:
        splat.Image(picture()).save(self.folder / "a.png")
        first = self.predictor.predict(picture())
        self.assertEqual((first.pictures[0].found, len(first.cameras)), (splat.Found.BY_ALPHA, 1))
        self.assertEqual(first.inputs.shape, (1, 3, 64, 64))
        self.assertEqual(first.report["gaussians"], len(first.scene))
        self.assertTrue(first._repr_png_().startswith(b"\x89PNG"))
        for source in (self.folder / "a.png", str(self.folder / "a.png"),
                       (self.folder / "a.png").read_bytes(), splat.Image(picture()),
                       [splat.Picture(picture())], picture()[::-1][::-1]):
            again = self.predictor.predict(source)
            self.assertEqual(again.scene.to_bytes("ply"), first.scene.to_bytes("ply"))

    def test_files_and_their_bytes_are_cut_alike(self) -> None:
        deep = splat.Image(values(64, 80) / 2 + 0.25)  # float depths would be scaled to 0 to 1
        formats: Any = ("png", "png16")
        for format in formats:
            for part in ("image", "mask", "depth", "normal"):
                file = self.folder / f"{part}.png"
                file.write_bytes(deep.to_bytes(format))
                cuts = []
                for source in (file, file.read_bytes()):
                    given = splat.Picture(picture()[:, :, :3], mask=picture()[:, :, 3])
                    setattr(given, part, source)
                    cuts.append(splat.cut_picture(given, 32)[0])
                for name, image in cuts[0].items():
                    np.testing.assert_array_equal(image.array, cuts[1][name].array, f"{part} {name}")

    def test_exif_data_tell_the_focal_length(self) -> None:
        image = splat.Image.load(JPEG)
        self.assertEqual((image.focal, image.bits), (50, 8))
        for given, focal in ((JPEG, 50), (image, 50), (splat.Picture(JPEG), 50),
                             (splat.Picture(JPEG, focal=7), 7), (image.array, 0)):
            self.assertEqual(picture_array(given)[0][0].focal, focal)

    def test_types_of_pixels(self) -> None:
        for dtype in (np.float16, np.float32):
            pixels = (picture() / 255).astype(dtype)
            self.assertGreater(len(self.predictor.predict(pixels).scene), 100)

    def test_masks_and_cutting(self) -> None:
        mask = picture()[:, :, 3]
        found = self.predictor.predict(splat.Picture(picture()[:, :, :3].copy(), mask=mask))
        self.assertEqual(found.pictures[0].found, splat.Found.BY_MASK)
        cut, info = splat.cut_picture(picture(), 32)
        self.assertEqual((cut["image"].array.shape, cut["mask"].array.shape, info.width),
                         ((32, 32, 3), (32, 32), 80))

    def test_weights_and_reports(self) -> None:
        weights = splat.Weights.load(splat.builtin_weights())
        config = json.dumps(self.predictor.report["config"])
        other = splat.Predictor(self.device, weights, config=config)
        self.assertEqual(other.info, self.predictor.info)
        self.assertEqual((other.info.resolution, other.info.category), (64, "cars"))
        self.assertEqual(other.predict(picture()).scene.to_bytes("ply"),
                         self.predictor.predict(picture()).scene.to_bytes("ply"))

    def test_four_views_of_an_object(self) -> None:
        config = ("data: {training_resolution: 32, input_images: 4, fov: 49.1, znear: 0.5, zfar: 2.5}\n"
                  "model: {network: lgm_unet, head: lgm, down: [32, 64], down_attention: [0, 1], "
                  "up: [64, 32], up_attention: [1, 0]}")
        model = splat.Model(self.device, config)
        model.init(3)
        lgm = splat.Predictor(self.device, model.store(), config=config)
        views = [splat.Picture(np.roll(picture(), i, axis=1).copy(), whole=True) for i in range(4)]
        made = lgm.predict(views)
        self.assertEqual((len(made.cameras), made.inputs.shape), (4, (4, 9, 32, 32)))
        self.assertGreater(len(made.scene), 3000)
        self.refused(splat.InvalidArgument, "1 picture, expected 4: LGM's network takes views of one object",
                     lgm.predict, views[:1])

    def test_weights_by_name(self) -> None:
        named = splat.Predictor(self.device, "cars64")
        self.assertEqual(named.report["weights"], splat.builtin_weights("cars64"))
        self.assertEqual(list(splat.Weights.load("cars64")),
                         list(splat.Weights.load(splat.builtin_weights())))
        self.refused(splat.NotFound, "expected cars64, cars64-depth-normal", splat.Predictor,
                     self.device, "cars")

    def test_the_lines_of_the_top_readme(self) -> None:
        text = (PYTHON.parent.parent / "README.md").read_text("utf-8")
        lines = text.split("```python\n")[1].split("```")[0]
        self.assertLessEqual(len(lines.splitlines()), 6)
        splat.Image(picture()).save(self.folder / "photo.png")
        code, printed, errors = run_program(f"import os\nos.chdir({str(self.folder)!r})\n{lines}")
        self.assertEqual((code, errors), (0, ""))
        self.assertIn("Gaussians", printed)
        self.assertGreater(len(splat.Scene.load(self.folder / "scene.ply")), 0)
        self.assertIn(b"fcTL", (self.folder / "orbit.png").read_bytes())  # animated

    def test_three_lines_about_a_prediction(self) -> None:
        lines = repr(self.predictor.predict(picture())).split("\n")
        self.assertEqual(len(lines), 3)
        self.assertRegex(lines[0], r"^Prediction of Scene\(\d+ Gaussians, .*\), \d+ faint ones left out$")
        self.assertEqual(lines[1:], ["  seen: 80 x 64 pixels, object by alpha", "  warnings: none"])

    def test_doubts_are_warnings(self) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            self.predictor.predict(picture())
        with self.assertWarnsRegex(UserWarning, "no object was found in the picture") as told:
            self.predictor.predict(np.zeros((64, 64, 3), np.uint8))
        self.assertEqual(told.filename, __file__)
        config = dict(self.predictor.report["config"])
        config["data"] = {**config["data"], "fov": 20}
        with self.assertWarnsRegex(UserWarning, "its field of view is") as told:
            splat.Predictor(self.device, "cars64", config=config)
        self.assertEqual(told.filename, __file__)

    def test_bad_input(self) -> None:
        predict: Any = self.predictor.predict
        self.refused(splat.NotFound, "", predict, self.folder / "a.png")
        self.refused(splat.FormatError, "", predict, b"nonsense")
        self.refused(splat.InvalidArgument, "expected uint8", predict, np.zeros((4, 4, 3)))
        self.refused(splat.ShapeMismatch, "channels", predict, values(4, 4, 7))
        self.refused(splat.InvalidArgument, "", predict, [picture(), picture()])
        self.refused(splat.InvalidArgument, "depth", predict,
                     splat.Picture(picture(), depth=picture()[:, :, 0]))
        self.refused(splat.InvalidArgument, "mask", predict,
                     splat.Picture(picture(), mask=picture()[:, :, 0] * 0))
        self.refused(splat.NotFound, "", splat.Predictor, self.device, self.folder / "a.pth")
        self.refused(splat.ShapeMismatch, "[4,4]", predict,
                     splat.Picture(picture(), world_to_camera=np.eye(3)))
        self.refused(splat.InvalidArgument, "resolution", splat.cut_picture, picture(), 0)

    def test_the_default_device(self) -> None:
        self.assertEqual(run_program("""
import libsplat as splat, numpy
print(len(splat.Predictor().predict(numpy.zeros((64, 64, 3), numpy.uint8)).scene) > 0)""")[1],
                         "True\n")


class Scores(Case):
    """Evaluators, LPIPS, comparisons."""

    def setUp(self) -> None:
        super().setUp()
        splat.write_synthetic(self.folder / "data", test=2, test_views=3, resolution=64, seed=1)

    def test_a_predictor_is_scored(self) -> None:
        predictor = splat.Predictor(self.device)
        evaluator = splat.Evaluator(predictor, data_path=self.folder / "data", split="test")
        scores = list(evaluator)
        self.assertEqual((len(scores), evaluator.info.scored), (2, 2))
        self.assertGreater(scores[0].novel.psnr, 5)
        views = evaluator.read(1, drawn=True)
        self.assertEqual((views.inputs, views.novel, len(views.cameras)), (1, 2, 3))
        assert views.drawn is not None
        error = np.mean((views.drawn[0].astype(float) - views.images[0])**2)
        self.assertAlmostEqual(-10 * math.log10(error), scores[1].conditioning.psnr, 2)
        self.assertEqual(evaluator.summary().objects, 2)
        self.assertEqual(evaluator.report["objects"], 2)
        evaluator.save(self.folder / "scores")
        self.assertTrue((self.folder / "scores" / "per_object.csv").is_file())
        self.refused(splat.InvalidState, "", evaluator.read, 0, drawn=True)
        other = splat.Evaluator(predictor, data_path=self.folder / "data", split="test")
        other.load(self.folder / "scores")
        self.assertEqual(other.report["novel"], evaluator.report["novel"])
        self.refused(splat.NotFound, "objects.json", other.load, self.folder / "nowhere")

    def test_images_are_scored(self) -> None:
        dataset = splat.Dataset(self.folder / "data", split="test", resolution=64)
        evaluator = splat.Evaluator(None, dataset, method="half", conditioning=[1])
        images = evaluator.read(0).images
        self.assertEqual(evaluator.read(0).numbers[0], 1)
        self.assertGreater(evaluator.score_images(0, images * np.float32(0.9)).novel.ssim, 0.5)
        self.refused(splat.ShapeMismatch, "", evaluator.score_images, 0, images[:1])
        self.refused(splat.InvalidArgument, "", evaluator.score_images, 9, images)
        self.refused(splat.InvalidState, "", evaluator.score, 0)

    def test_lpips(self) -> None:
        arrays = {f"features.{layer}.{part}": values(*shape) / inputs
                  for layer, inputs, outputs in VGG
                  for part, shape in (("weight", (outputs, inputs, 3, 3)), ("bias", (outputs,)))}
        heads = {f"lin{index}.model.1.weight": values(1, size, 1, 1)
                 for index, size in enumerate((64, 128, 256, 512, 512))}
        lpips = splat.Lpips([splat.Weights(arrays), splat.Weights(heads)], 16, self.device)
        a, b = values(3, 16, 16), values(3, 16, 16, seed=1)
        self.assertEqual(lpips.compare(a, a), 0)
        self.assertGreater(lpips.compare(a, b), 0)
        self.refused(splat.ShapeMismatch, "expected [3,16,16]", lpips.compare, a, values(3, 8, 8))
        self.refused(splat.InvalidArgument, "features.0.weight", splat.Lpips, [splat.Weights(heads)], 16,
                     self.device)

    def test_comparisons(self) -> None:
        a = {f"object{index}": (20 + index, 0.5, math.nan) for index in range(12)}
        b = {name: (psnr + 1 + 0.01 * psnr, ssim, lpips) for name, (psnr, ssim, lpips) in a.items()}
        comparison = splat.Comparison(a, b, seed=3)
        psnr = comparison.metrics()[0]
        self.assertEqual((psnr.metric, psnr.verdict), (splat.Metric.PSNR, splat.Verdict.BETTER))
        self.assertEqual((psnr.wins_a, psnr.wins_b, psnr.image_wins_b), (0, 12, 0))
        self.assertEqual(psnr.p_wilcoxon, 2 ** -11)
        self.assertTrue(psnr.wilcoxon_exact and psnr.bca_low < psnr.difference < psnr.bca_high)
        self.assertEqual(comparison.info.shared_objects, 12)
        first, second = comparison.samples(0)
        self.assertTrue((second > first).all())
        self.assertEqual(comparison.report["metrics"][0]["n_pairs"], 12)
        self.assertEqual(splat.Comparison(a, b, unpaired=True, resamples=100).info.unpaired, 1)
        self.refused(splat.NotFound, "", splat.Comparison, a, {"other": (1, 1, 1)})
        self.refused(splat.InvalidArgument, "", splat.Comparison, a, {})
        self.refused(splat.NotFound, "", splat.Comparison, a, self.folder / "scores.txt")
        self.refused(splat.InvalidArgument, "", comparison.samples, 7)
