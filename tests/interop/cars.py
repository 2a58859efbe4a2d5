#!/usr/bin/env python3
"""Usage: tests/interop/cars.py TORCH_PEER

Loads a checkpoint of the full cars model with random weights, as torch.save writes it, in less than
10 seconds; predictions agree with PyTorch's within 2e-4. Exit status 77: skipped, with the
reason.
"""
import math
import os
import runpy
import subprocess
import sys
import tempfile

try:
    import numpy
    import torch
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

FOLDER = os.path.dirname(os.path.abspath(__file__))
BENCH = os.path.join(FOLDER, "..", "..", "tools", "bench", "torch_model.py")


def cars_model():
    program, sys.argv = sys.argv, [BENCH]
    bench = runpy.run_path(BENCH, run_name="bench")
    sys.argv = program
    return bench["build"](bench["Settings"](bench["OPTIONS"]))


def main():
    model = cars_model().eval()
    state = {}
    with torch.no_grad(), tempfile.TemporaryDirectory() as folder:
        for name, parameter in model.named_parameters():
            if parameter.dim() == 1:  # biases and norms are constants otherwise
                parameter.add_(0.05 * torch.randn_like(parameter))
        # Scales of the size that the published network starts with: 0.02 scene units.
        model.network_with_offset.out.bias[5:8] += math.log(0.02)
        for name, tensor in model.state_dict().items():
            layout = torch.channels_last if tensor.dim() == 4 else torch.contiguous_format
            state[name] = tensor.contiguous(memory_format=layout)
        path = lambda name: os.path.join(folder, name)
        torch.save({"iteration": 1, "loss": 0.5, "best_PSNR": 20.0, "model_state_dict": state},
                   path("model.pth"))
        images = torch.rand(1, 3, 128, 128)
        turn, _ = torch.linalg.qr(torch.randn(3, 3))
        turn = turn * torch.det(turn)
        half = 0.5 * (1 + turn.trace()).clamp(min=1e-6).sqrt()
        quaternion = torch.stack([half, (turn[2, 1] - turn[1, 2]) / (4 * half),
                                  (turn[0, 2] - turn[2, 0]) / (4 * half),
                                  (turn[1, 0] - turn[0, 1]) / (4 * half)])[None]
        quaternion = quaternion / quaternion.norm()
        v2w = torch.eye(4)[None].clone()
        v2w[0, :3, :3] = turn.T
        v2w[0, 3, :3] = torch.tensor([0.1, -0.2, 0.3])
        numpy.savez(path("in.npz"), images=images.numpy(), v2w=v2w.numpy(),
                    quaternion=quaternion.numpy())
        expected = model(images, v2w, quaternion)
        expected["sh"] = torch.cat([expected.pop("features_dc"), expected.pop("features_rest")], 2)
        done = subprocess.run([sys.argv[1], "predict", path("in.npz"), path("out.npz"),
                               path("model.pth")], check=True, capture_output=True, text=True)
        seconds = float(done.stdout)
        print(f"{sum(t.numel() for t in state.values())} numbers loaded in {seconds:.2f} s")
        with numpy.load(path("out.npz")) as out:
            wrong = {k: abs(out[k] - v.numpy()).max() for k, v in expected.items()}
            sizes = {k: abs(v).max().item() for k, v in expected.items()}
    for name, error in wrong.items():
        print(f"{name}: differs by up to {error:.1e}, numbers up to {sizes[name]:.2g}")
    if seconds >= 10 or not max(wrong.values()) < 2e-4:
        sys.exit("FAILED")
    print(f"all agree (PyTorch {torch.__version__})")


main()
