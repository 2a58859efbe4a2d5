"""Builds the wheel: the package, the library, what it needs, the built-in weights, and the licences of all.

    python3 bindings/python/wheel_backend.py [--build PRESET | --library FILE] [--out FOLDER]

The presets `release` and `windows-release` make the wheels of Linux and, from Linux, of Windows: configured,
built and packed by this one command. The library is else that of --library (.so or .dll), of the variable
SPLAT_LIBRARY, or the system's. It is also a build backend: `python3 -m build --wheel --no-isolation` and
`pip wheel .` call it. Two runs give the same bytes.

Of programs it needs `ldd` and `dpkg-query`, for Windows x86_64-w64-mingw32-objdump. Licences are the
copyright files of Debian's packages: without them there is no wheel.
"""
import argparse
import base64
import hashlib
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any, Dict, Iterable, List, Optional

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SYSTEM = re.compile(r"^(linux-vdso|ld-linux|lib(c|m|dl|rt|pthread|gcc_s|stdc\+\+)\.so)")
SYSTEM_DLLS = {"kernel32.dll", "msvcrt.dll", "advapi32.dll", "shell32.dll", "user32.dll"}
DOCUMENTS = Path("/usr/share/doc")

# The source package of each library that splat.dll may have inside; those of the compiler are in each of them.
STATIC = {"libgif.a": "giflib", "libjpeg.a": "libjpeg-turbo", "libpng.a": "libpng1.6", "libsharpyuv.a": "libwebp",
          "libwebp.a": "libwebp", "libwebpmux.a": "libwebp", "libyaml.a": "libyaml", "libz.a": "zlib",
          "libzstd.a": "libzstd"}
COMPILER = ("g++-mingw-w64-x86-64-posix", "mingw-w64-common")

# The first minor version of glibc whose distributions have libstdc++ with these symbols: PEP 600, as auditwheel
# knows it.
LIBSTDCXX = {0: 17, 28: 31, 29: 34, 30: 35, 33: 39}

LICENCES = "MIT AND BSD-3-Clause AND IJG AND libpng-2.0 AND Zlib"
LICENCES_WINDOWS = " AND ZPL-2.1 AND (GPL-3.0-or-later WITH GCC-exception-3.1)"
METADATA = """Metadata-Version: 2.4
Name: libsplat
Version: {version}
Summary: Splatter Image with geometry priors on any Vulkan device
License-Expression: {expression}
{files}Requires-Python: >=3.9
Requires-Dist: numpy>=1.24
Description-Content-Type: text/markdown

{readme}"""

WHEEL = """Wheel-Version: 1.0
Generator: libsplat
Root-Is-Purelib: false
Tag: {tag}
"""


class WheelError(Exception):
    """Why there is no wheel, and what to do."""


def run(*command: object) -> str:
    """What a program printed; it must succeed."""
    try:
        done = subprocess.run([str(each) for each in command], capture_output=True, text=True, check=False,
                              env={**os.environ, "LC_ALL": "C"})
    except FileNotFoundError:
        raise WheelError(f"there is no program {command[0]}") from None
    if done.returncode != 0:
        raise WheelError(f"{command[0]} failed: {done.stderr or done.stdout}")
    return done.stdout


def version_of_sources() -> str:
    """The version of the declarations."""
    text = (HERE / "src" / "libsplat" / "_native.py").read_text("utf-8")
    found = re.search(r"^VERSION = \((\d+), (\d+), (\d+)\)$", text, re.MULTILINE)
    if found is None:
        raise WheelError("src/libsplat/_native.py has no version: write it with bindings/api/generate")
    return ".".join(found.groups())


def built(preset: str) -> Path:
    """Configure and build the library of a preset, whose programs write to standard error."""
    windows = preset.startswith("windows")
    commands = [f"cmake --preset {preset}", f"cmake --build build/{preset} --target splat"]
    if windows:
        commands.insert(0, "sh tools/windows/libraries build/windows-libraries")
    for command in commands:
        try:
            subprocess.run(command.split(), cwd=ROOT, check=True, stdout=sys.stderr)
        except (OSError, subprocess.CalledProcessError) as error:
            raise WheelError(str(error)) from None
    return ROOT / "build" / preset / "src" / ("splat.dll" if windows else "libsplat.so")


