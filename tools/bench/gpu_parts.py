"""The parts of tools/bench/gpu. Each takes a Bench and returns its figures; a row that could not be measured has
"problem" instead of figures. Part `peers` is in gpu_peers.py."""

import fcntl
import json
import os
import pathlib
import re
import statistics
import sys
import tempfile
import time

from gpu_peers import NETWORKS, peers
from programs import PROGRAMS, hash_lines, last_line, listed_tests, run, test_outcome

KERNELS = ("plain", "cpu", "gpu")
OBJECTS = (1, 4, 16)
LEAST = 3  # seconds of a part, while there are as many


class Bench:
    """Where things are, the time that is left, and the document that the parts fill."""

    def __init__(self, root, options):
        self.root, self.options, self.vkrun = root, options, options.vkrun
        self.build = options.vkrun.parents[2]
        self.out = options.out
        self.end = time.monotonic() + options.seconds
        self.deadline, self.was_cut = self.end, False
        self.pythons = {}  # by the module they have
        libraries = str(self.build / "lib")  # libraries of a packed build, for its programs alone
        given = os.environ.get("LD_LIBRARY_PATH", "").split(":")
        self.plain = {key: value for key, value in os.environ.items() if key not in ("PYTHONHOME", "LD_LIBRARY_PATH")}
        self.plain |= {"LD_LIBRARY_PATH": ":".join(one for one in given if one and one != libraries)}
        self.environment = self.plain | {"SPLAT_VALIDATION": "0", "SPLAT_TEST_VALIDATION": "0", "NODEVICE_SELECT": "1"}
        if os.path.isdir(libraries):
            self.environment["LD_LIBRARY_PATH"] = libraries
            self.environment["SPLAT_GOLDEN_DIR"] = str(root / "tests/golden")
        self.open_folder()
        self.open_device()

    def open_folder(self):
        """What the folder holds; no other run may write to it."""
        self.path = self.out / "gpu.json"
        try:
            self.out.mkdir(parents=True, exist_ok=True)
            self.lock = open(self.out / "gpu.lock", "w", encoding="utf-8")
        except OSError as problem:
            sys.exit(f"gpu: cannot write to {self.out}: {problem.strerror}")
        try:
            fcntl.flock(self.lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            sys.exit(f"gpu: another run writes to {self.out}: wait for it, or name another folder with --out")
        self.document = {"parts": {}}
        if not self.path.exists():
            return
        try:
            self.document = json.loads(self.path.read_text(encoding="utf-8"))
            good = (all(isinstance(part, dict) for part in self.document["parts"].values())
                    and all(self.document["device"][key] for key in ("name", "driver", "uuid")))
        except (OSError, ValueError, TypeError, KeyError, AttributeError):
            good = False
        if not good:
            sys.exit(f"gpu: {self.path} is damaged: move it away, or name another folder with --out")

    def open_device(self):
        status, output, errors = run([self.vkrun, "devices", "--json"], self.environment, min(60, self.options.seconds))
        try:
            listed = json.loads(output)
            found = [one for one in listed["devices"] if one["default"]]
        except (ValueError, KeyError, TypeError):
            found = []
        if status != 0 or not found:
            why = "vkrun did not answer" if status == 124 else last_line(errors)
            sys.exit(f"gpu: no usable device: {why}; `vkrun doctor` says more")
        self.device, self.code = found[0], f"libsplat {listed['library']}{self.commit()}"
        self.is_cpu = self.device["kind"] == "cpu"
        who = [f"{one['name']} with driver {one['driver']}, UUID {one['uuid']}"
               for one in (self.document.get("device", self.device), self.device)]
        if who[0] != who[1]:
            sys.exit(f"gpu: {self.path} has the figures of {who[0]}; this device is {who[1]}: name another folder with "
                     "--out")
        self.document = {"device": self.device} | self.document

    def commit(self):
        """Return the commit of a packed build, or of the sources."""
        packed = self.build / "commit"
        if packed.exists():
            return packed.read_text(encoding="utf-8")
        return commit_of(self.root)

    def left(self):
        return max(self.deadline - time.monotonic(), 0)

    def call(self, *command, most=1e9, given=None, **environment):
        """Status, output and errors of a command that ends with the part at the latest, or None for the status
        without time for it."""
        return self.run_for(most, command, self.environment | environment, given)

    def run_for(self, most, command, environment, given=None):
        seconds = min(self.left(), most)
        if seconds < 1:
            self.was_cut = True
            return None, "", "no time was left"
        status, output, errors = run(command, environment, seconds, given)
        self.was_cut = self.was_cut or status == 124
        return status, output, errors

    def config(self, path):
        """The options for a network of NETWORKS."""
        return ["--config", self.root / path] if path else []

    def python(self, module):
        """An interpreter that has a module: the given one, or else this one or the system's, or None."""
        if module not in self.pythons:
            given = self.options.python
            able = [program for program in ([given] if given else [sys.executable, "/usr/bin/python3"])
                    if run([program, "-c", "import " + module], self.plain, 60)[0] == 0]
            self.pythons[module] = able[0] if able else None
        return self.pythons[module]

    def script(self, module, name, *words, most=1e9, **environment):
        """Do call() with a script beside this one that needs a module of Python."""
        program = self.python(module)
        if program is None:
            return 1, "", f"no {module} for Python here: --python PROGRAM names an interpreter that has it"
        return self.run_for(most, [program, self.root / "tools/bench" / name, *words], self.plain | environment)

    def json(self, *command, most=1e9, statuses=(0,), **environment):
        """The JSON that a command of vkrun prints, or {"problem": ...}."""
        return answer(*self.call(self.vkrun, *command, "--json", most=most, **environment), statuses)

    def run_parts(self):
        names = self.options.only or list(PARTS)
        for i, name in enumerate(names):
            shares = [self.share(later) for later in names[i:]]
            begin = time.monotonic()
            left = max(self.end - begin, 0)
            self.deadline = begin + max(left * shares[0] / sum(shares), min(left, LEAST))
            self.was_cut = False
            figures = {"code": self.code, "begun": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())}
            try:
                self.document["parts"][name] = figures
                PARTS[name][0](self, figures)
                figures["status"] = "cut off by its deadline" if self.was_cut or self.left() == 0 else "done"
            except Exception as problem:  # the other parts go on
                figures["status"] = f"failed: {type(problem).__name__}: {problem}"
            figures["seconds"] = round(time.monotonic() - begin, 1)
            figures["share"] = round(self.deadline - begin, 1)
            self.save()
            yield name, figures

    def share(self, name):
        """gsplat may have to be built."""
        return PARTS[name][1] + (60 if name == "peers" and self.options.gsplat else 0)

    def save(self):
        parts = self.document["parts"]
        self.document["parts"] = {name: parts[name] for name in PARTS if name in parts}
        whole = self.path.with_suffix(".tmp")
        whole.write_text(json.dumps(self.document, indent=1), encoding="utf-8")
        whole.replace(self.path)


