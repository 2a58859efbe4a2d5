#!/usr/bin/env python3
"""Usage: tests/interop/eval_lpips.py VKRUN

vkrun eval --lpips gives the same scores with weights of VGG16 and LPIPS in the format before PyTorch 1.6, as
torchvision and the lpips package publish them, and in the present one. The old files share a storage, and its
convolutions are in channels_last order. Exit status 77: skipped, with the reason.
"""
import csv
import math
import os
import subprocess
import sys
import tempfile

try:
    import torch
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

CHECKPOINT = os.path.join(os.path.dirname(__file__), "../golden/net/ckpt.pth")
CONFIG = "data: {training_resolution: 16}\nmodel: {base_dim: 4, num_blocks: 1, attention_resolutions: [2]}\n"
CONVOLUTIONS = [(0, 64), (2, 64), (5, 128), (7, 128), (10, 256), (12, 256), (14, 256), (17, 512),
                (19, 512), (21, 512), (24, 512), (26, 512), (28, 512)]


def weights():
    torch.manual_seed(7)
    features, channels = {}, 3
    for layer, out in CONVOLUTIONS:
        weight = torch.randn(out, channels, 3, 3) * (2 / (9 * channels)) ** 0.5
        features[f"features.{layer}.weight"] = weight.to(memory_format=torch.channels_last)
        features[f"features.{layer}.bias"] = 0.1 * torch.randn(out)
        channels = out
    shared = torch.rand(1472)
    linear, start = {}, 0
    for k, out in enumerate((64, 128, 256, 512, 512)):
        linear[f"lin{k}.model.1.weight"] = shared[start:start + out].view(1, out, 1, 1)
        start += out
    return features, linear


def vkrun(*arguments):
    done = subprocess.run([sys.argv[1], *arguments], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"FAILED: vkrun {' '.join(arguments)}: {done.stderr}")


def scores(folder, name, files):
    out = os.path.join(folder, name)
    vkrun("eval", CHECKPOINT, "--config", os.path.join(folder, "config.yaml"), "--data",
          os.path.join(folder, "data"), "--out", out, "--lpips", files[0], "--lpips", files[1])
    with open(os.path.join(out, "per_object.csv"), encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [(float(row["lpips_novel"]), float(row["lpips_cond"])) for row in rows]


def main():
    with tempfile.TemporaryDirectory() as folder:
        vkrun("data", "synth", os.path.join(folder, "data"), "--objects", "0", "--test", "1",
              "--test-views", "4", "--size", "16")
        with open(os.path.join(folder, "config.yaml"), "w", encoding="utf-8") as file:
            file.write(CONFIG)
        found = {}
        for old in (True, False):
            paths = [os.path.join(folder, f"{name}-{old}.pth") for name in ("vgg16", "vgg")]
            for path, tensors in zip(paths, weights()):
                torch.save(tensors, path, _use_new_zipfile_serialization=not old)
            found[old] = scores(folder, f"eval-{old}", paths)
        print(f"LPIPS of novel and conditioning views: {found[True]}")
        if found[True] != found[False] or not all(math.isfinite(x) and x > 0 for x in found[True][0]):
            sys.exit(f"FAILED: with files of the present format: {found[False]}")


main()
