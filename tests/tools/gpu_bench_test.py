#!/usr/bin/env python3
"""tools/bench/gpu on lavapipe: gpu_bench_test.py TOOL VKRUN FOLDER

What it writes, how it shares its time, what it says of bad input, and that what it packs runs without a Python.
"""

import fcntl
import json
import os
import pathlib
import shutil
import subprocess
import sys
import time
import types
import unittest

TOOL, VKRUN, FOLDER = map(pathlib.Path, sys.argv[1:4])
sys.dont_write_bytecode = True
sys.path.insert(0, str(TOOL.parent))
import gpu_parts  # noqa: E402
import gpu_report  # noqa: E402


def gpu(*words, status=0, program=TOOL, **environment):
    """Standard output and error of the tool."""
    done = subprocess.run([program, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          env=os.environ | environment, check=False)
    if done.returncode != status:
        raise AssertionError(f"{words} ended with {done.returncode}, expected {status}: {done.stdout} {done.stderr}")
    return done.stdout + done.stderr


def measure(name, *words, status=0, **environment):
    said = gpu("--vkrun", VKRUN, "--out", FOLDER / name, *words, status=status, **environment)
    path = FOLDER / name / "gpu.json"
    return said, json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def command_of(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/cmdline").read_text(encoding="utf-8")
    except OSError:
        return ""


def children_of(pid):
    found = {}
    for path in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = path.read_text(encoding="utf-8").rpartition(")")[2].split()[1]
        except OSError:
            continue
        if parent == str(pid):
            found[int(path.parent.name)] = command_of(path.parent.name)
    return found


class GpuBench(unittest.TestCase):
    def test_measures_parts_and_replaces_only_those_of_a_second_run(self):
        _, first = measure("parts", "--only", "device,dispatch", "--seconds", "60")
        self.assertEqual(list(first["parts"]), ["device", "dispatch"])
        for part in first["parts"].values():
            self.assertEqual(part["status"], "done")
        self.assertEqual(first["parts"]["device"]["kernels"]["plain"], "run")
        self.assertGreater(first["parts"]["dispatch"]["ceilings"]["fma_tflop_per_s"]["best"], 0)
        self.assertEqual(len(first["parts"]["dispatch"]["chains"]), 8)
        text = (FOLDER / "parts/gpu.md").read_text(encoding="utf-8")
        self.assertTrue(text.startswith("# A CPU, no GPU: "), text[:80])
        self.assertIn("## Ceilings and overheads", text)
        _, second = measure("parts", "--only", "device,ops", "--seconds", "40")
        self.assertEqual(list(second["parts"]), ["device", "dispatch", "ops"])
        self.assertEqual(second["parts"]["dispatch"], first["parts"]["dispatch"])
        rows = second["parts"]["ops"]["rows"]
        self.assertGreater(len({row["op"] for row in rows}), 20)
        self.assertIn("of_ceiling", rows[0])

    def test_ends_in_time_and_says_what_was_cut_off(self):
        _, found = measure("short", "--only", "networks,peers", "--seconds", "3", "--python", "/nonexistent")
        networks, peers = found["parts"]["networks"], found["parts"]["peers"]
        self.assertLess(networks["seconds"] + peers["seconds"], 8)
        self.assertEqual(len(networks["rows"]), 6)
        self.assertIn("problem", networks["rows"][-1])
        self.assertGreater(len(peers["rows"]), 2)
        self.assertTrue(all("problem" in row for row in peers["rows"]), peers)
        self.assertEqual(networks["status"], "cut off by its deadline")

    def test_refuses_what_it_cannot_do(self):
        self.assertIn("give either --out or --pack", gpu(status=2))
        self.assertIn("no part 'all'", gpu("--only", "all", "--out", FOLDER, status=2))
        self.assertIn("--software has no effect without --pack", gpu("--out", FOLDER, "--software", status=2))
        self.assertIn("--seconds has no effect with --pack", gpu("--pack", FOLDER, "--seconds", "9", status=2))
        self.assertIn("expected 1 to 86400", gpu("--out", FOLDER, "--seconds", "0", status=2))
        self.assertIn("no usable device", measure("none", "--only", "device", status=1,
                                                  VK_DRIVER_FILES="/nonexistent", VK_ICD_FILENAMES="/nonexistent")[0])
        measure("other", "--only", "device")
        path = FOLDER / "other/gpu.json"
        path.write_text(path.read_text(encoding="utf-8").replace('"uuid": "', '"uuid": "0', 1), encoding="utf-8")
        self.assertIn("name another folder with --out", measure("other", "--only", "device", status=1)[0])
        for damaged in ('{"parts":', "[]", "{}", '{"parts": [], "device": {}}', '{"parts": {}, "device": "x"}'):
            path.write_text(damaged, encoding="utf-8")
            said = gpu("--vkrun", VKRUN, "--out", FOLDER / "other", "--only", "device", status=1)
            self.assertIn("is damaged: move it away", said)
        self.assertIn("cannot write to", gpu("--vkrun", VKRUN, "--out", path / "below", status=1))
        self.assertIn("no program in a build folder", gpu("--vkrun", "/bin/true", "--out", FOLDER, status=2))
        with open(FOLDER / "other/gpu.lock", "w", encoding="utf-8") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            path.unlink()
            self.assertIn("another run writes", measure("other", "--only", "device", status=1)[0])

    def test_ends_what_it_started_when_it_is_interrupted(self):
        with subprocess.Popen([TOOL, "--vkrun", VKRUN, "--out", FOLDER / "killed", "--only", "dispatch"],
                              stderr=subprocess.PIPE, text=True) as process:
            for _ in range(200):
                started = children_of(process.pid)
                if any("dispatch" in command for command in started.values()):
                    break
                time.sleep(0.05)
            process.terminate()
            self.assertNotIn("Traceback", process.communicate(timeout=20)[1])
            self.assertEqual(process.returncode, 143)
        self.assertTrue(started)
        time.sleep(0.2)
        for pid, command in started.items():
            self.assertNotEqual(command_of(pid), command, "it goes on")

    def test_chooses_tests_by_device(self):
        def chosen(is_cpu):
            bench = types.SimpleNamespace(build=VKRUN.parents[2], is_cpu=is_cpu)
            return {test["name"]: test for test in gpu_parts.tests_for(bench)}
        cpu, other = chosen(True), chosen(False)
        self.assertIn("Conv2dCpu", cpu)
        self.assertLess({"GaussianHead", "Losses", "Conv2dGpu", "Rasterizer", "Vk"}, set(other))
        for name in ("Conv2dCpu", "SsimCpu", "OpSamplesBounds", "RasterizerLong"):
            self.assertNotIn(name, other)
        self.assertIn("-*/cpu", " ".join(other["Rasterizer"]["arguments"]))

    def test_tables_take_parts_that_ended_early(self):
        document = {"device": {"kind": "discrete", "name": "a GPU", "driver": "1"},
                    "parts": {name: {"status": "failed: x", "seconds": 1} for name in gpu_report.SECTIONS}}
        gpu_report.write(FOLDER, document)
        text = (FOLDER / "gpu.md").read_text(encoding="utf-8")
        self.assertTrue(text.startswith("# a GPU (1)"))
        self.assertEqual(text.count("failed: x, 1 of 0 s."), len(gpu_report.SECTIONS))

    def test_packs_what_runs_without_python(self):
        table = gpu("--vkrun", VKRUN, "--pack", FOLDER / "pack")
        self.assertIn("the tree and the archive together", table)
        subprocess.run(["tar", "xzf", FOLDER / "pack/libsplat-gpu.tar.gz", "-C", FOLDER / "pack"], check=True)
        tools = FOLDER / "pack/bin"
        tools.mkdir()
        for name in ("sh", "dirname"):
            (tools / name).symlink_to(shutil.which(name))
        gpu("--only", "device,checks", "--seconds", "12", "--out", FOLDER / "pack/out", PATH=str(tools),
            program=FOLDER / "pack/libsplat-gpu/run")
        found = json.loads((FOLDER / "pack/out/gpu.json").read_text(encoding="utf-8"))["parts"]
        self.assertEqual(found["device"]["status"], "done")
        self.assertNotIn("failed", found["checks"]["status"])
        self.assertEqual(list(found["checks"]["self_test"]), ["plain", "cpu", "gpu"])


if __name__ == "__main__":
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    unittest.main(argv=sys.argv[:1], verbosity=2)
