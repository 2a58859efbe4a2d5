#!/usr/bin/env python3
"""Builds the wheel: the package, the library, the libraries it needs, and the built-in weights.

    python3 bindings/python/wheel_backend.py [--library FILE] [--out FOLDER]

The library is that of --library, of the variable SPLAT_LIBRARY, or the system's. It is also a build
backend: `python3 -m build --wheel --no-isolation` and `pip wheel .` call it. Needs no network, and of
programs only `ldd`. Two runs give the same bytes.
"""
import argparse
import base64
import ctypes
import hashlib
import os
import re
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path
from typing import Any, Dict, List, Optional

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SYSTEM = re.compile(r"^(linux-vdso|ld-linux|lib(c|m|dl|rt|pthread|gcc_s|stdc\+\+)\.so)")
SONAME = "libsplat.so.0"

METADATA = """Metadata-Version: 2.1
Name: libsplat
Version: {version}
Summary: Splatter Image with geometry priors on any Vulkan device
License: MIT
Requires-Python: >=3.9
Requires-Dist: numpy
Description-Content-Type: text/markdown

{readme}"""

WHEEL = """Wheel-Version: 1.0
Generator: libsplat
Root-Is-Purelib: false
Tag: {tag}
"""


class WheelError(Exception):
    """Why there is no wheel, and what to do."""


def library_file(named: Optional[str]) -> Path:
    """The file of the library: the given one, that of SPLAT_LIBRARY, or the system's."""
    given = named or os.environ.get("SPLAT_LIBRARY")
    if given:
        path = Path(given)
    else:
        listed = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True, text=True, check=False)
        found = re.search(rf"{SONAME} .* => (\S+)", listed.stdout)
        if found is None:
            raise WheelError("no library: name its file with --library or SPLAT_LIBRARY, such as "
                             "build/release/src/libsplat.so")
        path = Path(found.group(1))
    if not path.is_file():
        raise WheelError(f"there is no library {path}: build it, or name another file")
    return path.resolve()


def needed(library: Path) -> Dict[str, Path]:
    """The libraries that a library needs, without those of the system, by their SONAMEs."""
    listed = subprocess.run(["ldd", str(library)], capture_output=True, text=True, check=True)
    if "not found" in listed.stdout:
        raise WheelError(f"{library} needs libraries that are not installed:\n{listed.stdout}")
    pairs = re.findall(r"^\s*(\S+) => (\S+) \(", listed.stdout, re.MULTILINE)
    return {name: Path(path).resolve() for name, path in pairs if not SYSTEM.match(name)}


def in_order(libraries: Dict[str, Path]) -> List[str]:
    """SONAMEs, each behind those that it needs itself: `needed` lists them all, so it has more."""
    return sorted(libraries, key=lambda name: (len(needed(libraries[name])), name))


def weights_folder(library: Path) -> Path:
    """The folder of the built-in weights, as the library itself finds it."""
    loaded = ctypes.CDLL(str(library))
    buffer = ctypes.create_string_buffer(4096)
    if loaded.splat_builtin_weights(None, buffer, ctypes.c_size_t(4096), None) != 0:
        raise WheelError(f"{library} does not find its built-in weights: install it, or use that "
                         "of a build folder")
    return Path(os.fsdecode(buffer.value)).parent


def licences(libraries: Dict[str, Path]) -> Dict[str, bytes]:
    """The licence of each library's package, where the system's package manager knows it."""
    found = {}
    for path in libraries.values():
        try:
            owner = subprocess.run(["dpkg-query", "-S", f"*/{path.name}"], capture_output=True,
                                   text=True, check=False).stdout
        except FileNotFoundError:
            break
        package = owner.split(":")[0]
        text = Path("/usr/share/doc") / package / "copyright"
        if package and text.is_file():
            found[f"{package}.txt"] = text.read_bytes()
    return found


def contents(library: Path, version: str, tag: str) -> Dict[str, bytes]:
    """The files of the wheel."""
    source, info = HERE / "src" / "splat", f"libsplat-{version}.dist-info"
    files = {f"splat/{path.name}": path.read_bytes() for path in source.iterdir()
             if path.suffix == ".py" or path.name == "py.typed"}
    libraries = needed(library)
    order = in_order(libraries)
    files[f"splat/lib/{SONAME}"] = library.read_bytes()
    for name in order:
        files[f"splat/lib/{name}"] = libraries[name].read_bytes()
    files["splat/lib/needed.txt"] = "".join(f"{name}\n" for name in order).encode()
    weights = weights_folder(library).parent
    for path in weights.glob("*/*"):
        files[f"splat/share/libsplat/weights/{path.relative_to(weights)}"] = path.read_bytes()
    readme = (HERE / "README.md").read_text("utf-8")
    files[f"{info}/METADATA"] = METADATA.format(version=version, readme=readme).encode()
    files[f"{info}/WHEEL"] = WHEEL.format(tag=tag).encode()
    files[f"{info}/licenses/LICENSE"] = (ROOT / "LICENSE").read_bytes()
    for name, text in licences(libraries).items():
        files[f"{info}/licenses/{name}"] = text
    return files


def record(files: Dict[str, bytes], name: str) -> bytes:
    """The list of all files with their hashes."""
    lines = []
    for path, data in sorted(files.items()):
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        lines.append(f"{path},sha256={digest},{len(data)}\n")
    return "".join([*lines, f"{name},,\n"]).encode()


def version_of_sources() -> str:
    """The version of the declarations."""
    text = (HERE / "src" / "splat" / "_native.py").read_text("utf-8")
    found = re.search(r"^VERSION = \((\d+), (\d+), (\d+)\)$", text, re.MULTILINE)
    if found is None:
        raise WheelError("src/splat/_native.py has no version: write it with bindings/api/generate")
    return ".".join(found.groups())


def make_wheel(library: Optional[str], folder: Path) -> Path:
    """Write the wheel to a folder and return its path."""
    if not sys.platform.startswith("linux"):
        raise WheelError(f"wheels are made on Linux only, and this is {sys.platform}")
    version = version_of_sources()
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    tag = f"py3-none-{platform}"
    files = contents(library_file(library), version, tag)
    listed = f"libsplat-{version}.dist-info/RECORD"
    files[listed] = record(files, listed)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"libsplat-{version}-{tag}.whl"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files, key=lambda each: (".dist-info/" in each, each)):
            entry = zipfile.ZipInfo(name)  # dated 1980, as reproducible archives are
            entry.external_attr = (0o755 if ".so" in name else 0o644) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, files[name])
    return path


def build_wheel(wheel_directory: str, config_settings: Optional[Dict[str, Any]] = None,
                metadata_directory: Optional[str] = None) -> str:
    """The hook of build frontends; the library is that of SPLAT_LIBRARY or the system's."""
    return make_wheel(None, Path(wheel_directory)).name


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--library", help="file of the library")
    parser.add_argument("--out", type=Path, default=Path("dist"), help="folder of the wheel")
    arguments = parser.parse_args()
    try:
        print(make_wheel(arguments.library, arguments.out))
    except WheelError as error:
        print(f"wheel_backend: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
