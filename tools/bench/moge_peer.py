#!/usr/bin/env python3
"""Times MoGe-2's smallest network and ONNX Runtime in turns on the same random weights, with errors against float64.

    moge_peer.py [--rows 30 --columns 40] [--rounds 5] [--folder DIR] [--profile] [--write]

A picture of noise of 14 pixels a patch. Both have two threads. libsplat's time is that of PriorModel.run, from bytes to
maps; ONNX Runtime's of the whole network. It needs PYTHONPATH=bindings/python/src, SPLAT_LIBRARY, NumPy, PyTorch with
onnx, and onnxruntime. --folder keeps the weights and the exported model, which else go to a temporary folder.

Prints for each: shortest and median s, half of the shortest processor time, and relative L2 of normals and mask
against PyTorch in float64; then the ratio of speeds and the load of the machine before. --profile prints the kernels of
one more pass. --write replaces the table in BENCHMARKS.md.

Exit status  0 success, 2 wrong usage, 3 something that it needs is missing
"""

import argparse
import os
import pathlib
import statistics
import sys
import tempfile
import time

try:
    import libsplat
    import numpy as np
    import onnxruntime
    import torch
    import torch_moge
except ImportError as missing:
    print(f"moge_peer.py: {missing}", file=sys.stderr)
    sys.exit(3)

BENCHMARKS = pathlib.Path(__file__).parents[2] / "BENCHMARKS.md"
BEGIN, END = "<!-- moge_peer -->", "<!-- /moge_peer -->"


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--rows", type=int, default=30)
    add("--columns", type=int, default=40)
    add("--rounds", type=int, default=5)
    add("--folder", metavar="DIR")
    add("--profile", action="store_true")
    add("--write", action="store_true")
    return parser.parse_args()


def files_in(folder, options, weights):
    """Weights for libsplat and the model for ONNX Runtime, made unless they are there."""
    tensors = folder / "moge.safetensors"
    model = folder / f"moge_{options.rows}x{options.columns}.onnx"
    if not tensors.exists():
        torch_moge.write_safetensors(tensors, weights)
    if not model.exists():
        torch_moge.export(str(model), weights, options.rows, options.columns)
    return tensors, model


def runner_of_onnx(model, image):
    settings = onnxruntime.SessionOptions()
    settings.intra_op_num_threads = 2
    settings.add_session_config_entry("session.intra_op.allow_spinning", "0")  # processor time of work alone
    session = onnxruntime.InferenceSession(str(model), settings, providers=["CPUExecutionProvider"])
    given = {"image": image}

    def run():
        _, normals, mask, _ = session.run(None, given)
        return normals[0], mask[0]

    return run


def runner_of_splat(tensors, picture, tokens, profile):
    device = libsplat.Device(profile=profile)
    model = libsplat.PriorModel("moge-2-vits-normal", str(tensors), tokens=tokens, numbers=True, device=device)

    def run():
        maps = model.run(picture, ["normal", "mask"], np.float32)
        return maps["normal"], maps["mask"]

    return run, device


def timed(run):
    start = time.perf_counter(), time.process_time()
    results = run()
    return results, time.perf_counter() - start[0], (time.process_time() - start[1]) / 2


def relative(got, expected):
    got = np.asarray(got, np.float64).reshape(expected.shape)
    return np.linalg.norm(got - expected) / np.linalg.norm(expected)


def table(options, names, times, found, truth, load):
    lines = [f"{options.rows * options.columns:,} tokens, {options.rounds} rounds in turns, load {load:.1f} before:", "",
             "| | shortest s | median s | processors s | error of normals | of the mask |", "|---|---|---|---|---|---|"]
    for name in names:
        clock, processors = zip(*times[name])
        errors = [f"{relative(got, expected):.1e}" for got, expected in zip(found[name], truth)]
        lines.append(f"| {name} | {min(clock):.2f} | {statistics.median(clock):.2f} | {min(processors):.2f} | "
                     + " | ".join(errors) + " |")
    ratios = [pick(t[i] for t in times[names[1]]) / pick(t[i] for t in times[names[0]])
              for i, pick in ((0, min), (0, statistics.median), (1, min))]
    lines.append("| speed of libsplat by that of ONNX Runtime | "
                 + " | ".join(f"**{ratio:.2f}**" for ratio in ratios) + " | | |")
    return "\n".join(lines)


def main():
    options = parse()
    load = os.getloadavg()[0]
    torch.set_num_threads(2)
    weights = torch_moge.random_weights()
    picture = np.random.default_rng(61).integers(
        0, 256, (options.rows * torch_moge.PATCH, options.columns * torch_moge.PATCH, 3), np.uint8)
    image = (picture / 255).astype(np.float32).transpose(2, 0, 1)[None].copy()
    with tempfile.TemporaryDirectory() as temporary:
        tensors, model = files_in(pathlib.Path(options.folder or temporary), options, weights)
        splat, device = runner_of_splat(tensors, picture, options.rows * options.columns, options.profile)
        runs = {"libsplat": splat, f"ONNX Runtime {onnxruntime.__version__}": runner_of_onnx(model, image)}
        times, found = {name: [] for name in runs}, {}
        for turn in range(options.rounds + 2):  # the first two compile and prepare weights
            for name, run in runs.items():
                found[name], clock, processors = timed(run)
                if turn > 1:
                    times[name].append((clock, processors))
        if options.profile:
            device.reset_profile()
            splat()
            print(device.profile_table())
    network = torch_moge.Moge(weights, options.rows, options.columns, torch.float64)
    with torch.no_grad():
        _, normals, mask, _ = network(torch.from_numpy(picture / 255).permute(2, 0, 1)[None])
    text = table(options, list(runs), times, found, (normals[0].numpy(), mask[0].numpy()), load)
    print(text)
    if options.write:
        before, begin, rest = BENCHMARKS.read_text().partition(BEGIN)
        if not begin:
            sys.exit(f"{BENCHMARKS} has no line {BEGIN}")
        BENCHMARKS.write_text(f"{before}{BEGIN}\n{text}\n{END}{rest.partition(END)[2]}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
