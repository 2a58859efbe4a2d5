#!/usr/bin/env python3
"""tools/release finds manifests of another version and a changelog without the release's section; its list of what is
bundled, and the copyright file of packages of Debian, name every project."""

import contextlib
import glob
import importlib.machinery
import importlib.util
import io
import re
import shutil
import sys
import tempfile
import unittest
import zipfile
from pathlib import Path
from typing import Tuple

ROOT = Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
loader = importlib.machinery.SourceFileLoader("release", str(ROOT / "tools" / "release"))
spec = importlib.util.spec_from_loader("release", loader)
assert spec is not None
release = importlib.util.module_from_spec(spec)
loader.exec_module(release)
bundled = release.bundled
notices = sys.modules["notices"]


class Checks(unittest.TestCase):
    def setUp(self) -> None:
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = Path(self.folder.name)
        self.addCleanup(setattr, release, "ROOT", ROOT)
        release.ROOT = self.root
        self.files = [name for pattern, _ in release.MANIFESTS for name in glob.glob(pattern, root_dir=ROOT)]
        for name in [*self.files, "CHANGELOG.md"]:
            (self.root / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, self.root / name)

    def check(self, *options: str) -> Tuple[int, str]:
        """The status and the messages of a check."""
        with contextlib.redirect_stderr(io.StringIO()) as said, contextlib.redirect_stdout(io.StringIO()):
            status = release.main(["--check", "--no-abi", *options])
        return status, said.getvalue()

    def changelog(self, text: str) -> None:
        (self.root / "CHANGELOG.md").write_text(f"# Changelog\n\n{text}", "utf-8")

    def test_these_sources_pass(self) -> None:
        self.assertEqual(self.check("--draft"), (0, ""))

    def test_each_manifest_is_compared(self) -> None:
        version, _ = release.versions()
        self.assertGreater(len(self.files), 7)
        for name in self.files:
            file = self.root / name
            text = file.read_text("utf-8")
            joined = version.replace(".", ", ")
            other = text.replace(version, "9.9.9").replace(f"({joined})", "(9, 9, 9)")
            file.write_text(re.sub(r"(SPLAT_VERSION_MINOR) \d+", r"\1 9", other), "utf-8")
            status, said = self.check("--draft")
            self.assertEqual((status, name in said), (1, True), f"{name}: {said}")
            file.write_text("", "utf-8")
            self.assertIn("has version none" if name != "CMakeLists.txt" else "CMakeLists.txt", self.check("--draft")[1])
            file.write_text(text, "utf-8")

    def test_changelog_has_the_release(self) -> None:
        version, _ = release.versions()
        self.changelog(f"## [{version}] - 2026-12-01\n\n### Added\n\n- A line.\n")
        self.assertEqual(self.check(), (0, ""))
        self.changelog("## [Unreleased]\n\n- A line.\n")
        self.assertEqual(self.check("--draft")[0], 0)
        self.assertIn(f"begins with [Unreleased], expected [{version}]", self.check()[1])
        self.changelog(f"## [{version}] - 2026-12-01\n\n### Added\n\n## [0.0.1] - 2025-01-01\n\n- A line.\n")
        self.assertIn("has no lines", self.check()[1])
        self.changelog(f"## [{version}]\n\n- A line.\n")
        self.assertIn("expected ' - YYYY-MM-DD'", self.check()[1])


class Bundles(unittest.TestCase):
    def test_copyright_names_every_project(self) -> None:
        text = notices.debian_copyright()
        rows = notices.projects((ROOT / "THIRD-PARTY.md").read_text("utf-8"))
        self.assertEqual({row.name for row in rows}, set(bundled.HEADERS))
        for row in rows:
            self.assertIn(f"Comment: {row.name}, {row.url}", text)
            self.assertIn(f"\nLicense: {row.licence}\n ", text)
        self.assertFalse([line for line in text.split("\n\n")[0].split("\n") if not re.match(r"[A-Z][A-Za-z-]+: .", line)])

    def test_unknown_licences_are_refused(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            shutil.copy(ROOT / "LICENSE", name)
            text = (ROOT / "THIRD-PARTY.md").read_text("utf-8").replace("| MIT | 2018", "| Zlib | 2018")
            Path(name, "THIRD-PARTY.md").write_text(text, "utf-8")
            with self.assertRaisesRegex(SystemExit, "no text of Zlib, the licence of volk"):
                notices.debian_copyright(Path(name))

    def test_bundled_libraries_are_listed(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            packages = [Path(name, "a.whl"), Path(name, "b.zip"), Path(name, "c.crate"), Path(name, "vkrun_1.deb")]
            for path, files in zip(packages, (["x/lib/libsplat.so.0.1", "x/lib/libunknown-0123456789.so.3"],
                                              ["y/bin/splat.dll", "y/bin/vkrun.exe"])):
                with zipfile.ZipFile(path, "w") as archive:
                    for file in files:
                        archive.writestr(file, "")
            release.tarfile.open(packages[2], "w:gz").close()
            packages[3].write_bytes(b"")
            document = bundled.spdx(packages, "1.2.3", 0)
        names = {each["SPDXID"]: each["name"] for each in document["packages"]}
        contents = {path.name: {names[each["relatedSpdxElement"]] for each in document["relationships"]
                                if names.get(each["spdxElementId"]) == path.name} for path in packages}
        headers = set(bundled.HEADERS)
        self.assertEqual(contents, {"a.whl": headers - {"CLI11"} | {"libunknown.so.3"},
                                    "b.zip": headers | set(bundled.WINDOWS.values()),
                                    "c.crate": set(), "vkrun_1.deb": {"CLI11", "JSON for Modern C++"}})
        self.assertEqual(len([each for each in document["relationships"] if each["relationshipType"] == "DESCRIBES"]), 4)
        self.assertEqual(document["creationInfo"]["created"], "1970-01-01T00:00:00Z")

    def test_the_image_takes_packages_that_are_made(self) -> None:
        control = (ROOT / "packaging/debian/control").read_text("utf-8").replace("@ABI@", "0.1")
        made = [f"{name}_1.deb" for name in re.findall(r"^Package: (.+)$", control, re.MULTILINE)]
        copied = re.findall(r"\S+\.deb", re.findall(r"^COPY .*", (ROOT / "packaging/Containerfile").read_text("utf-8"),
                                                    re.MULTILINE)[0])
        for pattern in copied:
            self.assertEqual(len([name for name in made if Path(name).match(pattern)]), 1, pattern)


if __name__ == "__main__":
    unittest.main()
