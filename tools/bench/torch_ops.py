#!/usr/bin/env python3
"""Operators of libsplat in PyTorch's float32, for `vkrun stress ops --peer`.

    torch_ops.py FOLDER

Prints "ready" with the operators that it has. Then it answers each line "run" with the time in ms: it reads
FOLDER/case.json (operator, attributes, names and shapes) and case.f32 (inputs, gradients of outputs), and writes
results.f32: outputs, then gradients of inputs that are not constant.
"""

import json
import math
import pathlib
import sys
import time

try:
    import torch
    import torch.nn.functional as F
except ImportError as missing:
    print(f"torch_ops.py: {missing}", file=sys.stderr)
    sys.exit(3)


def attention(a, q, k, v):
    heads = a.get("heads", 1)
    split = lambda x: x.flatten(2).unflatten(1, (heads, -1))
    q4, k4, v4 = split(q), split(k), split(v)
    weights = torch.softmax(torch.einsum("nhcq,nhck->nhqk", q4, k4 / math.sqrt(k4.shape[2])), dim=3)
    return torch.einsum("nhqk,nhck->nhcq", weights, v4).reshape(q.shape)


def conv2d(a, x, weight, bias=None, residual=None):
    pad = weight.shape[-1] // 2
    y = F.conv2d(F.pad(x, [pad] * 4, mode="replicate" if a.get("replicate") else "constant"), weight, bias)
    return (y if residual is None else y + residual) * a.get("scale", 1)


def group_norm(a, x, gamma, beta):
    y = F.group_norm(x, a["groups"], gamma, beta, a.get("eps", 1e-5))
    return F.silu(y) if a.get("silu") else y


def pad2d(a, x):
    sides = [a.get(side, 0) for side in ("left", "right", "top", "bottom")]
    return F.pad(x, sides, mode="replicate" if a.get("replicate") else "constant")


def patches2d(a, x):
    return (F.pixel_shuffle if a.get("up") else F.pixel_unshuffle)(x, a.get("size", 2))


def resize2d(a, x):
    scales = (a.get("scale_y"), a.get("scale_x"))
    how = {"scale_factor": scales} if all(scales) else {"size": (a["height"], a["width"])}
    return F.interpolate(x, mode="bicubic" if a.get("filter") else "bilinear", align_corners=False,
                         antialias=a.get("antialias", False), **how)


OPS = {
    "add": lambda a, x, y: (x + y) * a.get("scale", 1),
    "attention": attention,
    "clamp": lambda a, x: torch.clamp(x, a.get("least"), a.get("most")) if a else x * 1,
    "conv2d": conv2d,
    "exp": lambda a, x: torch.exp(x),
    "gelu": lambda a, x: F.gelu(x, approximate="tanh" if a.get("tanh") else "none"),
    "group_norm": group_norm,
    "l1": lambda a, x, y: F.l1_loss(x, y).reshape(1),
    "l2": lambda a, x, y: F.mse_loss(x, y).reshape(1),
    "layer_norm": lambda a, x, gamma, beta: F.layer_norm(
        x.movedim(1, -1), gamma.shape, gamma, beta, a.get("eps", 1e-6)).movedim(-1, 1),
    "linear": lambda a, x, weight, bias=None: F.linear(x, weight, bias),
    "max_pool2d": lambda a, x: F.max_pool2d(x, 2),
    "pad2d": pad2d,
    "patches2d": patches2d,
    "relu": lambda a, x: F.relu(x),
    "resize2d": resize2d,
    "sigmoid": lambda a, x: torch.sigmoid(x),
    "silu": lambda a, x: F.silu(x),
    "softplus": lambda a, x: F.softplus(x),
    "tanh": lambda a, x: torch.tanh(x),
}


def run(folder):
    case = json.loads((folder / "case.json").read_text())
    numbers = torch.frombuffer(bytearray((folder / "case.f32").read_bytes()), dtype=torch.float32)

    def tensor(entry):
        if not entry["dims"]:
            return None
        count = math.prod(entry["dims"])
        return numbers[entry["at"]:entry["at"] + count].clone().reshape(entry["dims"])

    inputs = [tensor(entry) for entry in case["inputs"]]
    free = [x for x, entry in zip(inputs, case["inputs"]) if x is not None and not entry["constant"]]
    for x in free:
        x.requires_grad_()
    y = OPS[case["op"]](case["attributes"] or {}, *inputs)
    y.backward(tensor(case["outputs"][0]).reshape(y.shape))
    with open(folder / "results.f32", "wb") as file:
        for result in [y.detach()] + [x.grad for x in free]:
            file.write(result.contiguous().numpy().tobytes())


def main():
    folder = pathlib.Path(sys.argv[1])
    torch.set_num_threads(2)
    print("ready", json.dumps({"torch": torch.__version__, "ops": sorted(OPS)}), flush=True)
    for line in sys.stdin:
        if line.strip() == "quit":
            break
        start = time.perf_counter()
        run(folder)
        print(f"{(time.perf_counter() - start) * 1e3:.6f}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
