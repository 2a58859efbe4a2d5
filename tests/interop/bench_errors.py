#!/usr/bin/env python3
"""Usage: tests/interop/bench_errors.py VKRUN

Runs `vkrun bench model --errors` on a small network: the errors of every precision and of PyTorch against
float64 are neither above nor far below the bounds of their arithmetic. Exit status 77: skipped, with the reason.
"""
import json
import os
import subprocess
import sys
import tempfile

try:
    import torch
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

CONFIG = """data: {training_resolution: 32, use_pred_depth: true, fov: 40, znear: 0.5, zfar: 2.5}
model: {base_dim: 32, num_blocks: 1, channel_mult: [1, 2], attention_resolutions: [16]}
"""

# Relative L2 of the raw output: sums of some 300 float32 products, layer by layer, give 5e-8 to 2e-7;
# Winograd's F(4x4), which only `fast` takes for layers as small as these, three times that.
LIMITS = {"strict": 5e-7, "balanced": 5e-7, "fast": 2e-6, "PyTorch": 5e-7}


def main():
    with tempfile.TemporaryDirectory() as folder:
        config, plot = os.path.join(folder, "small.yaml"), os.path.join(folder, "errors.svg")
        with open(config, "w", encoding="utf-8") as file:
            file.write(CONFIG)
        done = subprocess.run(
            [sys.argv[1], "bench", "model", "--config", config, "--errors", "--svg", plot, "--objects", "2",
             "--rounds", "1", "--json", "--python", sys.executable], capture_output=True, text=True)
        if done.returncode != 0:
            if "libopenblas0-pthread" in done.stderr:
                print("skipped: PyTorch without a fast BLAS")
                sys.exit(77)
            sys.exit(f"FAILED: {done.stderr}")
        rows = json.loads(done.stdout)["errors"]
        with open(plot, encoding="utf-8") as file:
            svg = file.read()
    wrong = []
    for row in rows:
        who, error = row["who"], row["raw_relative_l2"]
        print(f"{who}: {error:.1e} of the raw output, {row['largest_error']:.1e} at most, {row['min_ms']:.1f} ms")
        if not 1e-9 < error < LIMITS[who] or f">{who}</text>" not in svg:
            wrong.append(who)
    if wrong or [row["who"] for row in rows] != list(LIMITS):
        sys.exit(f"FAILED: {wrong}")
    print(f"all within the bounds of float32 (PyTorch {torch.__version__})")


main()
