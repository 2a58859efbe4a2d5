#!/usr/bin/env python3
"""Make the NuGet package of the C# binding: a zip with the assembly, the library and its weights.

    pack.py --assembly Splat.dll --library libsplat.so --weights FOLDER --output FOLDER

The assembly is best that of `dotnet build`. One of mcs runs with mono only, which is said.
"""

from __future__ import annotations

import argparse
import sys
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent.parent
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
    files = contents(arguments)
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
