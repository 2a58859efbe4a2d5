"""Attributes: a name that a class does not have cannot be assigned to."""
import copy
import dataclasses
import enum
import inspect
import pickle
import unittest
from typing import Any, List

import numpy as np

import libsplat as splat
from libsplat import _records
from shared import Case, picture, scene


def classes() -> List[Any]:
    """All public classes whose instances hold something: not errors, not enumerations."""
    found = [getattr(splat, name) for name in splat.__all__] + list(vars(_records).values())
    return [each for each in found if isinstance(each, type) and each.__module__.startswith("libsplat")
            and not issubclass(each, (BaseException, enum.Enum))]


class Attributes(Case):
    """Misspelt names, and what may be assigned."""

    def test_no_class_takes_other_names(self) -> None:
        self.assertGreater(len(classes()), 40)
        for kind in classes():
            made = kind.__new__(kind)
            with self.assertRaises(AttributeError, msg=kind.__name__):
                made.no_such_name = 1
            self.assertFalse(hasattr(made, "no_such_name"), kind)

    def test_objects(self) -> None:
        camera, made = splat.Camera(4, 4, 5), scene()
        for each, name in ((camera, "focal"), (camera, "wrld_to_camera"), (made, "positions"),
                           (splat.Image(picture()), "arry"), (splat.Picture("a.png"), "msak"),
                           (self.device, "max_bytes"), (splat.Tensor(self.device, 1), "data")):
            with self.assertRaises(AttributeError):
                setattr(each, name, 500)
        shown = splat.Picture("a.png")
        shown.mask, camera.name, made.means = "b.png", "a", made.means + 1
        self.assertEqual(shown, dataclasses.replace(shown))

    def test_classes_of_callers_have_what_they_like(self) -> None:
        class Named(splat.Scene):
            def __init__(self) -> None:
                super().__init__(np.ones((2, 3), np.float32))
                self.title = "two"

        class Labelled(splat.Picture):
            label = ""

        labelled = Labelled("a.png")
        labelled.label = labelled.other = "car"  # type: ignore[attr-defined]
        self.assertEqual((Named().title, len(Named()), labelled.label), ("two", 2, "car"))

    def test_copies_and_signatures(self) -> None:
        image = splat.Image.load(splat.Image(picture()).to_bytes())
        for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1):
            again = pickle.loads(pickle.dumps(image, protocol))
            np.testing.assert_array_equal(again, image)
            self.assertEqual((again.bits, again.focal), (8, 0))
        np.testing.assert_array_equal(copy.deepcopy(image), image)
        given = splat.Picture(b"bytes", focal=3.0)
        self.assertEqual(pickle.loads(pickle.dumps(copy.copy(given))), given)
        self.assertIn("means", inspect.signature(splat.Scene).parameters)
