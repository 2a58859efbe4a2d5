"""The wheel: its files, and the README's example in an empty folder with the wheel installed."""
import base64
import hashlib
import os
import re
import subprocess
import sys
import tempfile
import unittest
import zipfile
from pathlib import Path
from typing import ClassVar

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import wheel_backend  # noqa: E402


class Wheel(unittest.TestCase):
    """One wheel for all tests."""

    folder: ClassVar[Path]
    wheel: ClassVar[Path]

    @classmethod
    def setUpClass(cls) -> None:
        place = tempfile.TemporaryDirectory()
        cls.addClassCleanup(place.cleanup)
        cls.folder = Path(place.name)
        cls.wheel = wheel_backend.make_wheel(None, cls.folder / "dist")

    def test_name_and_record(self) -> None:
        self.assertRegex(self.wheel.name, r"^libsplat-\d+\.\d+\.\d+-py3-none-linux_\w+\.whl$")
        with zipfile.ZipFile(self.wheel) as archive:
            names = archive.namelist()
            info = next(name for name in names if name.endswith("/RECORD"))
            rows = [line.split(",") for line in archive.read(info).decode().splitlines()]
            self.assertEqual({row[0] for row in rows}, set(names))
            for name, digest, size in rows:
                if name != info:
                    data = archive.read(name)
                    found = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode()
                    self.assertEqual((digest, size), ("sha256=" + found.rstrip("="),
                                                      str(len(data))))
        for name in ("splat/py.typed", "splat/_native.py", "splat/lib/libsplat.so.0",
                     "splat/share/libsplat/weights/cars64/weights.safetensors",
                     "splat/share/libsplat/weights/cars64-depth-normal/weights.safetensors"):
            self.assertIn(name, names)

    def test_libraries_are_inside_and_in_order(self) -> None:
        with zipfile.ZipFile(self.wheel) as archive:
            order = archive.read("splat/lib/needed.txt").decode().split()
            self.assertEqual({f"splat/lib/{name}" for name in [*order, "libsplat.so.0"]},
                             {name for name in archive.namelist() if ".so" in name})
        self.assertLess(order.index("libz.so.1"), order.index("libpng16.so.16"))

    def test_the_same_bytes_again(self) -> None:
        again = wheel_backend.make_wheel(None, self.folder / "again")
        self.assertEqual(again.read_bytes(), self.wheel.read_bytes())

    def test_errors(self) -> None:
        with self.assertRaisesRegex(wheel_backend.WheelError, "there is no library"):
            wheel_backend.make_wheel("gone.so", self.folder)
        with self.assertRaisesRegex(wheel_backend.WheelError, "does not find its built-in"):
            copy = self.folder / "alone.so"
            copy.write_bytes(wheel_backend.library_file(None).read_bytes())
            wheel_backend.weights_folder(copy)

    def test_the_example_of_the_readme(self) -> None:
        environment = {name: value for name, value in os.environ.items()
                       if name not in ("SPLAT_LIBRARY", "PYTHONPATH", "LD_LIBRARY_PATH")}
        venv, empty = self.folder / "venv", self.folder / "empty"
        empty.mkdir()

        def run(*command: object) -> str:
            done = subprocess.run([str(each) for each in command], cwd=empty, env=environment,
                                  capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            return done.stdout

        made = subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", str(venv)],
                              capture_output=True, text=True, check=False)
        if made.returncode != 0:
            self.skipTest("no virtual environments; apt-get install python3-venv: " + made.stdout)
        python = venv / "bin" / "python"
        packages, = venv.glob("lib/python*/site-packages")  # inside another one it sees none of its packages
        (packages / "numpy.pth").write_text(str(Path(np.__file__).parent.parent), "utf-8")
        run(python, "-m", "pip", "install", "--no-index", "--no-deps", self.wheel)
        text = (HERE.parent / "README.md").read_text("utf-8")
        example = re.search(r"```python\n(.*?)```", text, re.DOTALL)
        assert example is not None
        (empty / "example.py").write_text(example.group(1), "utf-8")
        self.assertIn("Gaussians", run(python, "example.py"))
        self.assertEqual({path.name for path in empty.iterdir()},
                         {"example.py", "scene.ply", *(f"view{index}.png" for index in range(4))})
        used = run(python, "-c", "import splat\nprint(open('/proc/self/maps').read())")
        for name in ("libsplat.so.0", "libpng16.so.16", "libyaml-0.so.2"):
            self.assertIn(f"{venv}/lib/python", used[:used.index(name)].rsplit("\n", 1)[-1])