def library_file(named: Optional[str]) -> Path:
    """The file of the library: the given one, that of SPLAT_LIBRARY, or the system's."""
    given = named or os.environ.get("SPLAT_LIBRARY")
    if given:
        path = Path(given)
    else:
        found = re.search(r"libsplat\.so\.\S+ .* => (\S+)", run("/sbin/ldconfig", "-p"))
        if found is None:
            raise WheelError("no library: name its file with --library or SPLAT_LIBRARY, such as "
                             "build/release/src/libsplat.so")
        path = Path(found.group(1))
    if not path.is_file():
        raise WheelError(f"there is no library {path}: build it, or name another file")
    path, version = path.resolve(), version_of_sources()
    if f"\0{version}\0".encode() not in path.read_bytes():
        raise WheelError(f"{path} is not libsplat {version}, the version of this package: build it, or name another")
    return path


def needed(library: Path) -> Dict[str, Path]:
    """The libraries that a library needs, without those of the system, by their SONAMEs."""
    listed = run("ldd", library)
    if "not found" in listed:
        raise WheelError(f"{library} needs libraries that are not installed:\n{listed}")
    pairs = re.findall(r"^\s*(\S+) => (\S+) \(", listed, re.MULTILINE)
    return {name: Path(path).resolve() for name, path in pairs if not SYSTEM.match(name)}


def in_order(libraries: Dict[str, Path]) -> List[str]:
    """SONAMEs, each behind those that it needs itself: `needed` lists them all, so it has more."""
    return sorted(libraries, key=lambda name: (len(needed(libraries[name])), name))


def weights_folder(library: Path) -> Path:
    """The folder of the built-in weights, as the library itself finds it."""
    for folder in library.parents:
        for place in (folder / "share/libsplat/weights", folder / "tools/weights"):
            if (place / "cars64").is_dir():
                without = [each.name for each in place.iterdir()
                           if each.is_dir() and not (each / "weights.safetensors").is_file()]
                if without:
                    raise WheelError(f"{place} has no weights of {without[0]}: build the target splat")
                return place
    raise WheelError(f"{library} does not find its built-in weights: install it, or use that of a build folder")


def licence(name: str, text: Path) -> "tuple[str, bytes]":
    """A file of the folder of licences."""
    if not text.is_file():
        raise WheelError(f"the licence of {name} is unknown, as there is no {text}: install its package of Debian")
    return f"{name}.txt", text.read_bytes()


def licences(libraries: Dict[str, Path]) -> Dict[str, bytes]:
    """The licences of shared libraries, each that of its package of Debian."""
    found: Dict[str, bytes] = {}
    for path in libraries.values():
        package = run("dpkg-query", "-S", f"*/{path.name}").split(":")[0]
        found.update([licence(package, DOCUMENTS / package / "copyright")])
    return found


def static_licences(library: Path) -> Dict[str, bytes]:
    """The licences of what a splat.dll has inside, by the build that made it."""
    rules = library.parent.parent / "build.ninja"
    linked = re.search(r"^build src/splat\.dll .*\n(?: .*\n)*?  LINK_LIBRARIES = (.*)",
                       rules.read_text("utf-8") if rules.is_file() else "", re.MULTILINE)
    if linked is None:
        raise WheelError(f"what {library} has inside is unknown: {rules}, which made it, does not say so")
    found = dict(licence(name, DOCUMENTS / name / "copyright") for name in COMPILER)
    for path in map(Path, re.findall(r"(?<!\S)/\S+\.a\b", linked.group(1))):
        if path.name not in STATIC:
            raise WheelError(f"{library} has {path} inside, whose licence is unknown: add its source package to STATIC")
        source = path.parents[2] / "source" / STATIC[path.name]  # tools/windows/libraries puts it there
        found.update([licence(source.name, source / "debian/copyright")])
    return found


