"""Tests of the ABI: the headers fit the dump of the last release; what fits and what does not."""

import re
import shutil
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.dont_write_bytecode = True

import abi  # noqa: E402


class Abi(unittest.TestCase):
    """Each test changes a copy of the headers and compares its stub with the dump."""

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.include = self.folder / "include"
        shutil.copytree(abi.INCLUDE, self.include)

    def change(self, header: str, pattern: str, replacement: str) -> None:
        """Replace the only match of a pattern in a header."""
        path = self.include / "splat" / f"{header}.h"
        text, count = re.subn(pattern, replacement, path.read_text(encoding="utf-8"), flags=re.S)
        self.assertEqual(count, 1, f"{count} matches of {pattern} in {header}.h")
        path.write_text(text, encoding="utf-8")

    def judge(self) -> str:
        """abidiff's report, empty if the changed headers are compatible."""
        errors = abi.build_stub(self.include, abi.stub_text(self.include), self.folder)
        self.assertEqual(errors, "")
        return abi.compare(abi.growing_structs(self.include), self.folder)

    def test_headers_fit_the_last_release(self) -> None:
        self.assertEqual(self.judge(), "", "an incompatible change: see CONTRIBUTING.md")

    def test_dump_is_complete(self) -> None:
        """The dump has every function, and no path."""
        text = abi.read_dump()
        for name in re.findall(r"\b(splat_\w+)\(", abi.stub_text(abi.INCLUDE)):
            self.assertTrue(f"<elf-symbol name='{name}'" in text, f"no {name}: run bindings/api/abi/update")
        for word in ("comp-dir-path", "filepath", " path='/"):
            self.assertFalse(word in text, word)

    def test_growth_is_accepted(self) -> None:
        """A member appended to every struct with struct_size, a function, an enumerator."""
        for path in (self.include / "splat").glob("*.h"):
            text = path.read_text(encoding="utf-8")
            text = re.sub(r"(typedef struct (\w+) \{\n    uint32_t struct_size;.*?)(\n\} \2;)",
                          r"\1\n    uint64_t appended;\3", text, flags=re.S)
            path.write_text(text, encoding="utf-8")
        self.change("core", r"SPLAT_DTYPE_U32 = 3", "SPLAT_DTYPE_U32 = 3, SPLAT_DTYPE_F16 = 4")
        self.change("core", r"(SPLAT_API uint32_t splat_version\(void\);)",
                    r"\1\nSPLAT_API uint32_t splat_added(void);")
        headers = "".join(p.read_text(encoding="utf-8") for p in self.include.glob("splat/*.h"))
        self.assertEqual(headers.count("appended;"), len(abi.growing_structs(self.include)))
        self.assertEqual(self.judge(), "")

    def test_a_use_for_a_reserved_member_is_accepted(self) -> None:
        """Alone, because abidiff 2.6 refuses it together with an appended member."""
        self.change("render", r"(uint32_t )reserved;(\n    double squared_error)", r"\1used;\2")
        self.assertEqual(self.judge(), "")

    def test_every_frozen_struct_is_guarded(self) -> None:
        """A member appended to one of them is refused, and the report names the struct."""
        growing = abi.growing_structs(self.include)
        stub = abi.stub_text(self.include)
        seen = 0
        for path in sorted((self.include / "splat").glob("*.h")):
            text = path.read_text(encoding="utf-8")
            for name in re.findall(r"^typedef struct (\w+) \{", text, flags=re.M):
                if name in growing:
                    continue
                seen += 1
                end = f"\n}} {name};"
                grown = text.replace(end, f"\n    uint64_t appended;{end}")
                path.write_text(grown, encoding="utf-8")
                self.assertEqual(abi.build_stub(self.include, stub, self.folder), "")
                self.assertIn(name, abi.compare(growing, self.folder))
            path.write_text(text, encoding="utf-8")
        self.assertGreater(seen, 10)

    def refused(self, header: str, pattern: str, replacement: str, word: str) -> None:
        """The change is incompatible, and the report has the word."""
        self.change(header, pattern, replacement)
        self.assertIn(word, self.judge())

    def test_changed_member_of_a_frozen_struct(self) -> None:
        self.refused("scene", r"double fy;([^\n]*\n    )double cx;", r"float fy;\1float cx;",
                     "splat_camera")

    def test_member_inserted_in_the_middle(self) -> None:
        self.refused("render", r"(uint32_t gaussians;)(\s+/\* V, most)", r"uint64_t more; \1\2",
                     "splat_rasterizer_desc")

    def test_removed_member(self) -> None:
        self.refused("core", r"    uint64_t budget_bytes;[^\n]*\n", "", "budget_bytes")

    def test_changed_and_appended_member(self) -> None:
        """Growth does not hide another change of the same struct."""
        self.change("core", r"(uint64_t budget_bytes;[^\n]*\n)", r"\1    uint64_t appended;\n")
        self.refused("core", r"uint64_t peak_bytes;( +/\* highest)", r"double peak_bytes;\1",
                     "peak_bytes")

    def test_exchanged_members(self) -> None:
        self.change("core", r"uint64_t live_bytes;", "uint64_t other_bytes;")
        self.change("core", r"uint64_t peak_bytes;", "uint64_t live_bytes;")
        self.refused("core", r"uint64_t other_bytes;", "uint64_t peak_bytes;", "live_bytes")

    def test_renamed_member(self) -> None:
        self.refused("scene", r"double fy;", "double focal_y;", "splat_camera_fy")

    def test_removed_function(self) -> None:
        self.refused("core", r"SPLAT_API uint32_t splat_version\(void\);", "", "splat_version")

    def test_changed_parameter(self) -> None:
        self.refused("core", r"(splat_device_describe\()uint32_t", r"\1uint64_t",
                     "splat_device_describe")

    def test_changed_value_of_an_enumerator(self) -> None:
        self.refused("core", r"SPLAT_DTYPE_I32 = 2(,[^\n]*\n    )SPLAT_DTYPE_U32 = 3",
                     r"SPLAT_DTYPE_I32 = 3\1SPLAT_DTYPE_U32 = 2", "SPLAT_DTYPE_I32")

    def test_changed_constant(self) -> None:
        self.refused("scene", r"#define SPLAT_SH_CONSTANT \(-1\)", "#define SPLAT_SH_CONSTANT (-2)",
                     "SPLAT_SH_CONSTANT")

    def test_changed_soname(self) -> None:
        """A new major version, before 1.0 a new minor one, has another SONAME, and so needs a new dump."""
        self.change("core", r"#define SPLAT_VERSION_MINOR 1", "#define SPLAT_VERSION_MINOR 2")
        self.assertEqual(abi.soname(self.include), "libsplat.so.0.2")
        self.refused("core", r"#define SPLAT_VERSION_MAJOR 0", "#define SPLAT_VERSION_MAJOR 1",
                     "SONAME")
        self.assertEqual(abi.soname(self.include), "libsplat.so.1")


if __name__ == "__main__":
    for tool, package in (("gcc", "gcc"), ("abidw", "abigail-tools"), ("abidiff", "abigail-tools"),
                          ("clang", "clang")):
        if shutil.which(tool) is None:
            print(f"{tool} is missing; install the package {package}")
            sys.exit(77)
    unittest.main(verbosity=2)
