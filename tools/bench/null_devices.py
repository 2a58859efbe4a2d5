"""Part of tools/bench/devices --null: what compilers of drivers say of libsplat's pipelines, without their devices.

Pipelines in use are recorded from real runs: `vkrun -v` tells each that it makes. A module that no run used is compiled
with its default constants. The table has a row for each module that spills, uses scratch or does not compile on one
of the devices, and a total of the others; the JSON files have every number.
"""

import json
import pathlib
import platform
import re
import sys
import tempfile

from programs import last_line, run

RADEON = "/usr/share/vulkan/icd.d/radeon_icd.x86_64.json"
FAMILIES = {"GCN (Polaris 10)": "polaris10", "Vega 10": "vega10", "RDNA1 (Navi 10)": "navi10",
            "RDNA2 (Navi 21)": "navi21"}
# With --root, whose Mesa has RDNA4 and drm-shims: the driver, the shim, and the variable that selects a model.
MODELS = {"RDNA2 (Navi 21)": ("radeon", "amdgpu", "AMDGPU_GPU_ID", "navi21"),
          "RDNA3 (Navi 31)": ("radeon", "amdgpu", "AMDGPU_GPU_ID", "navi31"),
          "RDNA4 (Navi 48)": ("radeon", "amdgpu", "AMDGPU_GPU_ID", "gfx1201"),
          "NVIDIA Turing": ("nouveau", "nouveau", "NOUVEAU_CHIPSET", "162"),
          "Adreno-630": ("freedreno", "freedreno", "FD_GPU_ID", "630"),
          "Adreno-750": ("freedreno", "freedreno", "FD_GPU_ID", "750"),
          "Apple-M1": ("asahi", "asahi", "ASAHI_MODEL", ""),
          "Mali-G610": ("panfrost", "panfrost", "PAN_GPU_ID", "a867"),
          "V3D-7.1": ("broadcom", "v3d", "V3D_GPU_ID", "71"),
          "Intel Gen9": ("intel", "intel", "INTEL_STUB_GPU_PLATFORM", "skl"),
          "Intel Xe2": ("intel", "intel", "INTEL_STUB_GPU_PLATFORM", "lnl")}
COMPILE_SECONDS = 1200  # for all pipelines of a device; emulated processors are slow
TOLD = re.compile(r"debug: pipeline (\w+)((?: \d+=\d+)*)$", re.M)
# Names of a figure in drivers, those of Mesa by its shader_stats.xml.
FIGURES = {"registers": r"VGPRs|Registers used|Registers|GPRs|Number of GPRs|Max live registers",
           "spilled": r"Spilled VGPRs|Spill Count|Spills|TMU Spills|Spills to Memory|STP Count",
           "scratch": r"Scratch size|Scratch Memory Size|Scratch|SLM Size|Spill Size",
           "shared": r"LDS size|Workgroup Memory Size"}


def runs(folder):
    """Command lines of vkrun: a prediction, training, rendering and a fit, all small."""
    data = ["--data", folder / "data"]
    return [["data", "synth", *data[1:], "--objects", 2, "--test", 1, "--size", 64, "--seed", 1],
            ["predict", *data, "--views", 2, "--out", folder / "predicted"],
            ["train", "small", *data, "--out", folder / "run", "--set", "opt.iterations=1", "--set",
             "opt.batch_size=1", "--set", "opt.lambda_ssim=0.2"],
            ["render", folder / "predicted/scene.ply", "--orbit", 6, "--size", "128x128", "--out", folder / "photos"],
            ["fit", folder / "photos", "--out", folder / "fit", "--steps", 10, "--max-gaussians", 500, "--refine",
             "poses,exposure"]]


