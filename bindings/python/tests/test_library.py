"""Finding and checking the library; declarations against the description of the API."""
import ctypes
import enum
import errno
import json
import pickle
import subprocess
import sys
import unittest
from pathlib import Path
from typing import Any, Dict, List, Tuple, get_args

import libsplat as splat
from libsplat import _library, _native
from shared import Case, run_program

API = Path(__file__).resolve().parents[2] / "api" / "api.json"


class Layout(unittest.TestCase):
    """ctypes lays structs out as the compiler does."""

    def test_every_field_is_where_clang_puts_it(self) -> None:
        structs = json.loads(API.read_text("utf-8"))["structs"]
        self.assertEqual(set(_native.LAYOUT), {struct["name"] for struct in structs})
        for struct in structs:
            kind, _, size, rows = _native.LAYOUT[struct["name"]]
            self.assertEqual(ctypes.sizeof(kind), struct["size"], struct["name"])
            self.assertEqual(size, struct["size"])
            for field, (name, offset, length) in zip(struct["fields"], rows):
                found = getattr(kind, name)
                self.assertEqual((name, offset, length),
                                 (field["name"], field["offset"], field["size"]))
                self.assertEqual((found.offset, found.size), (offset, length),
                                 f"{struct['name']}.{name}")

    def test_the_table_has_every_struct_of_the_library(self) -> None:
        sizes = json.loads(_library.lib.splat_build_info())["structs"]
        self.assertEqual({name: row[2] for name, row in _native.LAYOUT.items()}, sizes)

    def test_every_function_is_declared(self) -> None:
        names = {function["name"] for function in json.loads(API.read_text("utf-8"))["functions"]}
        self.assertEqual({row[0] for row in _native.FUNCTIONS}, names)


class Mismatch(unittest.TestCase):
    """What of another library is refused, and what is not."""

    version = _native.VERSION[0] << 22 | _native.VERSION[1] << 12 | _native.VERSION[2]
    sizes: Dict[str, Any] = {name: row[2] for name, row in _native.LAYOUT.items()}

    def test_the_same_and_grown_structs_fit(self) -> None:
        self.assertIsNone(_library.mismatch(self.version, self.sizes))
        self.assertIsNone(_library.mismatch(self.version + 1, self.sizes))
        self.assertIsNone(_library.mismatch(
            self.version, {**self.sizes, "splat_device_desc": 1000, "splat_new_desc": 8}))

    def test_others_do_not(self) -> None:
        cases: List[Tuple[int, Dict[str, int], str]] = [
                (self.version + (1 << 12), self.sizes, "same minor version"),
                (self.version + (1 << 22), self.sizes, "same minor version"),
                (self.version, {**self.sizes, "splat_camera": 1000}, "splat_camera has 1000 bytes"),
                (self.version, {**self.sizes, "splat_device_desc": 8}, "splat_device_desc has 8"),
                (self.version, {}, "no struct")]
        for version, sizes, words in cases:
            self.assertIn(words, _library.mismatch(version, sizes) or "")


class Lookup(Case):
    """SPLAT_LIBRARY, and errors of the import."""

    def refuses(self, words: str, **variables: str) -> None:
        status, _, errors = run_program("import libsplat", **variables)
        self.assertEqual(status, 1, errors)
        self.assertIn("ImportError: libsplat", errors)
        self.assertIn(words, errors)

    def test_a_file_that_is_not_there(self) -> None:
        self.refuses("as SPLAT_LIBRARY says", SPLAT_LIBRARY=str(self.folder / "libsplat.so"))

    def test_no_library_at_all(self) -> None:
        self.refuses("let SPLAT_LIBRARY name its file", SPLAT_LIBRARY="", LD_LIBRARY_PATH="")

    def test_another_library(self) -> None:
        self.refuses("lacks a function", SPLAT_LIBRARY="libm.so.6")

    def test_another_version_and_another_layout(self) -> None:
        source = self.folder / "other.c"
        for name, version, structs, words in (
                ("newer", "0x2000", "{}", "version 0.2.0: before 1.0 only the same minor"),
                ("layout", "0x1000", '{\\"splat_device_info\\":8}', "version 0.1.0: ")):
            library = self.folder / f"lib{name}.so"
            source.write_text(f"unsigned splat_version(void) {{ return {version}; }}\n"
                              "const char* splat_build_info(void) "
                              f'{{ return "{{\\"structs\\":{structs}}}"; }}\n', "utf-8")
            try:
                subprocess.run(["cc", "-shared", "-fPIC", str(source), "-o", str(library)],
                               check=True)
            except FileNotFoundError:
                self.skipTest("no C compiler")
            self.refuses(words, SPLAT_LIBRARY=str(library))
            self.refuses(_library.REMEDY, SPLAT_LIBRARY=str(library))


