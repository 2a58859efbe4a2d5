#!/usr/bin/env python3
"""Make the NuGet package of the C# binding: a zip with the assemblies, the libraries for Linux and Windows, what these
need, and the weights.

    pack.py --library libsplat.so --weights FOLDER [--windows splat.dll] \\
        (--assembly Splat.dll [--net8 Splat.dll] --output FOLDER | --files FOLDER)

The assemblies are best those of `dotnet build`; one of mcs runs with mono only, which is said. With --files all
but the assemblies is laid into a folder, from which `dotnet pack` makes the package. What libsplat.so needs beyond the
system's C and C++ libraries is packed beside it, where its RUNPATH $ORIGIN finds it. licenses/ has the licences of
these, and of what splat.dll has inside: the debian/copyright of the sources that tools/windows/libraries unpacked. Of
programs it needs `ldd` and `readelf`. The same files make the same bytes.
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
from wheel_backend import (  # noqa: E402
    SYSTEM, WheelError, licences, needed, refuse_other_dlls, static_licences)

# The same bytes for the same files.
DATE = (1980, 1, 1, 0, 0, 0)

RELATIONS = """<?xml version="1.0" encoding="utf-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
  <Relationship Type="http://schemas.microsoft.com/packaging/2010/07/manifest"
                Target="/Libsplat.nuspec" Id="R1" />
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


GROUP = """      <group targetFramework="{framework}">
{dependencies}      </group>
"""
DEPENDENCIES = {"netstandard2.0": (".NETStandard2.0", {"System.Memory": "4.5.5", "System.Numerics.Vectors": "4.5.0"}),
                "net8.0": ("net8.0", {})}


def native(arguments: argparse.Namespace) -> dict[str, bytes]:
    """What `dotnet pack` does not know: libraries, licences, weights, and the targets that copy these."""
    files = {
        "THIRD-PARTY.md": (ROOT / "THIRD-PARTY.md").read_bytes(),
        "buildTransitive/Libsplat.targets": (HERE / "Libsplat.targets").read_bytes(),
        "runtimes/linux-x64/native/libsplat.so": Path(arguments.library).read_bytes(),
    }
    for name, path in sorted(bundled(Path(arguments.library)).items()):
        files[f"runtimes/linux-x64/native/{name}"] = path.read_bytes()
        texts = licences({name: path})
        if not texts:
            print(f"pack.py: no licence of {name} is known here; add it to the package as "
                  f"licenses/{name}.txt", file=sys.stderr)
        for text in texts.values():
            files[f"licenses/{name}.txt"] = text
    if arguments.windows:
        # Splat.dll is the assembly, and Windows ignores case.
        files["runtimes/win-x64/native/libsplat.dll"] = Path(arguments.windows).read_bytes()
        refuse_other_dlls(Path(arguments.windows))
        texts = static_licences(Path(arguments.windows))
        files.update((f"licenses/win-x64/{name}", text) for name, text in texts.items())
    # A library in the folder of the package finds them two folders above it, in share.
    weights = Path(arguments.weights)
    paths = sorted(weights.glob("*/*"))
    if not any(path.name == "weights.safetensors" for path in paths):
        raise PackError(f"{weights} has no folders of built-in weights, expected such as cars64: name tools/weights of "
                        "a build")
    files.update((f"runtimes/share/libsplat/weights/{path.relative_to(weights)}", path.read_bytes()) for path in paths)
    return files


def contents(arguments: argparse.Namespace) -> dict[str, bytes]:
    """Path in the package to bytes."""
    files = {"LICENSE": (ROOT / "LICENSE").read_bytes(), "README.md": (HERE.parent / "README.md").read_bytes(),
             **native(arguments)}
    groups = ""
    for target, name in (("netstandard2.0", arguments.assembly), ("net8.0", arguments.net8)):
        if not name:
            continue
        framework, dependencies = DEPENDENCIES[target]
        groups += GROUP.format(framework=framework, dependencies="".join(
            f'        <dependency id="{each}" version="{number}" />\n' for each, number in dependencies.items()))
        files[f"lib/{target}/Splat.dll"] = Path(name).read_bytes()
        documentation = Path(name).with_suffix(".xml")
        if documentation.exists():
            files[f"lib/{target}/Splat.xml"] = documentation.read_bytes()
    nuspec = (HERE / "Libsplat.nuspec.in").read_text(encoding="utf-8")
    files["Libsplat.nuspec"] = nuspec.replace("@VERSION@", version()).replace("@GROUPS@", groups).encode()
    extensions = sorted({name.rsplit(".", 1)[1] for name in files if "." in name.rsplit("/", 1)[-1]})
    defaults = "".join(f'  <Default Extension="{extension}" ContentType="application/octet" />\n'
                       for extension in extensions)
    files["[Content_Types].xml"] = TYPES.format(defaults=defaults).encode()
    files["_rels/.rels"] = RELATIONS.encode()
    return files


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", 1)[0])
    parser.add_argument("--assembly", help="Splat.dll for netstandard2.0; Splat.xml beside it is taken too")
    parser.add_argument("--net8", help="Splat.dll for net8.0, alike")
    parser.add_argument("--library", required=True, help="libsplat.so")
    parser.add_argument("--windows", help="splat.dll in the build tree that made it")
    parser.add_argument("--weights", required=True, help="folder of the folders of built-in weights")
    parser.add_argument("--output", help="folder for the package; needs --assembly")
    parser.add_argument("--files", help="instead: folder for what dotnet pack takes")
    arguments = parser.parse_args()
    if bool(arguments.files) == bool(arguments.output) or bool(arguments.output) != bool(arguments.assembly):
        parser.error("give --assembly and --output for a package, or --files for what dotnet pack takes")
    try:
        files = native(arguments) if arguments.files else contents(arguments)
    except (PackError, WheelError, OSError) as error:
        print(f"pack.py: {error}", file=sys.stderr)
        return 1
    if arguments.files:
        for name, data in files.items():
            path = Path(arguments.files) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        print(arguments.files)
        return 0
    if b"netstandard" not in files["lib/netstandard2.0/Splat.dll"]:
        print("pack.py: this Splat.dll was compiled for mono; for .NET build Splat.csproj and pack "
              "that one", file=sys.stderr)
    path = Path(arguments.output) / f"Libsplat.{version()}.nupkg"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as package:
        for name, data in sorted(files.items()):
            package.writestr(zipfile.ZipInfo(name, DATE), data, zipfile.ZIP_DEFLATED)
    print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