def record(options):
    """The lines "set module constants" of all runs."""
    found = []
    for kernels in ("gpu", "plain"):
        with tempfile.TemporaryDirectory() as folder:
            # The network of the published weights as well; with plain kernels it would take minutes.
            published = [["bench", "model", "--backward", "--rounds", 1]] if kernels == "gpu" else []
            for command in runs(pathlib.Path(folder)) + published:
                status, _, errors = run([options.vkrun, "-v", *command],
                                        options.environment | {"SPLAT_KERNELS": kernels, "SPLAT_VALIDATION": "0",
                                                               "XDG_CACHE_HOME": folder})  # self-tests run, too
                if status != 0:
                    sys.exit(f"devices: vkrun {command[0]} failed: {last_line(errors)}")
                found += [f"{kernels} {name}{constants}" for name, constants in TOLD.findall(errors)]
    if not found:
        sys.exit("devices: vkrun -v tells no pipelines")
    return list(dict.fromkeys(found))


def pipelines(options):
    """{"module constants": set} of what is compiled; set "" for defaults of modules that no run used."""
    path = options.out / "pipelines.txt"
    if not path.exists():
        path.write_text("\n".join(record(options)) + "\n")
    built = {file.stem for file in (options.build / "shaders").glob("*.spv")}
    found = {}
    for line in path.read_text().splitlines():
        kernels, pipeline = line.split(" ", 1)
        if pipeline.split()[0] in built:  # a recorded one may be gone since
            found.setdefault(pipeline, kernels)
    unused = built - {pipeline.split()[0] for pipeline in found}
    return {name: kernels for name, kernels in (found | {name: "" for name in sorted(unused)}).items()
            if not name.split()[0].endswith("_cpu")}


def compile_all(options, environment, wanted, python):
    """{device, driver, pipelines: {pipeline: statistics, None where it did not compile}}; without a device, why."""
    row, left = None, list(wanted)
    program = [*python, pathlib.Path(__file__).parent / "pipeline_statistics.py"]
    while left:
        lines = "".join(f"{options.build}/shaders/{one.replace(' ', '.spv ', 1) if ' ' in one else one + '.spv'}\n"
                        for one in left)
        status, output, errors = run(program, environment | {"MESA_SHADER_CACHE_DISABLE": "true"}, COMPILE_SECONDS,
                                     given=lines)
        told = [json.loads(line) for line in output.splitlines() if line.startswith("{") and line.endswith("}")]
        if not told:
            return row or last_line(errors)
        row = row or {**told[0], "pipelines": {}}
        results = [one for one in told if "vulkan" in one]
        for pipeline, result in zip(left, results):
            row["pipelines"][pipeline] = result["statistics"] if result["vulkan"] == 0 else None
        started = len([one for one in told if "start" in one])
        if status == 124:  # too slow: what is there is all
            return row
        if started > len(results):  # the compiler ended the process
            row["pipelines"][left[len(results)]] = None
        if started == 0:
            return row
        left = left[started:]
    return row


def targets(options):
    """(name, environment, Python) of each driver: of the command line; in a root, of MODELS; else of FAMILIES."""
    unlocked = {f"{name}_I_WANT_A_BROKEN_VULKAN_DRIVER": "1" for name in ("NVK", "PAN")}
    if options.icd:
        named = [(icd.rpartition("=")[0] or pathlib.Path(icd).stem, icd.rpartition("=")[2]) for icd in options.icd]
        return [(name, {"VK_DRIVER_FILES": icd, "VK_ICD_FILENAMES": icd} | unlocked, [sys.executable])
                for name, icd in named]
    if not options.root:
        return [(name, {"VK_DRIVER_FILES": RADEON, "VK_ICD_FILENAMES": RADEON, "RADV_FORCE_FAMILY": family},
                 [sys.executable]) for name, family in FAMILIES.items()]
    found = []
    root = options.root.resolve()
    libraries = next((root / "usr/lib").glob("*-linux-gnu"))
    machine = libraries.name.split("-")[0]
    emulator = [] if machine == platform.machine() else [f"qemu-{machine}-static"]
    for name, (driver, shim, variable, model) in MODELS.items():
        icd = root / f"usr/share/vulkan/icd.d/{driver}_icd.json"
        library = libraries / f"lib{shim}_noop_drm_shim.so"
        if not icd.exists() or not library.exists() or (options.model and name not in options.model):
            continue
        loader = [*emulator, next(libraries.glob("ld-linux*.so.*")), "--library-path", libraries, "--preload", library]
        found.append((name, {"VK_DRIVER_FILES": str(icd), "VK_ICD_FILENAMES": str(icd), variable: model,
                             "PYTHONHOME": str(root / "usr")} | unlocked, [*loader, root / "usr/bin/python3"]))
    return found


