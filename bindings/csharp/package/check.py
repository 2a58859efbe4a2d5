#!/usr/bin/env python3
"""Check the listing and the manifest of a package of pack.py, unpack it, and check that its libsplat.so
finds what it needs in the package.

    check.py Libsplat.0.1.0.nupkg FOLDER
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as xml
import zipfile
from pathlib import Path

from pack import dynamic, needed
from wheel_backend import COMPILER, STATIC

LINUX = "runtimes/linux-x64/native/"
WINDOWS = "runtimes/win-x64/native/libsplat.dll"
NET8 = "lib/net8.0/Splat.dll"
EXPECTED = {
    "Libsplat.nuspec", "LICENSE", "README.md", "THIRD-PARTY.md", "[Content_Types].xml", "_rels/.rels",
    "buildTransitive/Libsplat.targets", "lib/netstandard2.0/Splat.dll", "lib/netstandard2.0/Splat.xml",
    LINUX + "libsplat.so",
} | {"runtimes/share/libsplat/weights/" + path for path in (
    "cars64/weights.safetensors", "cars64/chairs.safetensors", "cars64/chairs.json", "cars64/config.json",
    "cars64/cars64.yaml", "cars64/README.md", "cars64/chairs.md",
    "cars64-depth-normal/weights.safetensors", "cars64-depth-normal/config.json", "cars64-depth-normal/README.md")}
NUSPEC = "{http://schemas.microsoft.com/packaging/2013/05/nuspec.xsd}"
TYPES = "{http://schemas.openxmlformats.org/package/2006/content-types}"


def problems(package: zipfile.ZipFile, name: str) -> list[str]:
    """Sentences on what is wrong with a package of that file name."""
    found = []
    names = set(package.namelist())
    expected = set(EXPECTED)
    if WINDOWS in names:
        expected |= {WINDOWS, *(f"licenses/win-x64/{each}.txt" for each in {*STATIC.values(), *COMPILER})}
    if NET8 in names:
        expected |= {NET8, NET8.replace(".dll", ".xml")}
    bundled = {path for path in names - expected if path.startswith(LINUX)}
    texts = {path.replace(LINUX, "licenses/") + ".txt" for path in bundled}
    found += [f"{path} is missing" for path in sorted((texts | expected) - names)]
    found += [f"{path} is not expected" for path in sorted(names - expected - bundled - texts)]
    if found:
        return found
    metadata = xml.fromstring(package.read("Libsplat.nuspec")).find(f"{NUSPEC}metadata")
    version = "" if metadata is None else metadata.findtext(f"{NUSPEC}version")
    if not name.endswith(f"Libsplat.{version}.nupkg"):
        found.append(f"the manifest has version {version}, the file is {name}")
    known = {entry.get("Extension") for entry in xml.fromstring(
        package.read("[Content_Types].xml")).iter(f"{TYPES}Default")}
    for path in sorted(names - {"LICENSE", "[Content_Types].xml"}):
        if path.rsplit(".", 1)[1] not in known:
            found.append(f"[Content_Types].xml has no type for {path}")
    for path in sorted(names):
        start = {".dll": b"MZ", ".so": b"\x7fELF"}.get(Path(path).suffix, b"")
        if not package.read(path).startswith(start):
            found.append(f"{path} is no library")
    return found


def problems_of_libraries(native: Path) -> list[str]:
    """Sentences on libraries that the one in this folder needs and does not find here."""
    library = native / "libsplat.so"
    named, runpath = dynamic(library)
    first = runpath.split(":")[0]
    found = [] if first == "$ORIGIN" else [f"libsplat.so has RUNPATH {runpath}, expected $ORIGIN first"]
    here = {path.name for path in native.iterdir()} - {library.name}
    found += [f"libsplat.so does not need {name}" for name in sorted(here - named)]
    for path in sorted(native.iterdir()):
        found += [f"{path.name} needs {name}, which is missing" for name in sorted(dynamic(path)[0] - here)]
    # The loader finds them this way.
    found += [f"libsplat.so takes {name} of {path.parent}" for name, path in sorted(needed(library).items())
              if path.parent != native.resolve()]
    return found


def main() -> int:
    name, folder = sys.argv[1:]
    with zipfile.ZipFile(name) as package:
        for path in sorted(package.namelist()):
            print(path)
        package.extractall(folder)
        found = problems(package, name) or problems_of_libraries(Path(folder) / LINUX)
    for sentence in found:
        print(f"check.py: {sentence}", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
