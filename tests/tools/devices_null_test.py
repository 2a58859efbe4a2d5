#!/usr/bin/env python3
"""tools/bench/devices --null with Debian's RADV: devices_null_test.py TOOL BUILD FOLDER"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import unittest

TOOL, BUILD, FOLDER = map(pathlib.Path, sys.argv[1:4])
sys.dont_write_bytecode = True
sys.path.insert(0, str(TOOL.parent))
import null_devices  # noqa: E402


class Null(unittest.TestCase):
    def setUp(self):
        shutil.rmtree(FOLDER, ignore_errors=True)
        (FOLDER / "null").mkdir(parents=True)

    def null(self, *pipelines):
        """The lines of the table, with these pipelines as the recorded ones."""
        (FOLDER / "null/pipelines.txt").write_text("".join(f"gpu {one}\n" for one in pipelines))
        done = subprocess.run([TOOL, "--null", "--build", BUILD, "--out", FOLDER, f"Navi 21={null_devices.RADEON}"],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                              env=os.environ | {"RADV_FORCE_FAMILY": "navi21"}, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout.splitlines()

    @unittest.skipUnless(pathlib.Path(null_devices.RADEON).exists(), "there is no RADV")
    def test_every_module_is_compiled(self):
        lines = self.null("tensor_stats 0=64", "tensor_stats 0=256", "radix_sort_downsweep_gpu 0=256")
        modules = {file.stem for file in (BUILD / "shaders").glob("*.spv") if not file.stem.endswith("_cpu")}
        self.assertIn("Navi 21, radv", lines[0])
        with open(FOLDER / "null/Navi 21.json", encoding="utf-8") as file:
            row = json.load(file)
        self.assertEqual({name.split()[0] for name in row["pipelines"]}, modules)
        self.assertNotIn("tensor_stats", row["pipelines"], "a module that is in use has no other specialisation")
        small, large = (row["pipelines"][f"tensor_stats 0={size}"] for size in (64, 256))
        self.assertLess(small["LDS size"], large["LDS size"], "the specialisation reached the compiler")
        self.assertGreater(null_devices.figures(large)["registers"], 0)

    def test_what_spills_or_does_not_compile_has_a_row(self):
        good = {"VGPRs": 24, "Spilled VGPRs": 0, "Scratch size": 0, "LDS size": 2048}
        sets = {"x 0=1": "gpu", "x 0=2": "gpu", "y": ""}
        bad = {**good, "Spilled VGPRs": 3, "Scratch size": 1536}
        rows = [{"name": "B", "order": 1, "device": "D", "driver": "b", "sets": sets,
                 "pipelines": {"x 0=1": bad, "x 0=2": good, "y": good}},
                {"name": "A", "order": 0, "device": "Null hardware", "driver": "a", "sets": sets,
                 "pipelines": {"x 0=1": None, "x 0=2": good, "y": good}}]
        lines = null_devices.table(rows).splitlines()
        self.assertTrue(lines[0].endswith("| A, a | B: D, b |"), lines[0])
        self.assertEqual(lines[2], "| x | gpu | 1 of 2 | 2 | **does not compile** | 24, **3** spilled, **1.5 KiB** |")
        self.assertEqual(lines[3], "| other modules (1), the most | | 0 of 1 | 2 | 24 | 24 |")


unittest.main(argv=sys.argv[:1])
