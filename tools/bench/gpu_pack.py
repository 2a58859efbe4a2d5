"""What tools/bench/gpu carries to a machine where nothing can be installed."""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile

from gpu_parts import commit_of
from programs import listed_tests

MIB = 2.0**20
MOST = 64 * MIB  # bytes of the tree and the archive, on the machines that are lent
NAME = "libsplat-gpu"
PROGRAMS = ("tools/vkrun/vkrun", "tools/vkrun/vkrun-bench", "tests/vk/vk_test", "tests/ops/ops_test",
            "tests/ops/op_hashes", "tests/ops/op_replay", "tests/nn/nn_test", "tests/raster/raster_test",
            "tests/raster/raster_hashes", "tests/raster/radix_sort_bench")
# Families of golden files that ops_test reads.
OF_OPERATORS = ("conv", "metric", "net_rgb", "net_sh0", "norm", "train")
SOURCES = ("tools/bench/gpu", "tools/bench/*.py", "tools/bench/cub_sort.cu", "tools/weights/cars64/config.json",
           "tools/weights/cars64/cars64.yaml", "tests/golden/raster/*.xz",
           *(f"tests/golden/net/{family}.npz.xz" for family in OF_OPERATORS))
# The C library and the loader, which every machine has; a copy of them would not fit its kernel and its drivers.
OF_THE_SYSTEM = re.compile(r"(ld-linux.*|lib(c|m|dl|rt|pthread|resolv|util|nsl|anl|mvec))\.so[.0-9]*$")
# Modules in C that are loaded when they are first needed.
EXTENSIONS = ("pyexpat", "_elementtree")
RUN = """#!/bin/sh
# Runs tools/bench/gpu of this folder with its arguments.
here=$(cd "$(dirname "$0")" && pwd) || exit 1
DRIVER
newer='import sys; sys.exit(sys.version_info < (3, 9))'
if command -v python3 >/dev/null 2>&1 && python3 -c "$newer" 2>/dev/null; then
    exec python3 "$here/tools/bench/gpu" "$@"
fi
export LD_LIBRARY_PATH="$here/build/packed/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}" PYTHONHOME="$here/python"
exec "$here/python/bin/python3" "$here/tools/bench/gpu" "$@"
"""


def libraries_of(path):
    """What the loader finds for a program or a library, but not the C library's."""
    listed = subprocess.run(["ldd", path], stdout=subprocess.PIPE, text=True, check=False).stdout
    missing = re.findall(r"^\s*(\S+) => not found", listed, re.M)
    if missing:
        sys.exit(f"gpu: {path} needs {', '.join(missing)}, which this machine lacks")
    return {name: found for name, found in re.findall(r"^\s*(\S+) => (/\S+)", listed, re.M)
            if not OF_THE_SYSTEM.match(name)}


def loader_of_vulkan():
    listed = subprocess.run(["ldconfig", "-p"], stdout=subprocess.PIPE, text=True, check=False,
                            env=os.environ | {"PATH": os.environ.get("PATH", "") + ":/sbin:/usr/sbin"}).stdout
    found = re.search(r"libvulkan\.so\.1 \(libc6,[^)]*\) => (\S+)", listed)
    if not found:
        sys.exit("gpu: no libvulkan.so.1 on this machine: install the Vulkan loader (libvulkan1)")
    return found.group(1)


def software_driver(into):
    """lavapipe, its libraries and the file that names it to the loader."""
    for folder in ("/usr/share", "/usr/local/share", "/etc"):
        for file in sorted(pathlib.Path(folder, "vulkan/icd.d").glob("lvp_icd*.json")):
            described = json.loads(file.read_text(encoding="utf-8"))
            library = pathlib.Path(described["ICD"]["library_path"])
            add_library(into / "lib", library)
            described["ICD"]["library_path"] = "../lib/" + library.name
            (into / "icd.d").mkdir()
            (into / "icd.d/lvp_icd.json").write_text(json.dumps(described), encoding="utf-8")
            return
    sys.exit("gpu: no lavapipe on this machine: install mesa-vulkan-drivers, or leave --software away")


def stripped(found, target):
    target.parent.mkdir(parents=True, exist_ok=True)
    if not target.exists():
        subprocess.run(["strip", "--strip-unneeded", "-o", target, found], check=True)


def add_libraries_of(path, folder):
    for name, found in libraries_of(path).items():
        stripped(found, folder / name)


