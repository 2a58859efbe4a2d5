#!/usr/bin/env python3
"""Make the NuGet package of the C# binding: a zip with the assembly, the library, what that needs, and
its weights.

    pack.py --assembly Splat.dll --library libsplat.so --weights FOLDER --output FOLDER

The assembly is best that of `dotnet build`. One of mcs runs with mono only, which is said. What the
library needs beyond the system's C and C++ libraries is packed beside it, where its RUNPATH $ORIGIN
finds it; the licences of these are in licenses/. Of programs it needs `ldd` and `readelf`.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent.parent
sys.path.insert(0, str(ROOT / "bindings" / "python"))
from wheel_backend import SYSTEM, WheelError, licences, needed  # noqa: E402

# The same bytes for the same files.
DATE = (1980, 1, 1, 0, 0, 0)

RELATIONS = """<?xml version="1.0" encoding="utf-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
  <Relationship Type="http://schemas.microsoft.com/packaging/2010/07/manifest"
                Target="/Splat.nuspec" Id="R1" />
</Relationships>
"""
TYPES = """<?xml version="1.0" encoding="utf-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
  <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml" />
{defaults}  <Override PartName="/LICENSE" ContentType="application/octet" />
</Types>
"""


def version() -> str:
    """The version of the headers, as Native.cs has it."""
    text = (HERE.parent / "src" / "Native.cs").read_text(encoding="utf-8")
    return text.split('HeaderVersion = "', 1)[1].split('"', 1)[0]


class PackError(Exception):
    """Why there is no package, and what to do."""


def dynamic(library: Path) -> tuple[set[str], str]:
    """The SONAMEs that a library names itself, without those of the system, and its RUNPATH."""
    text = subprocess.run(["readelf", "-dW", str(library)], capture_output=True, text=True, check=True,
                          env={**os.environ, "LC_ALL": "C"}).stdout
    names = re.findall(r"\(NEEDED\).*\[(.*)\]", text)
    runpath = re.search(r"\(RUNPATH\).*\[(.*)\]", text)
    return {name for name in names if not SYSTEM.match(name)}, runpath.group(1) if runpath else "none"


def bundled(library: Path) -> dict[str, Path]:
    """The libraries to pack beside a library, by their SONAMEs."""
    named, runpath = dynamic(library)
    if runpath.split(":")[0] != "$ORIGIN":
        raise PackError(f"{library} has RUNPATH {runpath}, expected $ORIGIN first, without which it does not find "
                        "what is packed beside it; take the libsplat.so of a build or an installation")
    libraries = needed(library)
    for name in sorted(set(libraries) - named):
        raise PackError(f"{library} needs {name} through another library, for which its RUNPATH does not "
                        "hold; link it with libsplat.so, too")
    return libraries


def contents(arguments: argparse.Namespace) -> dict[str, bytes]:
    """Path in the package to bytes. The library finds its weights two folders above it, in share."""
    assembly = Path(arguments.assembly)
    number = version()
    nuspec = (HERE / "Splat.nuspec.in").read_text(encoding="utf-8").replace("@VERSION@", number)
    runtime = f"runtimes/{arguments.rid}"
    files = {
        "Splat.nuspec": nuspec.encode(),
        "LICENSE": (ROOT / "LICENSE").read_bytes(),
        "README.md": (HERE.parent / "README.md").read_bytes(),
        "lib/netstandard2.0/Splat.dll": assembly.read_bytes(),
        f"{runtime}/native/libsplat.so": Path(arguments.library).read_bytes(),
    }
    for name, path in sorted(bundled(Path(arguments.library)).items()):
        files[f"{runtime}/native/{name}"] = path.read_bytes()
        texts = licences({name: path})
        if not texts:
            print(f"pack.py: no licence of {name} is known here; add it to the package as "
                  f"licenses/{name}.txt", file=sys.stderr)
        for text in texts.values():
            files[f"licenses/{name}.txt"] = text
    documentation = assembly.with_suffix(".xml")
    if documentation.exists():
        files["lib/netstandard2.0/Splat.xml"] = documentation.read_bytes()
    weights = Path(arguments.weights)
    for path in sorted(weights.glob("*/*")):
        files[f"{runtime}/share/libsplat/weights/{path.relative_to(weights)}"] = path.read_bytes()
    extensions = sorted({name.rsplit(".", 1)[1] for name in files if "." in name.rsplit("/", 1)[-1]})
    defaults = "".join(f'  <Default Extension="{extension}" ContentType="application/octet" />\n'
                       for extension in extensions)
    files["[Content_Types].xml"] = TYPES.format(defaults=defaults).encode()
    files["_rels/.rels"] = RELATIONS.encode()
    return files


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--assembly", required=True, help="Splat.dll; Splat.xml beside it is taken too")
    parser.add_argument("--library", required=True, help="libsplat.so")
    parser.add_argument("--weights", required=True, help="folder of the folders of built-in weights")
    parser.add_argument("--rid", default="linux-x64", help="runtime identifier of the library")
    parser.add_argument("--output", required=True, help="folder for the package")
    arguments = parser.parse_args()
    try:
        files = contents(arguments)
    except (PackError, WheelError, OSError) as error:
        print(f"pack.py: {error}", file=sys.stderr)
        return 1
    if b"netstandard" not in files["lib/netstandard2.0/Splat.dll"]:
        print("pack.py: this Splat.dll was compiled for mono; for .NET build Splat.csproj and pack "
              "that one", file=sys.stderr)
    path = Path(arguments.output) / f"Splat.{version()}.nupkg"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as package:
        for name, data in files.items():
            package.writestr(zipfile.ZipInfo(name, DATE), data, zipfile.ZIP_DEFLATED)
    print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