class Errors(Case):
    """Codes, names and Python's kinds."""

    def test_each_code_has_a_class(self) -> None:
        codes = {int(code) for code in splat.Result if code < 0}
        self.assertEqual({code for code in codes
                          if type(_errors_class(code)) is splat.Error}, set())

    def test_classes_are_the_usual_ones(self) -> None:
        for kind, usual in ((splat.NotFound, FileNotFoundError), (splat.InvalidArgument, ValueError),
                            (splat.ShapeMismatch, ValueError), (splat.IoError, OSError),
                            (splat.OutOfHostMemory, MemoryError), (splat.Timeout, TimeoutError),
                            (splat.OutOfDeviceMemory, splat.OutOfMemory),
                            (splat.Unsupported, NotImplementedError),
                            (splat.InvalidState, RuntimeError)):
            self.assertTrue(issubclass(kind, usual) and issubclass(kind, splat.Error))

    def test_an_error_tells_code_name_and_sentence(self) -> None:
        error = self.refused(splat.InvalidArgument, "index is 9999", splat.describe, 9999)
        assert isinstance(error, splat.Error)
        self.assertEqual((error.code, error.name),
                         (splat.Result.ERROR_INVALID_ARGUMENT, "SPLAT_ERROR_INVALID_ARGUMENT"))

    def test_an_error_can_be_pickled(self) -> None:
        error = pickle.loads(pickle.dumps(splat.NotFound("gone", -12)))
        self.assertEqual((type(error), str(error), error.code), (splat.NotFound, "gone", -12))

    def test_errors_of_the_system_have_numbers(self) -> None:
        kinds: Dict[Any, Any] = {splat.NotFound: errno.ENOENT, splat.Timeout: errno.ETIMEDOUT,
                                 splat.IoError: None}
        for kind, number in kinds.items():
            made = kind("a sentence")
            self.assertEqual((made.errno, made.strerror, str(made)), (number, None, "a sentence"))
            again = pickle.loads(pickle.dumps(made))
            self.assertEqual((type(again), again.errno, str(again)), (kind, number, "a sentence"))


def _errors_class(code: int) -> splat.Error:
    from libsplat._errors import last_error
    return last_error(code)


class Types(unittest.TestCase):
    """Annotations and docstrings."""

    def test_every_enumeration_says_what_it_is(self) -> None:
        kinds: List[Any] = [each for each in vars(_native).values()
                            if isinstance(each, type) and issubclass(each, enum.Enum)]
        self.assertGreater(len(kinds), 40)
        for kind in kinds:
            self.assertNotRegex(kind.__doc__ or "of the headers", "of the headers")
        self.assertIn("GSPLAT           gsplat 1.6", splat.Convention.__doc__ or "")
        self.assertEqual(get_args(_native.ConventionName), ("3dgs", "gsplat", "ray_maximum"))

    def test_mypy_is_content(self) -> None:
        done = subprocess.run([sys.executable, "-m", "mypy", "--cache-dir=/dev/null"],
                              cwd=Path(__file__).resolve().parents[1], capture_output=True,
                              text=True, check=False)
        if "No module named mypy" in done.stderr:
            self.skipTest("no mypy; apt-get install mypy")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