def add_library(folder, library):
    stripped(library, folder / library.name)
    add_libraries_of(library, folder)


def add_programs(root, build, into):
    (into / "lib").mkdir(parents=True)
    for program in PROGRAMS:
        if not (build / program).is_file():
            sys.exit(f"gpu: {build / program} is not there: build all of its preset (cmake --build), with tests")
        stripped(build / program, into / program)
        add_libraries_of(build / program, into / "lib")
    add_library(into / "lib", pathlib.Path(loader_of_vulkan()))
    packed = {path.name for path in (into / "tests").glob("*/*")}
    tests = [test for test in listed_tests(build) if pathlib.Path(test["program"]).name in packed
             and not test["name"].startswith("SecondGolden")]
    for test in tests:  # the settings of the validation layer, which is not carried
        test["environment"].pop("VK_LAYER_SETTINGS_PATH", None)
    (into / "commit").write_text(commit_of(root), encoding="utf-8")
    (into / "tests.json").write_text(json.dumps(tests, indent=1), encoding="utf-8")


def add_sources(root, into):
    for pattern in SOURCES:
        for path in root.glob(pattern):
            target = into / path.relative_to(root)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, target)


def add_python(into, libraries):
    """This interpreter with the modules that are loaded now, which are those of the measurement."""
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    program = pathlib.Path(sys.executable).resolve()
    stripped(program, into / "bin/python3")
    add_libraries_of(program, libraries)
    standard = pathlib.Path(os.__file__).parent
    files = {*(standard / "encodings").glob("*.py"), *(standard / "xml").rglob("*.py"),
             *(file for name in EXTENSIONS for file in standard.glob(f"lib-dynload/{name}.*")),
             *(pathlib.Path(module.__file__) for module in list(sys.modules.values())
               if getattr(module, "__file__", None))}
    for path in files:
        if standard not in path.parents:
            continue
        target = into / "lib" / version / path.relative_to(standard)
        if path.suffix == ".so":
            stripped(path, target)
            add_libraries_of(path, libraries)
        else:
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, target)


def bytes_below(path):
    return sum(file.stat().st_size for file in path.rglob("*") if file.is_file())


def tracked_bytes(root):
    if not shutil.which("git"):
        return 0
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=root, stdout=subprocess.PIPE, check=False).stdout
    return sum((root / os.fsdecode(name)).stat().st_size for name in listed.split(b"\0") if name)


def pack(root, options):
    build = options.vkrun.parents[2]
    if not shutil.which("strip") or not shutil.which("ldd"):
        sys.exit("gpu: --pack needs strip and ldd: install binutils and libc-bin")
    options.pack.mkdir(parents=True, exist_ok=True)
    archive = options.pack / f"{NAME}.tar.gz"
    with tempfile.TemporaryDirectory() as folder:
        top = pathlib.Path(folder) / NAME
        packed = top / "build/packed"
        add_programs(root, build, packed)
        add_sources(root, top)
        add_python(top / "python", packed / "lib")
        if options.software:
            software_driver(packed)
        line = 'export VK_ADD_DRIVER_FILES="$here/build/packed/icd.d/lvp_icd.json"  # after those of the machine\n'
        (top / "run").write_text(RUN.replace("DRIVER\n", line if options.software else ""), encoding="utf-8")
        (top / "run").chmod(0o755)
        rows = [("programs", bytes_below(packed / "tools") + bytes_below(packed / "tests")),
                ("libraries", bytes_below(packed / "lib")), ("Python", bytes_below(top / "python")),
                ("golden files", bytes_below(top / "tests")), ("scripts, configurations", bytes_below(top / "tools"))]
        whole = archive.with_suffix(".tmp")
        with tarfile.open(whole, "w:gz", compresslevel=9) as tar:
            tar.add(top, NAME)
        whole.replace(archive)
    rows += [("all, unpacked", sum(size for _, size in rows)), (archive.name, archive.stat().st_size),
             ("tracked files of the tree", tracked_bytes(root))]
    rows.append(("the tree and the archive together", rows[-1][1] + rows[-2][1]))
    width = max(len(name) for name, _ in rows)
    for name, size in rows:
        print(f"{name:<{width}}  {size / MIB:6.1f} MiB")
    if rows[-1][1] > MOST:
        print(f"gpu: warning: more than {MOST / MIB:.0f} MiB, which some machines do not take", file=sys.stderr)