def measure(options):
    """Writes DIR/null/NAME.json for each driver; returns all rows that are there."""
    options.out /= "null"
    options.out.mkdir(parents=True, exist_ok=True)
    wanted = pipelines(options)
    for name, environment, python in targets(options):
        row = compile_all(options, options.environment | environment, wanted, python)
        if not isinstance(row, dict):
            print(f"devices: {name} is left out: {row}", file=sys.stderr)
            continue
        known = MODELS if options.root else FAMILIES
        order = (100 if options.root else 0) + list(known).index(name) if name in known else 200
        row |= {"name": name, "order": order, "sets": wanted}
        (options.out / f"{name}{' in root' if options.root else ''}.json").write_text(json.dumps(row, indent=1))
    return [json.loads(path.read_text()) for path in sorted(options.out.glob("*.json"))]


def figures(statistics):
    """The numbers of FIGURES, None where the driver does not tell one."""
    found = {}
    for name, pattern in FIGURES.items():
        values = [value for key, value in statistics.items() if re.fullmatch(pattern, key, re.I)]
        found[name] = sum(values) if values else None
    return found


def cell(each):
    """The worst of some pipelines on a device: registers, and what spills."""
    if any(one is None for one in each):
        return "**does not compile**"
    worst = max(map(figures, each), key=lambda f: [f[name] or 0 for name in ("scratch", "spilled", "registers")])
    text = str(worst["registers"]) if worst["registers"] is not None else "?"
    if worst["spilled"]:
        text += f", **{worst['spilled']}** spilled"
    if worst["scratch"]:
        text += f", **{worst['scratch'] / 1024:.3g} KiB**"
    return text


def spills(statistics):
    return statistics is None or any(figures(statistics)[name] for name in ("spilled", "scratch"))


def table(rows):
    rows = sorted(rows, key=lambda row: (row["order"], row["name"]))
    sets = {pipeline: kernels for row in rows for pipeline, kernels in row["sets"].items()}
    modules = {}
    for pipeline in sets:
        modules.setdefault(pipeline.split()[0], []).append(pipeline)

    def of(row, names):
        return [row["pipelines"][name] for name in names if name in row["pipelines"]]

    def shared(names):
        told = [figures(one)["shared"] for row in rows for one in of(row, names) if one]
        return f"{max((one for one in told if one is not None), default=0) / 1024:.3g}"

    names = [row["name"] if row["device"].startswith("Null") or row["name"] in MODELS
             else f"{row['name']}: {row['device']}" for row in rows]
    text = ["| module | run by | specialisations that spill | shared, KiB | "
            + " | ".join(f"{name}, {row['driver']}" for name, row in zip(names, rows)) + " |",
            "|" + "---|" * (4 + len(rows))]
    calm = []
    for module, names in sorted(modules.items()):
        bad = [name for name in names if any(spills(one) for row in rows for one in of(row, [name]))]
        if not bad:
            calm += names
            continue
        by = ", ".join(sorted({sets[name] for name in bad} - {""})) or "no run: defaults"
        text.append(f"| {module} | {by} | {len(bad)} of {len(names)} | {shared(bad)} | "
                    + " | ".join(cell(of(row, bad)) if of(row, bad) else "" for row in rows) + " |")
    text.append(f"| other modules ({len({name.split()[0] for name in calm})}), the most | | 0 of {len(calm)} | "
                f"{shared(calm)} | "
                + " | ".join(str(max((figures(one)["registers"] or 0 for one in of(row, calm)), default=""))
                             for row in rows) + " |")
    return "\n".join(text)
