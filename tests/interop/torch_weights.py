#!/usr/bin/env python3
"""Usage: tests/interop/torch_weights.py VKRUN [MILLIONS]

vkrun reads checkpoints of PyTorch bit by bit, of its present format and of that before 1.6: every number type,
channels_last and other strides, shared storages, scalars, empty tensors, checkpoints and bare state dicts. NumPy
reads the npz files of vkrun, and PyTorch its .pth files, bit by bit. MILLIONS (2) is the size of the largest model.
Exit status 77: skipped, with the reason.
"""
import collections
import os
import subprocess
import sys
import tempfile
import time

try:
    import numpy
    import torch
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)


def small():
    """A state dict with one of everything."""
    generator = torch.Generator().manual_seed(1)
    base = torch.randn(4, 6, 3, 3, generator=generator)
    shared = torch.arange(24, dtype=torch.float32)
    return collections.OrderedDict(
        [
            ("plain", base),
            ("channels_last", base.to(memory_format=torch.channels_last)),
            ("transposed", base[:, :, 0, 0].t()),
            ("parameter", torch.nn.Parameter(base[1])),
            ("view", shared[3:15].view(3, 4)),
            ("strided", shared[1::3]),
            ("expanded", torch.tensor([[2.5]]).expand(3, 2)),
            ("scalar", torch.tensor(7.25)),
            ("empty", torch.zeros(0, 4)),
            ("double", base.double() / 3),
            ("half", base.half()),
            ("bfloat16", base.bfloat16()),
            ("int64", torch.arange(-3, 5)),
            ("int32", torch.arange(5, dtype=torch.int32)),
            ("int16", torch.arange(5, dtype=torch.int16)),
            ("int8", torch.arange(-2, 3, dtype=torch.int8)),
            ("uint8", torch.arange(5, dtype=torch.uint8)),
            ("bool", torch.tensor([True, False, True])),
        ]
    )


def large(millions):
    """Convolutions in channels_last order of about this many parameters."""
    count = max(1, round(millions * 1e6 / (512 * 512 * 9)))
    weights = {}
    for i in range(count):
        weight = torch.randn(512, 512, 3, 3)
        weights[f"block{i}.weight"] = weight.to(memory_format=torch.channels_last)
        weights[f"block{i}.bias"] = torch.randn(512)
    return weights


def checkpoint(tensors):
    """What a trainer saves, after a step of Adam."""
    parameter = torch.nn.Parameter(torch.ones(3))
    adam = torch.optim.Adam([parameter], lr=1e-3)
    parameter.sum().backward()
    adam.step()
    return {
        "iteration": 1234,
        "optimizer_state_dict": adam.state_dict(),
        "loss": float(numpy.float64(0.25)),
        "best_PSNR": numpy.float64(21.5),
        "model_state_dict": tensors,
    }


def vkrun(*arguments):
    done = subprocess.run([sys.argv[1], *arguments], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"FAILED: vkrun {' '.join(arguments)}: {done.stderr}")
    return done.stdout


def same(path, tensors, folder):
    out = os.path.join(folder, "out.npz")
    vkrun("weights", "convert", path, out, "--overwrite")
    with numpy.load(out) as read:
        if list(read.keys()) != list(tensors.keys()):
            sys.exit(f"FAILED: {path}: other names: {list(read.keys())}")
        for name, tensor in tensors.items():
            expected = tensor.detach().float().contiguous().numpy()
            if read[name].shape != expected.shape or not numpy.array_equal(read[name], expected):
                sys.exit(f"FAILED: {path}: '{name}' differs")


def written(path, content, folder):
    """PyTorch loads what vkrun writes, as the published code does."""
    out = os.path.join(folder, "out.pth")
    vkrun("weights", "convert", path, out, "--overwrite")
    tensors = content["model_state_dict"]
    # PyTorch 1.13 knows weights_only, but not the numbers of a checkpoint.
    safe = {"weights_only": True} if int(torch.__version__.split(".")[0]) >= 2 else {}
    loaded = torch.load(out, map_location="cpu", **safe)
    for name in ("iteration", "loss", "best_PSNR"):
        if type(loaded[name]) not in (int, float) or loaded[name] != content[name]:
            sys.exit(f"FAILED: {out}: {name} is {loaded[name]!r}")
    state = loaded["model_state_dict"]
    if type(state) is not collections.OrderedDict or list(state) != list(tensors):
        sys.exit(f"FAILED: {out}: other names")
    for name, tensor in tensors.items():
        expected = tensor.detach().float()
        if state[name].dtype != torch.float32 or not torch.equal(state[name], expected):
            sys.exit(f"FAILED: {out}: '{name}' differs")
    vkrun("weights", "convert", path, out, "--half", "--overwrite")
    state = torch.load(out, map_location="cpu", **safe)["model_state_dict"]
    if state["plain"].dtype != torch.half or not torch.equal(state["plain"], tensors["plain"].half()):
        sys.exit(f"FAILED: {out}: 'plain' differs in half precision")


def loads_strictly(folder):
    """load_state_dict() of a module takes a file that vkrun wrote."""
    module = torch.nn.Sequential(torch.nn.Conv2d(3, 4, 3), torch.nn.GroupNorm(2, 4))
    path = os.path.join(folder, "module.pth")
    torch.save(module.state_dict(), path)
    vkrun("weights", "convert", path, os.path.join(folder, "module.safetensors"))
    vkrun("weights", "convert", os.path.join(folder, "module.safetensors"), path, "--overwrite")
    other = torch.nn.Sequential(torch.nn.Conv2d(3, 4, 3), torch.nn.GroupNorm(2, 4))
    other.load_state_dict(torch.load(path, map_location="cpu")["model_state_dict"])
    image = torch.ones(1, 3, 5, 5)
    if not torch.equal(module(image), other(image)):
        sys.exit("FAILED: the module computes something else")


def main():
    millions = float(sys.argv[2]) if len(sys.argv) > 2 else 2
    with tempfile.TemporaryDirectory() as folder:
        tensors = small()
        for name, content in (("bare", tensors), ("checkpoint", checkpoint(tensors)),
                              ("nested", {"state_dict": tensors, "epoch": 3})):
            for old in (False, True):
                path = os.path.join(folder, name + ".pth")
                torch.save(content, path, _use_new_zipfile_serialization=not old)
                with open(path, "rb") as file:
                    if (file.read(2) == b"PK") == old:
                        sys.exit("FAILED: PyTorch does not write the format before 1.6")
                same(path, tensors, folder)
                if name == "checkpoint":
                    written(path, content, folder)
            print(f"{name}: {len(tensors)} tensors agree, in both formats")
        loads_strictly(folder)
        tensors = large(millions)
        path = os.path.join(folder, "large.pth")
        torch.save(checkpoint(tensors), path)
        same(path, tensors, folder)
        start = time.monotonic()
        vkrun("weights", "show", path, "--json")
        elements = sum(tensor.numel() for tensor in tensors.values())
        print(f"large: {elements} parameters agree; shown in {time.monotonic() - start:.2f} s")
    print(f"all agree (PyTorch {torch.__version__})")


main()
