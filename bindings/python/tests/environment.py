"""A virtual environment of its own for a test, with packages of the registry or with the wheel of this tree."""
import os
import subprocess
import sys
import unittest
from pathlib import Path
from typing import Dict, Tuple

# What would lead a program away from what is installed in the environment.
OTHERS = ("SPLAT_LIBRARY", "PYTHONPATH", "PYTHONHOME", "LD_LIBRARY_PATH")


class Environment:
    """An empty virtual environment, whichever Python runs the test."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.folder = folder
        made = subprocess.run([sys.executable, "-m", "venv", *options, str(folder)], capture_output=True, text=True,
                              check=False)
        if made.returncode != 0:
            raise unittest.SkipTest("no virtual environments; apt-get install python3-venv: " + made.stdout)
        self.python = folder / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")

    def run(self, *arguments: object, folder: Path, **variables: str) -> Tuple[int, str]:
        """Exit status, and what Python with these arguments printed, in a folder."""
        environment: Dict[str, str] = {name: value for name, value in os.environ.items() if name not in OTHERS}
        done = subprocess.run([str(self.python), *map(str, arguments)], cwd=folder, env={**environment, **variables},
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
        return done.returncode, done.stdout

    def install(self, *packages: object) -> None:
        """Packages of the registry; SkipTest if it is not reached."""
        status, told = self.run("-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--retries", "1",
                                *packages, folder=self.folder)
        if status != 0:
            raise unittest.SkipTest(f"pip does not install {' '.join(map(str, packages))}: {told.strip()[-400:]}")

    def install_wheel(self, wheel: Path) -> None:
        """A wheel alone; it must succeed."""
        status, told = self.run("-m", "pip", "install", "--no-index", "--no-deps", wheel, folder=self.folder)
        if status != 0:
            raise AssertionError(told)
