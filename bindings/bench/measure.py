#!/usr/bin/env python3
"""Build and run the programs of this folder, several times in turn, and print a Markdown table.

    bindings/bench/measure.py [--rounds N] [--work WORK] FOLDER

FOLDER is the folder of libsplat.so, of a release build; WORK keeps what is built. A language
whose tools are missing is left out with a sentence. Each cell has the shortest time of all rounds
and the median of their medians.
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Dict, List

HERE = Path(__file__).resolve().parent
BINDINGS = HERE.parent
COLUMNS = {"getter_ns": "getter, ns", "read_ms": "read of 4 MiB, ms",
           "render_ms": "render and read, ms"}


def scene_text() -> str:
    """An ASCII .ply file of 1000 Gaussians."""
    names = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3"
    lines = ["ply", "format ascii 1.0", "element vertex 1000"]
    lines += [f"property float {name}" for name in names.split()] + ["end_header"]
    for i in range(1000):
        place = [(i * step % 211 - 105) / 105 for step in (37, 61, 83)]
        color = [(i * step % 31 - 15) / 15 for step in (3, 5, 7)]
        lines.append(" ".join(map(str, [*place, *color, 2, -3, -3.5, -4, 1, 0.1, 0.2, 0.3])))
    return "\n".join(lines) + "\n"


def build(library: Path, folder: Path) -> Dict[str, List[str]]:
    """The commands of the languages whose tools are here."""
    commands = {}
    include = BINDINGS.parent / "include"
    subprocess.run(["cc", "-std=c11", "-O2", f"-I{include}", str(HERE / "bench.c"),
                    f"-L{library}", "-lsplat", "-o", str(folder / "bench")], check=True)
    commands["C"] = [str(folder / "bench")]
    python = "/usr/bin/python3" if Path("/usr/bin/python3").exists() else sys.executable
    if subprocess.run([python, "-c", "import numpy"], capture_output=True, check=False).returncode:
        print("Python is left out: install python3-numpy", file=sys.stderr)
    else:
        commands["Python"] = [python, str(HERE / "bench.py")]
    cargo = shutil.which("cargo", path=f"/usr/bin{os.pathsep}{os.environ['PATH']}")
    if cargo is None:
        print("Rust is left out: install rustc and cargo", file=sys.stderr)
    else:
        paths = f"{Path(cargo).parent}{os.pathsep}{os.environ['PATH']}"
        subprocess.run(["sh", BINDINGS / "rust/workspace.sh", folder / "crates"], check=True)
        subprocess.run([cargo, "build", "--release", "--offline", "--example", "bench"],
                       cwd=folder / "crates", check=True,
                       env={**os.environ, "PATH": paths, "CARGO_TARGET_DIR": str(folder / "rust")})
        commands["Rust"] = [str(folder / "rust" / "release" / "examples" / "bench")]
    if shutil.which("mcs") is None or shutil.which("mono") is None:
        print("C# is left out: install mono-mcs and mono-runtime", file=sys.stderr)
    else:
        subprocess.run(["sh", BINDINGS / "csharp" / "for_mcs.sh", folder / "csharp"], check=True)
        sources = [str(path) for path in sorted((folder / "csharp").glob("*.cs"))]
        subprocess.run(["mcs", "-langversion:latest", "-unsafe", "-optimize+", "-r:System.Numerics.dll",
                        f"-out:{folder / 'Bench.exe'}", str(HERE / "Bench.cs"), *sources],
                       check=True)
        commands["C#"] = ["mono", str(folder / "Bench.exe")]
    return commands


def row(runs: List[Dict[str, List[float]]]) -> List[str]:
    """The cells of a language."""
    cells = []
    for column in COLUMNS:
        digits = 0 if column.endswith("ns") else 2
        shortest = min(run[column][0] for run in runs)
        median = statistics.median(run[column][1] for run in runs)
        cells.append(f"{shortest:.{digits}f}, {median:.{digits}f}")
    return cells


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("folder", type=Path, help="of libsplat.so")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--work", type=Path)
    arguments = parser.parse_args()
    library = arguments.folder.resolve()
    if not (library / "libsplat.so").exists():
        sys.exit(f"measure: no libsplat.so in {library}; name the folder of a release build's")
    os.environ["SPLAT_LIB_DIR"] = os.environ["LD_LIBRARY_PATH"] = str(library)
    os.environ["SPLAT_LIBRARY"] = str(library / "libsplat.so")
    os.environ["PYTHONPATH"] = str(BINDINGS / "python" / "src")
    with tempfile.TemporaryDirectory() as name:
        folder = (arguments.work or Path(name)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        scene = folder / "scene.ply"
        scene.write_text(scene_text(), encoding="utf-8")
        commands = build(library, folder)
        runs: Dict[str, List[Dict[str, List[float]]]] = {language: [] for language in commands}
        for _ in range(arguments.rounds):
            for language, command in commands.items():
                line = subprocess.check_output([*command, str(scene)])
                print(line.decode().strip(), file=sys.stderr)
                runs[language].append(json.loads(line))
    print("| language | " + " | ".join(COLUMNS.values()) + " |\n|---|---|---|---|")
    for language, measured in runs.items():
        print(f"| {language} | " + " | ".join(row(measured)) + " |")


if __name__ == "__main__":
    main()
