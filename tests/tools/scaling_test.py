#!/usr/bin/env python3
"""tools/bench/scaling: scaling_test.py TOOL DOCS FOLDER

The model beside cases that are computed by hand, the tables in the docs, what it says of bad input."""

import importlib.machinery
import importlib.util
import json
import math
import pathlib
import subprocess
import sys
import unittest

TOOL, DOCS, FOLDER = map(pathlib.Path, sys.argv[1:4])
sys.dont_write_bytecode = True
loader = importlib.machinery.SourceFileLoader("scaling", str(TOOL))
scaling = importlib.util.module_from_spec(importlib.util.spec_from_loader("scaling", loader))
loader.exec_module(scaling)

# Round numbers: 2 ms a slice of one object, 1 GB/s inside a machine of 2 ranks, 0.5 between machines.
PARTS = {"batch": 8, "micro_batch": 1, "pass": 1.0, "object": 1.0, "update": 4.0, "bytes": 1_000_000, "add": 0.5,
         "piece": 1_000_000, "submit": 0.0, "host_bandwidth": 2.0, "local_bandwidth": 1.0, "local_latency": 0.0,
         "bandwidth": 0.5, "latency": 0.0, "per_machine": 2, "devices": 2, "gathers": 0}


def told(*words):
    return subprocess.run([sys.executable, TOOL, *map(str, words)], capture_output=True, text=True, check=False)


class Model(unittest.TestCase):
    def test_one_rank_sums_by_the_tree(self):
        made = scaling.step(PARTS, 1, 8)
        self.assertEqual((made["passes"], made["adds"], made["exchange"], made["host"]), (16, 3.5, 0, 0))
        self.assertEqual(made["step"], 16 + 3.5 + 4)
        self.assertEqual(scaling.step(PARTS, 1, 6)["adds"], 0.5, "3 + 3 slices, of which each 3 add as they run")
        self.assertEqual(scaling.step(PARTS, 1, 5)["adds"], 0)

    def test_two_ranks_swap_halves_twice(self):
        made = scaling.step(PARTS, 2, 8)
        self.assertEqual((made["passes"], made["adds"], made["sent"]), (8, 1.75, 1_000_000))
        self.assertAlmostEqual(made["exchange"], 1)  # 1 MB at 1 GB/s
        self.assertAlmostEqual(made["host"], 1)      # 2 MB at 2 GB/s: halves read, received, read, written

    def test_more_ranks_halve_and_double(self):
        made = scaling.step(PARTS, 4, 8)
        self.assertEqual(made["sent"], 1_500_000)
        # Half of it inside the machine, a quarter between machines, whose network two ranks share; both twice.
        self.assertAlmostEqual(made["exchange"], 2 * (0.5 + 0.25 * 2 / 0.5))
        self.assertEqual(made["adds"], 0.5 * (1 + 0.75))
        self.assertAlmostEqual(made["host"], 2.5 / 2)

    def test_ranks_beyond_the_devices_share_them(self):
        one = PARTS | {"devices": 1}
        self.assertEqual(scaling.step(one, 2, 8)["passes"], 2 * scaling.step(PARTS, 2, 8)["passes"])
        self.assertEqual(scaling.step(one, 4, 8)["update"], 2 * 4, "two ranks on the one device of each machine")

    def test_latency_counts_for_each_message(self):
        slow = PARTS | {"latency": 10.0, "gathers": 3, "piece": 400_000, "submit": 1.0}
        self.assertAlmostEqual(scaling.exchange(slow, 4)[0] - scaling.exchange(PARTS, 4)[0], (2 * 3 + 3) * 10)
        self.assertAlmostEqual(scaling.host(slow, 4) - scaling.host(PARTS, 4), 9 * 3)

    def test_a_free_exchange_scales_to_the_last_slice(self):
        free = PARTS | {"bytes": 1, "add": 0.0, "update": 0.0}
        found = scaling.rows(free, False)
        self.assertEqual([row[0] for row in found], [1, 2, 4, 8])
        self.assertTrue(all(math.isclose(row[4], 1, abs_tol=1e-3) for row in found))
        self.assertIn("It ends at 8 ranks", scaling.end_of(found))
        self.assertIn("goes on beyond 64", scaling.end_of(scaling.rows(free, True)))
        self.assertIn("Beyond 2 ranks", scaling.end_of(scaling.rows(PARTS | {"update": 1000.0}, False)))


class Words(unittest.TestCase):
    def test_docs_have_its_tables(self):
        shown = told("--docs").stdout.strip()
        self.assertIn(shown, DOCS.read_text())

    def test_runs_are_compared(self):
        FOLDER.mkdir(parents=True, exist_ok=True)
        for ranks, ms in ((1, 100.0), (2, 50.0)):
            run = FOLDER / str(ranks)
            run.mkdir(exist_ok=True)
            step = {"network_ms": ms, "render_ms": 1.0, "update_ms": 1.0, "exchange_ms": 3.0 * (ranks - 1)}
            (run / "metrics.jsonl").write_text("".join(
                json.dumps(line) + "\n" for line in ({"step": 0}, step | {"network_ms": 9999}, step, step)))
        done = told("--measured", FOLDER / "1", FOLDER / "2", "batch=8", "update=1", "object=0")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("| 1 | 102.0 | 102.1 | 0.00 | 0.00 |", done.stdout)
        self.assertIn("| 2 | 55.0 | ", done.stdout)

    def test_bad_input(self):
        for words, sentence in ((["speed=3"], "'speed=3', expected PART=NUMBER with one of batch, "),
                                (["batch"], "'batch', expected PART=NUMBER"),
                                (["bandwidth=0"], "bandwidth is '0', expected a number above 0"),
                                (["add=nan"], "add is 'nan', expected 0 or more"),
                                (["batch=1.5"], "batch is '1.5', expected a whole number"),
                                (["batch=8", "micro_batch=3"], "batch is 8, expected a multiple of micro_batch, 3"),
                                (["--measured"], "--measured needs the folders of runs"),
                                (["--measured", FOLDER / "none"], "metrics.jsonl: ")):
            done = told(*words)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(sentence, done.stderr)
            self.assertNotIn("Traceback", done.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
