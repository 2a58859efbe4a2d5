"""Fits of photographs."""
import math
import tempfile
from pathlib import Path
from typing import Any, ClassVar, Dict, List, Tuple, Type

import numpy as np

import libsplat as splat
from shared import PYTHON, Case, cameras, run_program, scene

Kind = splat.RunEventKind


class Fits(Case):
    """Eight small photographs of a scene."""

    photos: ClassVar[Path]

    @classmethod
    def setUpClass(cls) -> None:
        super().setUpClass()
        place = tempfile.TemporaryDirectory()
        cls.addClassCleanup(place.cleanup)
        cls.photos = Path(place.name)
        views = cameras(8, 40, 30)
        for index, image in enumerate(splat.render(scene(), views)):
            views[index].name = f"{index}.png"
            image.save(cls.photos / views[index].name)
        splat.save_cameras(cls.photos / "transforms.json", views)

    def fit(self, name: str = "run", **options: Any) -> splat.Fit:
        given: Dict[str, Any] = {"data": self.photos, "steps": 60, "sh_degree": 1, "max_gaussians": 500, **options}
        return splat.Fit(self.folder / name, device=self.device, **given)

    def test_the_loss_falls_and_photographs_are_held_out(self) -> None:
        losses: List[float] = []
        scores: List[float] = []
        pieces = set()
        with self.fit() as fit:
            first = fit.scene
            for event in fit:
                if event.kind == Kind.STEP:
                    losses.append(event.numbers["l1"])
                if event.kind == Kind.VALIDATION:
                    scores.append(event.numbers["val_psnr"])
                if event.kind == Kind.VALIDATED_PIECE:
                    pieces.add(event.name)
                    assert event.drawn is not None
                    self.assertEqual(event.drawn.shape, (1, 3, 30, 40))
            self.assertEqual((event.kind, len(losses), pieces), (Kind.DONE, 60, {"0.png"}))
            self.assertLess(np.mean(losses[-7:]), 0.9 * np.mean(losses[:7]))
            self.assertGreater(scores[-1], scores[0] + 2)
            self.assertEqual(fit.report["val_psnr"], scores[-1])
            self.assertTrue(0 < len(fit.scene) <= 500)
            self.assertEqual(fit.scene.sh.shape[1:], (4, 3))
            made = {event.kind: event.numbers
                    for event in splat.Scoring(fit.scene, self.photos, border=0.1, device=self.device)}
            self.assertAlmostEqual(made[Kind.VALIDATION]["val_psnr"], scores[-1], 3)
            self.assertIn("inner_ssim", made[Kind.VALIDATION])
            self.refused(splat.InvalidArgument, "border is 0.5", splat.Scoring, fit.scene, self.photos, border=0.5)
            self.assertFalse(np.array_equal(first.means, fit.scene.means[:len(first)]))
        self.assertTrue((self.folder / "run/gaussians_last.safetensors").exists())
        self.refused(splat.InvalidHandle, "this Fit was closed", lambda: fit.scene)

    def test_an_interrupted_fit_resumes_with_the_same_bits(self) -> None:
        with self.fit(steps=24) as whole:
            list(whole)
            expected = whole.scene
        with self.fit("parts", steps=24) as fit:
            for event in fit:
                if event.step == 10:
                    fit.interrupt()
            self.assertEqual(event.kind, Kind.INTERRUPTED)
            self.refused(splat.InvalidState, "", splat.Fit, self.folder / "parts", resume=True)
        self.refused(splat.InvalidState, "", self.fit, "parts")
        with splat.Fit(self.folder / "parts", resume=True, device=self.device) as fit:
            list(fit)
            self.assertEqual(fit.scene, expected)
        with self.fit("parts", overwrite=True, steps=2, test_every=0, cameras="transforms") as fit:
            list(fit)
            self.assertEqual((fit.report["step"], fit.report["val_psnr"]), (2, None))

    def test_bad_input(self) -> None:
        cases: Tuple[Tuple[Type[BaseException], str, Dict[str, Any]], ...] = (
            (splat.InvalidArgument, "sh_degree is 4, expected 0 to 3", {"sh_degree": 4}),
            (splat.InvalidArgument, "cameras is 'all', expected one of auto, colmap", {"cameras": "all"}),
            (splat.InvalidArgument, "cameras is 9, expected a FitCameras value", {"cameras": 9}),
            (splat.InvalidArgument, "seconds is 3 and steps 60", {"seconds": 3}),
            (splat.InvalidArgument, "seconds is nan", {"seconds": math.nan}),
            (splat.InvalidArgument, "steps is -1", {"steps": -1}),
            (splat.InvalidArgument, "masks is an int", {"masks": 1}),
            (splat.InvalidArgument, "to resume the run and to overwrite", {"resume": True, "overwrite": True}),
            (splat.InvalidArgument, "data is None", {"data": None}),
            (splat.InvalidArgument, "downscale", {"downscale": 1000}),
            (splat.NotFound, "colmap", {"cameras": "colmap"}),
            (splat.NotFound, "nowhere", {"data": self.folder / "nowhere"}),
            (splat.NotFound, "masks", {"masks": self.folder / "masks"}),
            (TypeError, "seconds is a str", {"seconds": "3", "steps": None}))
        for error, words, options in cases:
            with self.subTest(words):
                self.refused(error, words, self.fit, **options)
        self.assertFalse((self.folder / "run").exists())

    def test_the_example_fits_photographs(self) -> None:
        example = (PYTHON / "examples" / "fit_photos.py").read_text(encoding="utf-8")
        place = [str(self.photos), str(self.folder / "example"), "0.5"]
        status, told, errors = run_program(f"import sys\nsys.argv[1:] = {place}\n{example}")
        self.assertEqual((status, errors), (0, ""))
        self.assertRegex(told, r"held-out PSNR [0-9.]+ dB, [0-9]+ Gaussians\n$")
        self.assertGreater(len(splat.Scene.load(self.folder / "example" / "scene.ply")), 0)