def refuse_other_dlls(library: Path) -> None:
    """Refuse a splat.dll that needs what a Windows does not have."""
    names = re.findall(r"DLL Name: (\S+)", run("x86_64-w64-mingw32-objdump", "-p", library))
    others = sorted(name for name in names if name.lower() not in SYSTEM_DLLS)
    if others or not names:
        raise WheelError(f"{library} needs {', '.join(others) or 'no library at all'}, expected Windows' own only: "
                         "build the preset windows-release")


def platform_tag(files: Iterable[bytes]) -> str:
    """The wheel's platform on Linux: the oldest glibc whose systems have all that these libraries use."""
    minor, latest = 17, 0
    for data in files:
        minor = max([minor, *map(int, re.findall(rb"\0GLIBC_2\.(\d+)(?=[.\0])", data))])
        latest = max([latest, *map(int, re.findall(rb"\0GLIBCXX_3\.4\.(\d+)(?=\0)", data))])
    fits = [least for part, least in LIBSTDCXX.items() if part >= latest]
    if not fits:
        raise WheelError(f"no known system has GLIBCXX_3.4.{latest}: add it to LIBSTDCXX")
    return f"manylinux_2_{max(minor, fits[0])}_{os.uname().machine}"


def libraries_for(library: Path) -> Dict[str, bytes]:
    """The wheel's folder of libraries."""
    if library.suffix == ".dll":
        refuse_other_dlls(library)
        return {library.name: library.read_bytes()}
    found = needed(library)
    order = in_order(found)
    files = {"libsplat.so": library.read_bytes(), "needed.txt": "".join(f"{name}\n" for name in order).encode()}
    files.update((name, found[name].read_bytes()) for name in order)
    return files


def contents(library: Path, version: str) -> "tuple[str, Dict[str, bytes]]":
    """The tag of the wheel, and its files."""
    windows, info = library.suffix == ".dll", f"libsplat-{version}.dist-info"
    files = {f"libsplat/{path.name}": path.read_bytes() for path in (HERE / "src" / "libsplat").iterdir()
             if path.suffix == ".py" or path.name == "py.typed"}
    own = libraries_for(library)
    files.update((f"libsplat/lib/{name}", data) for name, data in own.items())
    weights = weights_folder(library)
    for path in weights.glob("*/*"):
        if path.suffix != ".difference":
            files[f"libsplat/share/libsplat/weights/{path.relative_to(weights)}"] = path.read_bytes()
    texts = {name: (ROOT / name).read_bytes() for name in ("LICENSE", "THIRD-PARTY.md")}
    texts.update(static_licences(library) if windows else licences(needed(library)))
    files.update((f"{info}/licenses/{name}", data) for name, data in texts.items())
    tag = "py3-none-" + ("win_amd64" if windows else platform_tag(own.values()))
    files[f"{info}/WHEEL"] = WHEEL.format(tag=tag).encode()
    files[f"{info}/METADATA"] = METADATA.format(
        version=version, readme=(HERE / "README.md").read_text("utf-8"),
        expression=LICENCES + (LICENCES_WINDOWS if windows else ""),
        files="".join(f"License-File: {name}\n" for name in sorted(texts))).encode()
    return tag, files


def record(files: Dict[str, bytes], name: str) -> bytes:
    """The list of all files with their hashes."""
    lines = []
    for path, data in sorted(files.items()):
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        lines.append(f"{path},sha256={digest},{len(data)}\n")
    return "".join([*lines, f"{name},,\n"]).encode()


def make_wheel(library: Optional[str], folder: Path) -> Path:
    """Write the wheel to a folder and return its path."""
    if not sys.platform.startswith("linux"):
        raise WheelError(f"wheels are made on Linux only, and this is {sys.platform}")
    version = version_of_sources()
    tag, files = contents(library_file(library), version)
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
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    made = parser.add_mutually_exclusive_group()
    made.add_argument("--build", metavar="PRESET", help="build the library first: release or windows-release")
    made.add_argument("--library", help="file of the library: .so, or .dll for Windows")
    parser.add_argument("--out", type=Path, default=Path("dist"), help="folder of the wheel")
    arguments = parser.parse_args()
    try:
        library = str(built(arguments.build)) if arguments.build else arguments.library
        print(make_wheel(library, arguments.out))
    except WheelError as error:
        print(f"wheel_backend: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
