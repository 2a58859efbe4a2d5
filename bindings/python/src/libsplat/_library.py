"""Finds, loads and checks the library.

Looked for in this order: the file that SPLAT_LIBRARY names, the folder `lib` of this package (where
wheels have it), and the system's loader.
"""
import ctypes
import json
import os
import sys
from pathlib import Path
from typing import List, Optional, Tuple

from . import _native

FOLDER = Path(__file__).resolve().parent / "lib"
REMEDY = ("install the package and the library of one release, or let SPLAT_LIBRARY name the file of "
          "a library that fits")


def _names() -> Tuple[str, str]:
    """The name of the library in the wheel, and the system's, which has the version that must fit."""
    if sys.platform == "win32":
        return "splat.dll", "splat.dll"
    if sys.platform == "darwin":
        return "libsplat.dylib", "libsplat.dylib"
    major, minor, _ = _native.VERSION
    return "libsplat.so", f"libsplat.so.{major}" if major else f"libsplat.so.0.{minor}"


def _load_needed() -> List[ctypes.CDLL]:
    """Load the libraries of the wheel that libsplat needs, so that the loader finds them by name.

    `needed.txt` lists them, each behind those that it needs itself.
    """
    listed = FOLDER / "needed.txt"
    names = listed.read_text("utf-8").split() if listed.is_file() else []
    return [ctypes.CDLL(str(FOLDER / name)) for name in names]


def _whole(name: str, folders: List[str]) -> str:
    """The path of a file in one of `folders`, of which "" is the current one; the name if it is in none.

    For Windows, whose loader Python lets seek in none of them, and which finds what a library needs
    beside a whole path only.
    """
    places = [Path(folder) for folder in folders]
    return next((str((place / name).absolute()) for place in places if (place / name).is_file()), name)


def _open() -> Tuple[ctypes.CDLL, str]:
    """The library, and where it was found."""
    named = os.environ.get("SPLAT_LIBRARY")
    bundled, system = _names()
    own = FOLDER / bundled
    path = named or (str(own) if own.is_file() else system)
    if sys.platform == "win32":
        listed = [folder for folder in os.environ.get("PATH", "").split(os.pathsep) if folder]
        path = _whole(path, [""] if named else listed)
    try:
        if not named and own.is_file():
            _load_needed()
        return ctypes.CDLL(path), path
    except OSError as error:
        place = "as SPLAT_LIBRARY says" if named else f"of the package or the system ({path})"
        raise ImportError(f"libsplat cannot load the library {place}: {error}; install libsplat, or let "
                          "SPLAT_LIBRARY name its file") from error


def mismatch(version: int, sizes: "dict[str, int]") -> Optional[str]:
    """Why a library does not fit these declarations; None if it does.

    version  as splat_version gives it
    sizes    bytes of each struct, as splat_build_info gives them
    """
    found = (version >> 22, version >> 12 & 0x3FF)
    if found != _native.VERSION[:2]:
        return "before 1.0 only the same minor version fits"
    for name, (_, frozen, size, _) in _native.LAYOUT.items():
        there = sizes.get(name)
        if there is None:
            return f"the library has no struct {name}"
        if there < size or (frozen and there != size):
            return f"{name} has {there} bytes in the library and {size} in the package"
    return None


def _version_text(version: int) -> str:
    return f"{version >> 22}.{version >> 12 & 0x3FF}.{version & 0xFFF}"


def _load() -> Tuple[ctypes.CDLL, str]:
    library, path = _open()
    try:
        library.splat_version.restype = ctypes.c_uint32
        library.splat_build_info.restype = ctypes.c_char_p
        version = int(library.splat_version())
        sizes = json.loads(library.splat_build_info()).get("structs", {})
        reason = mismatch(version, sizes)
        if reason is None:
            _native.bind(library)
            return library, path
    except AttributeError as error:
        version, reason = 0, f"it lacks a function: {error}"
    package = ".".join(str(part) for part in _native.VERSION)
    raise ImportError(f"libsplat {package} does not fit the library {path}, version "
                      f"{_version_text(version) if version else 'unknown'}: {reason}; {REMEDY}")


lib, path = _load()
