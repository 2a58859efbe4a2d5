#!/usr/bin/env python3
"""Times the operator attention and PyTorch's scaled_dot_product_attention in turns, and their errors against float64.

    attention_peer.py [--tokens 1201 --heads 6 --channels 64] [--backward] [--rounds 5] [--library OTHER.so]

Queries, keys and values of normal numbers, one image. It needs PYTHONPATH=bindings/python/src, SPLAT_LIBRARY, NumPy and
PyTorch, which takes 2 threads and the layout [heads, tokens, channels]; libsplat takes [channels of all heads, tokens],
and its time includes both conversions between that and its own. --library is a second libsplat that takes turns in a
process of its own, such as the version before a change. Errors are relative L2, of the first and the last head.

Prints a line per library: shortest and median ms; half of the shortest processor time, which other work on the machine
changes less (set OMP_WAIT_POLICY=passive then, or PyTorch's threads count what they wait); then the error of y and,
with --backward, of the gradients of q, k and v.

Exit status  0 success, 2 wrong usage, 3 there is no PyTorch or libsplat
"""

import argparse
import os
import statistics
import subprocess
import sys
import time


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--tokens", type=int, default=1201)
    add("--heads", type=int, default=6)
    add("--channels", type=int, default=64, help="of a head")
    add("--backward", action="store_true", help="time forward and backward together")
    add("--rounds", type=int, default=5)
    add("--library", metavar="FILE", help="a second libsplat")
    add("--worker", action="store_true", help=argparse.SUPPRESS)
    return parser.parse_args()


def inputs(options):
    """q, k, v and the gradient of y: [1, heads * channels, tokens]."""
    random = np.random.default_rng(61)
    shape = (1, options.heads * options.channels, options.tokens)
    return [random.standard_normal(shape, dtype=np.float32) for _ in range(4)]


class Splat:
    """The operator of this process's libsplat."""

    def __init__(self, options):
        import libsplat
        device = libsplat.default_device()
        made = [libsplat.Tensor(device, array) for array in inputs(options)]
        zeros = lambda: libsplat.Tensor.zeros(device, made[0].shape)
        self.results = [zeros()] + [zeros() for _ in range(3 if options.backward else 0)]
        gradients = {"grad_outputs": made[3:], "grad_inputs": self.results[1:]} if options.backward else {}
        self.op = libsplat.Op(device, "attention", made[:3], self.results[:1],
                              attributes={"heads": options.heads}, **gradients)
        self.backward = options.backward

    def run(self):
        self.op.forward()
        if self.backward:
            self.op.backward()

    def tensors(self):
        return [np.array(tensor.numpy()) for tensor in self.results]


class Other:
    """The same of another process, with the library `file`."""

    def __init__(self, file):
        environment = dict(os.environ, SPLAT_LIBRARY=file)
        self.process = subprocess.Popen([sys.executable, *sys.argv, "--worker"], env=environment, text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def run(self):
        print("run", file=self.process.stdin, flush=True)
        return [float(number) for number in self.process.stdout.readline().split()]


class Torch:
    def __init__(self, options, dtype=None, heads=slice(None)):
        self.shape = (options.heads, options.channels, options.tokens)
        split = lambda array: torch.from_numpy(array).reshape(self.shape)[heads].transpose(1, 2).contiguous()
        arrays = [split(array).to(dtype or torch.float32) for array in inputs(options)]
        self.qkv = [array.requires_grad_(options.backward) for array in arrays[:3]]
        self.grad = arrays[3]
        self.backward = options.backward
        self.y = None

    def run(self):
        for tensor in self.qkv:
            tensor.grad = None
        with torch.set_grad_enabled(self.backward):
            self.y = torch.nn.functional.scaled_dot_product_attention(*(tensor[None] for tensor in self.qkv))[0]
            if self.backward:
                self.y.backward(self.grad)

    def tensors(self):
        results = [self.y.detach()] + [tensor.grad for tensor in self.qkv if self.backward]
        return [result.transpose(1, 2).numpy() for result in results]


def errors(options, tensors):
    """Relative L2 of results of all heads, by the first and the last."""
    squares = np.zeros((len(tensors), 2))
    for head in {0, options.heads - 1}:
        truth = Torch(options, torch.float64, slice(head, head + 1))
        truth.run()
        for i, (got, expected) in enumerate(zip(tensors, truth.tensors())):
            got = got.reshape(truth.shape)[head:head + 1]
            squares[i] += [np.sum((got - expected) ** 2), np.sum(expected ** 2)]
    return [f"{np.sqrt(a / b):.1e}" for a, b in squares]


def timed(run):
    """ms of the clock, and of the processors on two threads; or what another process has measured."""
    start = [time.perf_counter(), time.process_time() / 2]
    measured = run()
    return measured or [(time.perf_counter() - start[0]) * 1e3, (time.process_time() / 2 - start[1]) * 1e3]


def work(options):
    splat = Splat(options)
    for _ in sys.stdin:
        print(*timed(splat.run), flush=True)


def main():
    options = parse()
    if options.worker:
        return work(options)
    torch.set_num_threads(2)
    runs = {"libsplat": Splat(options), f"PyTorch {torch.__version__}": Torch(options)}
    if options.library:
        runs[options.library] = Other(options.library)
    times = {name: [] for name in runs}
    for _ in range(options.rounds + 1):
        for name, run in runs.items():
            times[name].append(timed(run.run))
    for name, run in runs.items():
        clock, processors = zip(*times[name][1:])  # the first run compiles
        found = [] if isinstance(run, Other) else errors(options, run.tensors())
        clocks = f"{min(clock):.1f}, {statistics.median(clock):.1f} ms"
        print(f"{name}: {clocks}; {min(processors):.1f};", *found, flush=True)
    return 0


try:
    import numpy as np
    import torch
except ImportError as missing:
    print(f"attention_peer.py: {missing}", file=sys.stderr)
    sys.exit(3)

if __name__ == "__main__":
    sys.exit(main())
