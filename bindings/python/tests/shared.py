"""What the tests share: one device, small objects, and programs of their own."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from typing import Any, ClassVar, Dict, List, Tuple, Type

import numpy as np

import libsplat as splat

HERE = Path(__file__).resolve().parent
PYTHON = HERE.parent
CONFIG: Dict[str, Any] = {
    "model": {"base_dim": 8, "num_blocks": 1, "channel_mult": [1, 2], "attention_resolutions": [8]},
    "data": {"training_resolution": 16},
    "opt": {"batch_size": 1, "imgs_per_obj": 2, "iterations": 100000},
    "logging": {"ckpt_iterations": 100000, "val_log": 0},
}


class Case(unittest.TestCase):
    """A test with a device and a folder that is removed behind it."""

    device: ClassVar[splat.Device]
    folder: Path

    @classmethod
    def setUpClass(cls) -> None:
        cls.device = splat.default_device()

    def setUp(self) -> None:
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.folder = Path(place.name)

    def refused(self, kind: Type[BaseException], words: str, function: Any, /,
                *arguments: Any, **named: Any) -> BaseException:
        """The call raises exactly this class, and its text has these words."""
        with self.assertRaises(kind) as caught:
            function(*arguments, **named)
        self.assertIs(type(caught.exception), kind)
        self.assertIn(words, str(caught.exception))
        return caught.exception


def values(*shape: int, seed: int = 0) -> Any:
    """Numbers from 0 to 1."""
    return np.random.default_rng(seed).random(shape, np.float32)


def arrays(count: int, degree: int = 0) -> Dict[str, Any]:
    """Gaussians in a cube from -1 to 1, as arrays."""
    return {"means": values(count, 3) * 2 - 1, "scales": values(count, 3, seed=1) / 5 + 0.02,
            "rotations": values(count, 4, seed=2) + 0.1, "opacities": values(count, seed=3),
            "sh": values(count, (degree + 1)**2, 3, seed=4) - 0.5}


def scene(count: int = 50, degree: int = 0) -> splat.Scene:
    """The same as a scene."""
    given = arrays(count, degree)
    return splat.Scene(given.pop("means"), **given)


def cameras(count: int = 1, width: int = 48, height: int = 32) -> List[splat.Camera]:
    """Cameras around it."""
    return splat.Camera.orbit(scene(), count, width=width, height=height)


def picture() -> Any:
    """A disc with alpha, uint8 [64,80,4]."""
    y, x = np.mgrid[:64, :80]
    disc = (2 * x - 79)**2 + (2 * y - 63)**2 < 2304
    return np.stack([5 * x, 7 * y, x * y, 255 * disc], -1).astype(np.uint8)


def run_program(text: str, **variables: str) -> Tuple[int, str, str]:
    """Exit status, output and errors of a Python program with the same library."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(PYTHON / "src"), str(HERE)]),
                   **variables}
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, timeout=300,
                          env=environment, check=False)
    return done.returncode, done.stdout, done.stderr
