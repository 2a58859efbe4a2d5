#!/usr/bin/env python3
"""Check the listing and the manifest of a package of pack.py, unpack it, and check that its libsplat.so
finds what it needs in the package.

    check.py Splat.0.1.0.nupkg FOLDER
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as xml
import zipfile
from pathlib import Path

from pack import dynamic, needed

NATIVE = "runtimes/linux-x64/native/"
EXPECTED = {
    "Splat.nuspec", "LICENSE", "README.md", "[Content_Types].xml", "_rels/.rels",
    "lib/netstandard2.0/Splat.dll", "lib/netstandard2.0/Splat.xml",
    "runtimes/linux-x64/native/libsplat.so",
} | {"runtimes/linux-x64/share/libsplat/weights/" + path for path in (
    "cars64/weights.safetensors", "cars64/chairs.safetensors", "cars64/chairs.json", "cars64/config.json",
    "cars64/cars64.yaml", "cars64/README.md", "cars64/chairs.md",
    "cars64-depth-normal/weights.safetensors", "cars64-depth-normal/config.json", "cars64-depth-normal/README.md")}
NUSPEC = "{http://schemas.microsoft.com/packaging/2013/05/nuspec.xsd}"
TYPES = "{http://schemas.openxmlformats.org/package/2006/content-types}"


def problems(package: zipfile.ZipFile, name: str) -> list[str]:
    """Sentences on what is wrong with a package of that file name."""
    found = []
    names = set(package.namelist())
    bundled = {path for path in names - EXPECTED if path.startswith(NATIVE)}
    texts = {path.replace(NATIVE, "licenses/") + ".txt" for path in bundled}
    found += [f"{path} is missing" for path in sorted(texts - names)]
    names -= bundled | texts
    found += [f"{path} is missing" for path in sorted(EXPECTED - names)]
    found += [f"{path} is not expected" for path in sorted(names - EXPECTED)]
    if found:
        return found
    metadata = xml.fromstring(package.read("Splat.nuspec")).find(f"{NUSPEC}metadata")
    version = "" if metadata is None else metadata.findtext(f"{NUSPEC}version")
    if not name.endswith(f"Splat.{version}.nupkg"):
        found.append(f"the manifest has version {version}, the file is {name}")
    known = {entry.get("Extension") for entry in xml.fromstring(
        package.read("[Content_Types].xml")).iter(f"{TYPES}Default")}
    for path in sorted((names | bundled | texts) - {"LICENSE", "[Content_Types].xml"}):
        if path.rsplit(".", 1)[1] not in known:
            found.append(f"[Content_Types].xml has no type for {path}")
    if package.read("lib/netstandard2.0/Splat.dll")[:2] != b"MZ":
        found.append("Splat.dll is no assembly")
    if package.read("runtimes/linux-x64/native/libsplat.so")[:4] != b"\x7fELF":
        found.append("libsplat.so is no library")
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
        found = problems(package, name) or problems_of_libraries(Path(folder) / NATIVE)
    for sentence in found:
        print(f"check.py: {sentence}", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