def commit_of(root):
    """The commit of the sources, and "changed" if they have other contents. Empty without git."""
    said = [run(["git", "-C", root, *words], os.environ, 20) for words in (["rev-parse", "--short", "HEAD"],
                                                                         ["status", "--porcelain"])]
    if said[0][0] != 0:
        return ""
    return f", commit {said[0][1].strip()}{' changed' if said[1][1].strip() else ''}"


def answer(status, output, errors, statuses=(0,)):
    if status == 124:
        return {"problem": "cut off at the deadline"}
    if status not in statuses:
        return {"problem": last_line(errors) if status is None else f"status {status}: {last_line(errors)}"}
    try:
        return json.loads(output)
    except ValueError:
        return {"problem": "its output is no JSON"}


def without_device(found):
    return {key: value for key, value in found.items() if key not in ("device", "library")}


def device(bench, figures):
    figures["driver"] = {key: bench.device[key] for key in ("name", "kind", "driver", "vulkan", "features", "kernels",
                                                            "subgroup_size", "shared_memory_bytes", "heap_bytes",
                                                            "max_storage_buffer_bytes")}
    figures["vulkan"] = without_device(bench.json("bench", "dispatch", "--describe"))
    fields = "name,driver_version,clocks.sm,clocks.max.sm,clocks.mem,clocks.max.mem,power.limit,temperature.gpu"
    status, output, _ = run(["nvidia-smi", "--query-gpu=" + fields, "--format=csv,noheader"], bench.plain, 20)
    for line in output.splitlines() if status == 0 else []:
        values = dict(zip(fields.split(","), (word.strip() for word in line.split(","))))
        if values["name"] == bench.device["name"]:
            figures["clocks"] = values
    figures["kernels"] = {}
    for kernels in KERNELS:
        status, _, errors = bench.call(bench.vkrun, "bench", "dispatch", "--describe", "--json", SPLAT_KERNELS=kernels,
                                       most=30)
        figures["kernels"][kernels] = "run" if status == 0 else last_line(errors)


