#!/usr/bin/env python3
"""tools/bench/ablation: ablation_test.py TOOL VKRUN FOLDER

Its runs are configurations that vkrun takes; estimated maps are as wrong as they should be; what it refuses, and that
it goes on where it was interrupted, with a vkrun that is made up."""

import importlib.machinery
import importlib.util
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time
import unittest

TOOL, VKRUN, FOLDER = map(pathlib.Path, sys.argv[1:4])
sys.dont_write_bytecode = True
sys.path.insert(0, str(TOOL.parent))
loader = importlib.machinery.SourceFileLoader("ablation", str(TOOL))
ablation = importlib.util.module_from_spec(importlib.util.spec_from_loader("ablation", loader))
loader.exec_module(ablation)
from ablation_runs import GROUPS, study_of  # noqa: E402

try:
    import numpy as np
    import ablation_data
except ImportError:
    np = None

# Scores depend on the run's name; a train waits where the file `slow` is.
MADE_UP = '''#!@PYTHON@
import json, pathlib, sys, time
words = sys.argv[1:]
value = lambda name: words[words.index(name) + 1]
here = pathlib.Path("@FOLDER@")
with open(here / "calls.txt", "a") as file:
    file.write(" ".join(words[:2]) + "\\n")
out = pathlib.Path(value("--out")) if "--out" in words else None
if words[0] == "train":
    (out / "checkpoints").mkdir(parents=True, exist_ok=True)
    (out / "checkpoints/state").write_text("")
    try:
        time.sleep(30 if (here / "slow").exists() and "timed" not in str(out) else 0)
    except BaseException:
        raise SystemExit(130)
    (out / "metrics.jsonl").write_text("".join(json.dumps({"step": i, "loss": 1, "seconds": 2.0 + 0.5 * i, "network_ms":
        400.0, "render_ms": 60.0, "update_ms": 40.0}) + "\\n" for i in range(1, 4)))
    (out / "run.json").write_text(json.dumps({"state": "done", "trainable": 1000}))
elif words[0] == "eval":
    out.mkdir(parents=True)
    count = int((here / "count").read_text())
    gain = len(out.parent.name) * 0.01
    (out / "per_object.csv").write_text("object,psnr_novel,ssim_novel\\n" + "".join(
        f"o{i},{20 + i * 0.1 + gain},{0.9 + gain / 100}\\n" for i in range(count)))
    (out / "results.json").write_text(json.dumps({"data": {"objects": count}, "objects": count,
        "predictions_per_second": 2.0, "images_per_second": 100.0}))
elif words[0] == "compare":
    print(json.dumps({"metrics": [{"metric": name, "ci": [0.1, 0.2], "observed_difference": 0.15}
                                  for name in ("psnr", "ssim")]}))
'''


