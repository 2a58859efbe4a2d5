"""Versions of NumPy, each in a virtual environment of its own, where the registry is reached."""
import os
import tempfile
import unittest
from pathlib import Path

from environment import Environment
from shared import HERE

TESTS = ("test_tensor", "test_scene")


class NumPy(unittest.TestCase):
    """The tests of what passes arrays."""

    def passes(self, asked: str, version: str) -> None:
        with tempfile.TemporaryDirectory() as place:
            environment = Environment(Path(place))
            environment.install("--only-binary=:all:", asked)
            _, told = environment.run("-c", "import numpy; print(numpy.__version__)", folder=HERE)
            self.assertTrue(told.startswith(version), told)
            for name in TESTS:
                status, told = environment.run(HERE / "run.py", name, folder=HERE,
                                               SPLAT_LIBRARY=os.environ["SPLAT_LIBRARY"])
                self.assertEqual(status, 0, told)

    def test_the_oldest(self) -> None:
        self.passes("numpy==1.24.*", "1.24.")

    def test_todays(self) -> None:
        self.passes("numpy>=2", "2.")