def dispatch(bench, figures):
    figures.update(without_device(bench.json("bench", "dispatch")))


def checks(bench, figures):
    figures["self_test"], figures["tests"] = {}, {}
    for kernels in KERNELS:
        status, output, errors = bench.call(bench.vkrun, "doctor", SPLAT_KERNELS=kernels, most=bench.left() / 4)
        wrong = [line.strip() for line in (output + errors).splitlines() if "computes wrongly" in line]
        figures["self_test"][kernels] = ("passed" if status == 0 and not wrong else
                                         "; ".join(wrong) or answer(status, "", errors)["problem"])
    figures["hashes"] = {}
    for kind in ("ops", "raster"):
        twice = [hash_lines(bench.build, kind, bench.environment, max(bench.left() / 4, 1)) for _ in range(2)]
        figures["hashes"][kind] = ({"lines": len(twice[0]), "equal": twice[0] == twice[1], "values": twice[0]}
                                   if twice[0] and twice[1] else {"problem": "the program failed or was cut off"})
    stress = bench.json("stress", "--quick", most=bench.left() / 2, statuses=(0, 6, 7))
    results = stress.get("results")
    figures["stress"] = stress if results is None else {
        "results": len(results), "failed": [r["case"] if "case" in r else r for r in results if not r["passed"]],
        "worst": max(r["error"] / r["allowed"] for r in results if r["allowed"] and not r["non_finite"])}
    for test in tests_for(bench):
        layer = PROGRAMS[pathlib.Path(test["program"]).name]
        row = figures["tests"].setdefault(layer, {"passed": 0, "failed": [], "skipped": 0, "left_out": []})
        if bench.left() < 2:
            row["left_out"].append(test["name"])
            bench.was_cut = True
            continue
        outcome = test_outcome(bench.build, test, bench.environment, bench.left())
        row["passed"] += outcome["passed"]
        row["failed"] += outcome["failed"]
        row["skipped"] += sum(map(len, outcome["skipped"].values()))


def tests_for(bench):
    """The quick tests of the layers that compute. On a GPU also those of the kernels for GPUs that are too slow for a
    quick run on a CPU, and not those of the kernels for CPUs."""
    for test in listed_tests(bench.build):
        layer = PROGRAMS[pathlib.Path(test["program"]).name]
        if layer not in ("vk", "ops", "nn", "raster") or test["name"].startswith(("Harness", "SecondGolden")):
            continue
        wanted = "quick" in test["labels"]
        if not bench.is_cpu:
            only = {pattern.rpartition("/")[2] for word in test["arguments"]
                    for pattern in word.partition("=")[2].partition("-")[0].split(":")}
            wanted = (wanted or only == {"gpu"}) and "long" not in test["labels"] and only != {"cpu"}
            test["arguments"] = [re.sub("-[*]/gpu$", "-*/cpu", word) for word in test["arguments"]]
        if wanted:
            yield test


def ops(bench, figures):
    size = ["--quick"] if bench.is_cpu else []
    figures["shapes"] = "small ones" if bench.is_cpu else "those of the networks"
    cases = bench.json("bench", "ops", "--list", *size)
    if "problem" in cases:
        raise RuntimeError(cases["problem"])
    ceilings = bench.document["parts"].get("dispatch", {}).get("ceilings")
    status, output, problem = bench.call(bench.build / "tests/ops/op_replay", given=json.dumps(cases),
                                         most=bench.left() * 0.6)
    figures["rows"] = rows = [with_rates(json.loads(line), ceilings) for line in output.splitlines()
                              if line.endswith("}")]
    for op in dict.fromkeys(row["op"] for row in rows):
        checked = bench.json("bench", "ops", "--only", op, "--repeat", "1", *size, statuses=(0, 1))
        errors = {(one["case"], one["direction"]): one["fast"] for one in checked.get("results", [])}
        for row in rows:
            if row["op"] == op:
                fast = errors.get((row["case"], row["direction"]), {})
                row["relative_l2"], row["good"] = fast.get("relative_l2"), fast.get("good")
    if status != 0:
        rows.append({"op": "op_replay"} | answer(status, "", problem))


def with_rates(row, ceilings):
    seconds = row["ms"]["min"] * 1e-3
    if seconds > 0:
        row["tflop_per_s"], row["gb_per_s"] = row["flops"] / seconds * 1e-12, row["bytes"] / seconds * 1e-9
        if ceilings:
            row["of_ceiling"] = max(row["tflop_per_s"] / ceilings["fma_tflop_per_s"]["best"],
                                    row["gb_per_s"] / max(ceilings[copy]["best"]
                                                          for copy in ("copy_gb_per_s", "transfer_gb_per_s")))
    return row


