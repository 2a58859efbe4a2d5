"""Versions of PyTorch, each in a virtual environment of its own: some GB of the registry and minutes each."""
import os
import shutil
import tempfile
import unittest
from pathlib import Path

from environment import Environment
from shared import HERE

ROOM = 16 << 30  # bytes: a PyTorch of the registry has the libraries of CUDA


class PyTorch(unittest.TestCase):
    """The tests of libsplat.torch."""

    def passes(self, *packages: str, version: str) -> None:
        with tempfile.TemporaryDirectory() as place:
            free = shutil.disk_usage(place).free
            if free < ROOM:
                self.skipTest(f"{place} has room for {free >> 30} GiB, expected {ROOM >> 30}")
            environment = Environment(Path(place))
            environment.install("--no-cache-dir", "--only-binary=:all:", *packages)
            _, told = environment.run("-c", "import torch; print(torch.__version__)", folder=HERE)
            self.assertTrue(told.startswith(version), told)
            status, told = environment.run(HERE / "run.py", "test_torch", folder=HERE,
                                           SPLAT_LIBRARY=os.environ["SPLAT_LIBRARY"])
            self.assertEqual(status, 0, told)

    def test_the_oldest(self) -> None:
        self.passes("torch==1.13.*", "numpy<2", version="1.13.")

    def test_todays(self) -> None:
        self.passes("torch>=2", "numpy>=2", version="2.")
