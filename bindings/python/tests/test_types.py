"""Today's mypy and pyright of the registry on the package, its tests and examples; test_library has Debian's mypy."""
import tempfile
import unittest
from pathlib import Path
from typing import ClassVar

from environment import Environment
from shared import PYTHON

# The same as mypy has in pyproject.toml.
FILES = ("src", "tests", "examples", "wheel_backend.py", "../smoke/smoke.py")


class Types(unittest.TestCase):
    """One environment, with today's NumPy, and the system's PyTorch, as that of the registry is large."""

    environment: ClassVar[Environment]

    @classmethod
    def setUpClass(cls) -> None:
        place = tempfile.TemporaryDirectory()
        cls.addClassCleanup(place.cleanup)
        cls.environment = Environment(Path(place.name), "--system-site-packages")
        cls.environment.install("--upgrade", "mypy", "pyright", "numpy")

    def test_mypy_is_content(self) -> None:
        status, told = self.environment.run("-m", "mypy", "--cache-dir=/dev/null", folder=PYTHON)
        self.assertEqual(status, 0, told)

    def test_pyright_is_content(self) -> None:
        status, told = self.environment.run("-c", "import torch", folder=PYTHON)
        if status != 0:
            self.skipTest("no PyTorch; apt-get install python3-torch")
        status, told = self.environment.run("-m", "pyright", "--version", folder=PYTHON)
        if status != 0:
            self.skipTest("pyright does not fetch its program: " + told[-400:])
        status, told = self.environment.run("-m", "pyright", "--pythonpath", self.environment.python, *FILES,
                                            folder=PYTHON)
        self.assertEqual(status, 0, told)