def networks(bench, figures):
    figures["rows"] = []
    for objects in OBJECTS:
        for name, config in NETWORKS.items():
            command = ["bench", "model", *bench.config(config), "--objects", str(objects), "--backward"]
            row = bench.json(*command, "--rounds", "5" if not bench.is_cpu else "1")
            if "problem" not in row:
                row = {key: row[key] for key in ("parameters", "gflop", "forward", "forward_backward", "memory")}
                profiled = bench.json(*command, "--rounds", "1", "--profile")
                row["lists"] = profiled.get("lists", profiled)
                row["profile"] = profiled.get("profile")
            figures["rows"].append({"network": name, "objects": objects} | row)


def scenes(bench, folder):
    """Name, scene and options of each, or a problem; made by scenes.py, and the real one where it is."""
    status, _, errors = bench.script("numpy", "scenes.py", folder, most=bench.left() / 3)
    made = None if status == 0 else answer(status, "", errors)["problem"]
    real = pathlib.Path(os.environ.get("SPLAT_REAL_DIR", bench.root.parent / "shared/real"))
    yield "100,000 at random", None, []
    for name in ("si128_trained", "si128_init"):
        yield name, made, [folder / f"{name}.ply", "--cameras", folder / f"{name}.json", "--background", "1,1,1"]
    guitar = real / "derived/guitar_inria_sh0.ply"
    yield ("guitar", None if guitar.exists() else "not here; SPLAT_REAL_DIR names the folder of real files",
           [guitar, "--cameras", real / "images/guitar_orbit/transforms.json", "--scale", "5"])
    for name in ("synth500k", "million"):
        yield name, made, [folder / f"{name}.ply", "--cameras", folder / f"{name}.json"]


def raster(bench, figures):
    figures["rows"] = []
    with tempfile.TemporaryDirectory() as folder:
        for name, problem, words in scenes(bench, pathlib.Path(folder)):
            row = {"problem": problem} if problem else bench.json(
                "bench", "raster", *words, "--no-plain", "--no-skips", "--samples", "50",
                "--seconds", "0.5" if bench.is_cpu else "2")
            figures["rows"].append(row.get("result", row) | {"scene": name})


def training(bench, figures):
    figures["rows"] = []
    with tempfile.TemporaryDirectory() as folder:
        made = bench.json("data", "synth", folder + "/data", "--objects", "8", "--views", "12", "--size", "64",
                          "--seed", "1")
        for objects in (4, 8):
            row = made if "problem" in made else training_steps(bench, folder, objects)
            figures["rows"].append({"objects": objects, "views": 6} | row)


def training_steps(bench, folder, objects):
    steps = 4 if bench.is_cpu else 60
    run_folder = pathlib.Path(folder) / f"run{objects}"
    status, _, errors = bench.call(
        bench.vkrun, "train", bench.root / "tools/weights/cars64/cars64.yaml", "--data", folder + "/data", "--out",
        run_folder, *(word for setting in (f"opt.batch_size={objects}", f"opt.micro_batch={objects}",
                                           "opt.imgs_per_obj=6", f"opt.iterations={steps}", "logging.loss_log=1",
                                           "logging.val_log=1000000") for word in ("--set", setting)))
    lines = run_folder / "metrics.jsonl"
    rows = [json.loads(line) for line in lines.read_text().splitlines()] if lines.exists() else []
    rows = [row for row in rows if "network_ms" in row]
    if len(rows) < 3:
        return answer(status, "", errors) if status else {"problem": f"only {len(rows)} steps were logged"}
    each = [1e3 * (after["seconds"] - before["seconds"]) for before, after in zip(rows[1:], rows[2:])]
    figures = {"steps": len(rows), "step_ms": {"min": min(each), "median": statistics.median(each)}}
    for key in ("network_ms", "render_ms", "update_ms"):
        figures[key] = statistics.median(row[key] for row in rows[1:])
    return figures


# A share of the time each. A GPU needs less for most of them; a CPU is cut off.
PARTS = {"device": (device, 2), "dispatch": (dispatch, 5), "checks": (checks, 30), "ops": (ops, 14),
         "networks": (networks, 25), "raster": (raster, 14), "training": (training, 6), "peers": (peers, 14)}
