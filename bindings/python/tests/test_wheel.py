"""The wheel: its files, and the README's example in an empty folder with the wheel installed."""
import base64
import hashlib
import re
import sys
import tempfile
import unittest
import zipfile
from pathlib import Path
from typing import ClassVar
from unittest import mock

import numpy as np

from environment import Environment

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
        self.assertRegex(self.wheel.name, r"^libsplat-\d+\.\d+\.\d+-py3-none-manylinux_2_\d+_\w+\.whl$")
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
        for name in ("libsplat/py.typed", "libsplat/_native.py", "libsplat/lib/libsplat.so",
                     "libsplat/share/libsplat/weights/cars64/weights.safetensors",
                     "libsplat/share/libsplat/weights/cars64-depth-normal/weights.safetensors"):
            self.assertIn(name, names)

    def test_libraries_are_inside_and_in_order(self) -> None:
        with zipfile.ZipFile(self.wheel) as archive:
            order = archive.read("libsplat/lib/needed.txt").decode().split()
            self.assertEqual({f"libsplat/lib/{name}" for name in [*order, "libsplat.so"]},
                             {name for name in archive.namelist() if ".so" in name})
        self.assertLess(order.index("libz.so.1"), order.index("libpng16.so.16"))

    def test_the_same_bytes_again(self) -> None:
        again = wheel_backend.make_wheel(None, self.folder / "again")
        self.assertEqual(again.read_bytes(), self.wheel.read_bytes())

    def test_every_library_has_its_licence(self) -> None:
        with zipfile.ZipFile(self.wheel) as archive:
            metadata = archive.read(next(name for name in archive.namelist() if name.endswith("/METADATA"))).decode()
            texts = {name.rsplit("/", 1)[1] for name in archive.namelist() if "/licenses/" in name}
            libraries = archive.read("libsplat/lib/needed.txt").decode().split()
        self.assertEqual(set(re.findall("^License-File: (.*)", metadata, re.MULTILINE)), texts)
        self.assertEqual(len(texts), len(libraries) + 2, "those of libsplat and of what is compiled into it, too")
        with mock.patch("wheel_backend.DOCUMENTS", self.folder), \
                self.assertRaisesRegex(wheel_backend.WheelError, "the licence of .* is unknown"):
            wheel_backend.make_wheel(None, self.folder / "none")
        self.assertFalse((self.folder / "none").exists())

    def test_what_a_dll_has_inside(self) -> None:
        libraries, build = self.folder / "libraries", self.folder / "windows"
        for name in ("source/zlib/debian", "docs/mingw-w64-common", "docs/g++-mingw-w64-x86-64-posix"):
            (libraries / name).mkdir(parents=True)
            (libraries / name / "copyright").write_text(name, "utf-8")
        build.mkdir()
        rule = "build src/splat.dll src/splat.dll.a: LINKER | x\n  LINK_LIBRARIES = src/libsplat_io.a  "
        with mock.patch("wheel_backend.DOCUMENTS", libraries / "docs"):
            for linked, words in (("libz.a -lkernel32", ""), ("libnew.a", "libnew.a inside, whose licence is unknown"),
                                  ("libgif.a", "the licence of giflib is unknown")):
                (build / "build.ninja").write_text(f"{rule}{libraries}/prefix/lib/{linked}\n", "utf-8")
                if words:
                    with self.assertRaisesRegex(wheel_backend.WheelError, words):
                        wheel_backend.static_licences(build / "src" / "splat.dll")
                else:
                    self.assertIn("zlib.txt", wheel_backend.static_licences(build / "src" / "splat.dll"))
            with self.assertRaisesRegex(wheel_backend.WheelError, "does not say so"):
                wheel_backend.static_licences(self.folder / "alone" / "src" / "splat.dll")

    def test_what_a_dll_needs(self) -> None:
        for told, words in (("DLL Name: KERNEL32.dll\n", ""), ("", "no library at all"),
                            ("DLL Name: libgcc_s_seh-1.dll\n", "needs libgcc_s_seh-1")):
            with mock.patch("wheel_backend.run", return_value=told):
                if words:
                    with self.assertRaisesRegex(wheel_backend.WheelError, words):
                        wheel_backend.refuse_other_dlls(Path("splat.dll"))
                else:
                    wheel_backend.refuse_other_dlls(Path("splat.dll"))

    def test_the_platform_is_that_of_the_newest_symbol(self) -> None:
        for data, minor in ((b"", 17), (b"\0GLIBC_2.2.5\0GLIBC_2.35\0", 35), (b"\0GLIBC_2.4\0GLIBCXX_3.4.30\0", 35),
                            (b"\0GLIBC_2.36\0GLIBCXX_3.4.11\0", 36), (b"\0GLIBCXX_3.4.32\0", 39)):
            self.assertTrue(wheel_backend.platform_tag([b"", data]).startswith(f"manylinux_2_{minor}_"), data)
        with self.assertRaisesRegex(wheel_backend.WheelError, "GLIBCXX_3.4.99"):
            wheel_backend.platform_tag([b"\0GLIBCXX_3.4.99\0"])

    def test_errors(self) -> None:
        with self.assertRaisesRegex(wheel_backend.WheelError, "there is no library"):
            wheel_backend.make_wheel("gone.so", self.folder)
        with self.assertRaisesRegex(wheel_backend.WheelError, "is not libsplat 0"):
            wheel_backend.make_wheel(sys.executable, self.folder)
        with self.assertRaisesRegex(wheel_backend.WheelError, "does not find its built-in"):
            wheel_backend.weights_folder(self.folder / "alone.so")

    def test_in_an_empty_environment(self) -> None:
        environment, empty = Environment(self.folder / "venv"), self.folder / "empty"
        empty.mkdir()
        packages = Path(environment.run("-c", "import sysconfig; print(sysconfig.get_path('purelib'))",
                                        folder=empty)[1].strip())
        for own in (Path(np.__file__).parent, Path(np.__file__).parents[1] / "numpy.libs"):
            if own.exists():  # NumPy alone, of wherever this Python has it
                (packages / own.name).symlink_to(own)
        environment.install_wheel(self.wheel)

        def run(*arguments: object, **variables: str) -> str:
            status, told = environment.run(*arguments, folder=empty, **variables)
            self.assertEqual(status, 3 if variables else 0, told)
            return told

        text = (HERE.parent / "README.md").read_text("utf-8")
        example = re.search(r"```python\n(.*?)```", text, re.DOTALL)
        assert example is not None
        (empty / "example.py").write_text(example.group(1), "utf-8")
        self.assertIn("Gaussians", run("example.py"))
        self.assertEqual({path.name for path in empty.iterdir()},
                         {"example.py", "scene.ply", *(f"view{index}.png" for index in range(4))})
        used = run("-c", "import libsplat\nprint(open('/proc/self/maps').read())")
        for name in ("libsplat.so", "libpng16.so.16", "libyaml-0.so.2"):
            self.assertIn(f"{environment.folder}/lib/python", used[:used.index(name)].rsplit("\n", 1)[-1])

        self.assertIn("Gaussians in", run("-m", "libsplat", "demo", "--out", "shown"))
        self.assertLessEqual({"scene.ply", "orbit.png", "report.html", "view5.png"},
                             {path.name for path in (empty / "shown").iterdir()})
        self.assertIn(f"{packages}/libsplat/lib/libsplat.so", run("-m", "libsplat", "doctor"))
        none = str(empty / "none.json")
        for command in ("doctor", "demo"):
            told = run("-m", "libsplat", command, VK_ICD_FILENAMES=none, VK_DRIVER_FILES=none)
            self.assertIn("no usable Vulkan driver; install", told)
            self.assertNotIn("Traceback", told)
