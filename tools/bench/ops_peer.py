#!/usr/bin/env python3
"""Times operators and PyTorch's on the CPU in turns, with the errors of both against PyTorch in float64.

    ops_peer.py [--only NAME,...] [--rounds 7] [--write]

The sizes are those of MoGe-2's and LGM's layers. libsplat's time is that of its kernels alone: the conversion between
its layout and rows is the graph's, once at its edges. PyTorch has two threads. It needs PYTHONPATH=bindings/python/src,
SPLAT_LIBRARY, NumPy and PyTorch.

Prints a table of shortest and median ms, forward and then backward alone; errors are relative L2, of the output, and
the largest of the gradients. --write replaces the table in BENCHMARKS.md.

Exit status  0 success, 2 wrong usage, 3 there is no PyTorch or libsplat
"""

import argparse
import os
import pathlib
import statistics
import sys
import time

try:
    import libsplat
    import numpy as np
    import torch
    from torch_ops import OPS
except ImportError as missing:
    print(f"ops_peer.py: {missing}", file=sys.stderr)
    sys.exit(3)

BENCHMARKS = pathlib.Path(__file__).parents[2] / "BENCHMARKS.md"
BEGIN, END = "<!-- ops_peer -->", "<!-- /ops_peer -->"
IMAGE = (1, 128, 120, 160)
TOKENS = (1, 384, 1, 1201)
CASES = [  # operator, attributes, shapes of the inputs, None of an absent one
    ("layer_norm", {"eps": 1e-6}, [TOKENS, (384,), (384,)]),
    ("attention", {"heads": 6}, [TOKENS] * 3),
    ("attention", {"heads": 16}, [(1, 1024, 64, 64)] * 3),
    ("conv2d", {"precision": 2, "replicate": True}, [IMAGE, (128, 128, 3, 3), (128,), None]),
    ("conv2d", {}, [TOKENS, (1536, 384, 1, 1), (1536,), None]),
    ("patches2d", {"size": 14}, [(1, 3, 420, 560)]),
    ("patches2d", {"size": 2, "up": True}, [(1, 256, 120, 160)]),
    ("pad2d", {"left": 1, "right": 1, "top": 1, "bottom": 1, "replicate": True}, [IMAGE]),
    ("resize2d", {"width": 320, "height": 240}, [(1, 64, 120, 160)]),
    ("resize2d", {"width": 40, "height": 30, "filter": 1}, [(1, 384, 37, 37)]),
    ("resize2d", {"width": 560, "height": 420, "antialias": True}, [(1, 3, 750, 1000)]),
    ("softplus", {}, [IMAGE]),
    ("tanh", {}, [IMAGE]),
    ("exp", {}, [IMAGE]),
    ("clamp", {"least": -2, "most": 1}, [IMAGE]),
]


class Splat:
    def __init__(self, device, name, attributes, arrays, grad):
        self.device = device
        inputs = [None if array is None else libsplat.Tensor(device, array) for array in arrays]
        zeros = [None if array is None else libsplat.Tensor.zeros(device, array.shape) for array in [grad, *arrays]]
        self.results = [result for result in zeros if result is not None]
        self.op = libsplat.Op(device, name, inputs, zeros[:1], attributes=attributes,
                              grad_outputs=[libsplat.Tensor(device, grad)], grad_inputs=zeros[1:])

    def time(self, run):
        """ms of the kernels but conversions."""
        self.device.reset_profile()
        run()
        return sum(row["total_ms"] for row in self.device.profile()["ops"]
                   if not row["op"].startswith("quads_") and "_pack" not in row["op"])

    def run(self):
        return [self.time(self.op.forward), self.time(self.op.backward)]

    def tensors(self):
        return [np.array(result.numpy()) for result in self.results]


class Torch:
    def __init__(self, name, attributes, arrays, grad, dtype):
        attributes = {key: value for key, value in attributes.items() if key != "precision"}
        self.inputs = [torch.from_numpy(array).to(dtype).requires_grad_() for array in arrays
                       if array is not None]
        self.grad = torch.from_numpy(grad).to(dtype)
        self.call = lambda: OPS[name](attributes, *self.inputs)

    def run(self):
        for tensor in self.inputs:
            tensor.grad = None
        start = time.perf_counter()
        self.y = self.call()
        middle = time.perf_counter()
        self.y.backward(self.grad)
        return [(middle - start) * 1e3, (time.perf_counter() - middle) * 1e3]

    def tensors(self):
        return [tensor.numpy() for tensor in (self.y.detach(), *(tensor.grad for tensor in self.inputs))]


def relative(got, expected):
    return np.linalg.norm(got - expected) / max(np.linalg.norm(expected), 1e-300)


def rows_of(device, case, rounds):
    name, attributes, shapes = case
    random = np.random.default_rng(61)
    arrays = [None if shape is None else random.standard_normal(shape, np.float32) for shape in shapes]
    if name == "conv2d":
        arrays[1] /= np.float32(np.sqrt(np.prod(shapes[1][1:])))
    truth = Torch(name, attributes, arrays, np.zeros(0, np.float32), torch.float64)
    grad = random.standard_normal(tuple(truth.call().shape), np.float32)
    truth.grad = torch.from_numpy(grad).double()
    truth.run()
    runs = [Splat(device, name, attributes, arrays, grad), Torch(name, attributes, arrays, grad, torch.float32)]
    times = [[], []]
    for turn in range(rounds + 1):
        for run, found in zip(runs, times):
            measured = run.run()
            if turn:  # the first compiles
                found.append(measured)
    errors = [[relative(got, expected) for got, expected in zip(run.tensors(), truth.tensors())] for run in runs]
    title = " ".join([name, ",".join(map(str, shapes[0])),
                      *(f"{key}={value}".lower() for key, value in attributes.items())])
    for i, direction in enumerate(("forward", "backward")):
        clocks = [[measured[i] for measured in found] for found in times]
        worst = [one[0] if i == 0 else max(one[1:]) for one in errors]
        yield (f"| {title if i == 0 else ''} | {direction} | "
               + " | ".join(f"{min(clock):.2f}, {statistics.median(clock):.2f}" for clock in clocks)
               + f" | **{min(clocks[1]) / min(clocks[0]):.2f}** | " + " | ".join(f"{one:.1e}" for one in worst) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", metavar="NAMES", type=lambda text: text.split(","))
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    load = os.getloadavg()[0]
    torch.set_num_threads(2)
    device = libsplat.Device(profile=True)
    lines = [f"Load {load:.1f} before.", "",
             f"| operator | direction | libsplat | PyTorch {torch.__version__} | speed by PyTorch's | error | PyTorch's |",
             "|---|---|---|---|---|---|---|"]
    for case in CASES:
        if options.only is None or case[0] in options.only:
            lines += rows_of(device, case, options.rounds)
            print("\n".join(lines[-2:]), file=sys.stderr, flush=True)
    text = "\n".join(lines)
    print(text)
    if options.write:
        before, begin, rest = BENCHMARKS.read_text().partition(BEGIN)
        if not begin:
            sys.exit(f"{BENCHMARKS} has no line {BEGIN}")
        BENCHMARKS.write_text(f"{before}{BEGIN}\n{text}\n{END}{rest.partition(END)[2]}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