def run(*words, status=0):
    done = subprocess.run([sys.executable, TOOL, "--vkrun", FOLDER / "vkrun", *map(str, words)], capture_output=True,
                          text=True, check=False)
    if done.returncode != status:
        raise AssertionError(f"{words} ended with {done.returncode}, expected {status}: {done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def calls(word):
    path = FOLDER / "calls.txt"
    return [line for line in path.read_text().splitlines() if line.startswith(word)] if path.exists() else []


class Runs(unittest.TestCase):
    def test_are_configurations_that_vkrun_takes(self):
        changes = {}
        for group, runs in GROUPS.items():
            names = {run.name for run in runs}
            for each in runs:
                beside = {other.name for other_group, others in GROUPS.items() for other in others
                          if study_of(other_group) == study_of(group)} | {"start"}
                self.assertLessEqual(set(each.against), beside, f"{each.name} is compared with runs of another table")
                self.assertTrue(each.after is None or each.after in names, f"{each.name} continues a run of the group")
                words = [change.format(side=64 if each.base is None else 32, out="o", data="d", tokens=64)
                         for change in each.changes]
                changes[(each.base or TOOL.parents[1] / "weights/cars64/config.json", *words)] = each.name
        for (base, *words), name in changes.items():
            done = subprocess.run([VKRUN, "train", base, "--show", *(w for word in words for w in ("--set", word))],
                                  capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, f"{name}: {done.stderr}")
            self.assertNotIn("warning", done.stderr, name)

    def test_of_one_name_are_one_run(self):
        seen = {}
        for runs in GROUPS.values():
            for each in runs:
                self.assertEqual(seen.setdefault(each.name, each), each)


class Intervals(unittest.TestCase):
    def test_of_seeds_and_objects_hold_both(self):
        objects = [i / 100 for i in range(30)]
        alike = ablation.interval_of_both([objects, objects])
        apart = ablation.interval_of_both([objects, [each + 1 for each in objects]])
        self.assertTrue(0.1 < alike[0] < 0.145 < alike[1] < 0.2, alike)
        self.assertTrue(apart[0] < 0.2 and apart[1] > 1.1, apart)
        self.assertEqual(ablation.interval_of_both([[0.5] * 9]), (0.5, 0.5))


@unittest.skipIf(np is None, "NumPy is not there")
class Estimates(unittest.TestCase):
    def test_are_as_wrong_as_published_ones(self):
        numbers = np.random.default_rng(1)
        side, views = 32, 200
        y, x = np.mgrid[:side, :side]
        disc = np.repeat((((x - 15.5) ** 2 + (y - 15.5) ** 2) < 100)[None], views, axis=0)
        nearness = np.where(disc, 0.4 + 0.3 * numbers.random((views, 1, 1)), 0)
        _, wrong = ablation_data.estimated_depth(nearness, ablation_data.random_of("a", 0))
        self.assertAlmostEqual(wrong.mean(), 0.045, delta=0.003)
        normals = np.where(disc[..., None], [0.0, 0.6, -0.8], 0.0)
        turned, angles = ablation_data.estimated_normals(normals, ablation_data.random_of("a", 1))
        found = np.degrees(np.arccos(np.clip(turned[disc] @ [0, 0.6, -0.8], -1, 1)))
        np.testing.assert_allclose(found, angles, atol=1e-4)
        self.assertAlmostEqual(np.median(angles), 8.4, delta=0.5)
        self.assertAlmostEqual(angles.mean(), 16.4, delta=2)  # 90 degrees bound the tail
        self.assertEqual(np.abs(turned[~disc]).max(), 0)
        _, shares = ablation_data.estimated_masks(disc.astype(float), ablation_data.random_of("a", 2))
        self.assertAlmostEqual(shares.mean(), 0.044, delta=0.001)

    def test_are_the_same_each_time(self):
        maps = np.linspace(0, 1, 3 * 16 * 16).reshape(3, 16, 16)
        first, again, other = (ablation_data.estimated_depth(maps, ablation_data.random_of(name, 0))[0]
                               for name in ("train/a", "train/a", "train/b"))
        self.assertTrue((first == again).all())
        self.assertFalse((first == other).all())

    def test_of_planes_are_those_of_vkrun(self):
        library = VKRUN.resolve().parents[2] / "src/libsplat.so"
        if not library.exists():
            self.skipTest("there is no libsplat.so beside vkrun")
        os.environ["SPLAT_LIBRARY"] = str(library)
        sys.path.insert(0, str(TOOL.resolve().parents[2] / "bindings/python/src"))
        import libsplat as splat
        folder = FOLDER / "planes"
        shutil.rmtree(folder, ignore_errors=True)
        for words in (["data", "synth", folder, "--class", "chairs", "--objects", 1, "--views", 2, "--size", 32],
                      ["priors", "plane", folder, "--out", folder, "--normals", "--distances", ablation_data.NEAREST,
                       ablation_data.FARTHEST]):
            subprocess.run([VKRUN, *map(str, words)], check=True, stdout=subprocess.DEVNULL)
        chair = next(path for path, name in ablation_data.objects_of(folder) if name.startswith("train/"))
        depth, normal, stored = (ablation_data.read_maps(splat, chair, kind)[1][0]
                                 for kind in ("depth", "normal", "plane"))
        focal = float((chair / "intrinsics.txt").read_text().split()[0])
        made = ablation_data.plane_map(splat, depth, normal * 2 - 1, focal)
        self.assertGreater((stored[..., 3] > 0).mean(), 0.05)
        same = (np.abs(made - stored) < 1.01 / 255).all(axis=-1)
        self.assertTrue(same.all())

    def test_of_data_in_another_layout_are_refused(self):
        with self.assertRaisesRegex(ablation_data.NotSuitable, "no object in SRN's layout"):
            ablation_data.objects_of(FOLDER / "nothing")


class Tool(unittest.TestCase):
    def setUp(self):
        shutil.rmtree(FOLDER, ignore_errors=True)
        FOLDER.mkdir(parents=True)
        (FOLDER / "count").write_text("8")
        (FOLDER / "data").mkdir()
        path = FOLDER / "vkrun"
        path.write_text(MADE_UP.replace("@PYTHON@", sys.executable).replace("@FOLDER@", str(FOLDER)))
        path.chmod(0o755)
        self.words = ["--groups", "edge_loss", "--steps", 10, "--data", FOLDER / "data", "--out", FOLDER / "out"]

    def test_goes_on_after_an_interruption_and_adds_seeds(self):
        (FOLDER / "slow").write_text("")
        with subprocess.Popen([sys.executable, TOOL, "--vkrun", FOLDER / "vkrun", *map(str, self.words), "--seeds",
                               "1"]) as process:
            end = time.monotonic() + 30
            while not (FOLDER / "out/seed1/rgb_small/checkpoints/state").exists() and time.monotonic() < end:
                time.sleep(0.05)
            process.send_signal(signal.SIGTERM)
            self.assertEqual(process.wait(30), 130)
        (FOLDER / "slow").unlink()
        before = len(calls("train"))
        said = run(*self.words, "--seeds", 1)
        self.assertIn("about 1 min for 3 runs of 10 steps (0.50 to 0.50 s each)", said)
        self.assertEqual(calls("train")[before], "train --out", "the interrupted run is resumed")
        self.assertEqual(len(calls("train")) - before, 3)
        run(*self.words, "--seeds", "1,2")
        self.assertEqual(len(calls("train")) - before, 6)
        said = run(*self.words, "--seeds", "1,2")
        self.assertEqual(len(calls("train")) - before, 6, "what is done is not repeated")
        self.assertIn("| + loss on Sobel edges of weight 0.1 | 1,000 | 500 | 2 | 20.440 | 0.9009 | rgb_small | "
                      "+0.150 [+0.100, +0.200] | +0.000 to +0.000 | [+0.000, +0.000] | +0.1500 |", said)

    def test_refuses_other_settings_and_definitions(self):
        run(*self.words, "--seeds", 1)
        self.assertIn("holds runs with steps 10, not 20", run(*self.words, "--steps", 20, status=2))
        self.assertIn("holds runs with scratch_rate 0.002, not 0.1", run(*self.words, "--scratch-rate", 0.1, status=2))
        path = FOLDER / "out/settings.json"
        held = json.loads(path.read_text())
        held["runs"]["edge_loss"][0][0] = "opt.lambda_edge=0.2"
        path.write_text(json.dumps(held))
        self.assertIn("holds the run 'edge_loss' as", run(*self.words, status=2))

    def test_refuses_too_few_objects(self):
        self.assertIn("--objects is 6, expected at least 7", run(*self.words, "--objects", 6, status=2))
        (FOLDER / "count").write_text("6")
        self.assertIn("has 6 test objects, expected at least 7", run(*self.words, status=2))
        self.assertEqual(len(calls("train")), 1, "nothing is trained but the timed steps")

    def test_refuses_groups_of_different_tables(self):
        self.assertIn("are of different tables; give those of one: core,priors",
                      run("--groups", "core,conditioning", "--out", FOLDER / "out", status=2))

    @unittest.skipIf(np is None, "NumPy is not there")
    def test_says_what_derived_data_need(self):
        words = ["--groups", "estimates", "--data", FOLDER / "data", "--out", FOLDER / "out"]
        os.environ["SPLAT_LIBRARY"] = str(VKRUN.resolve().parents[2] / "src/libsplat.so")
        self.assertIn("has no object in SRN's layout", run(*words, status=2))
        (FOLDER / "data/cars_train/a/rgb").mkdir(parents=True)
        (FOLDER / "data/cars_train/a/intrinsics.txt").write_text("")
        self.assertIn("has no depth/, expected exact maps", run(*words, status=2))


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    unittest.main(argv=sys.argv[:1])
