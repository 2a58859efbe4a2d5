#!/usr/bin/env python3
"""Usage: tests/interop/lpips.py TORCH_PEER

Compares LPIPS with random weights of VGG16's shapes, its value and its gradient by the render, with the same
formula in PyTorch, within 1e-4. Weights come as two files with the names of torchvision and of the lpips
package, in the format before PyTorch 1.6 as theirs are, and as one state dict of lpips.LPIPS. Exit status 77:
skipped, with the reason.
"""
import os
import subprocess
import sys
import tempfile

try:
    import numpy
    import torch
    import torch.nn.functional as F
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

# Places in torchvision's vgg16.features, by the layers that are compared; pooling lies between them.
STAGES = [([0, 2], 64), ([5, 7], 128), ([10, 12, 14], 256), ([17, 19, 21], 512), ([24, 26, 28], 512)]
SHIFT = torch.tensor([-.030, -.088, -.188]).view(1, 3, 1, 1)
SCALE = torch.tensor([.458, .448, .450]).view(1, 3, 1, 1)


def random_weights():
    torch.manual_seed(5)
    features, linear = {}, {}
    channels = 3
    for k, (layers, out) in enumerate(STAGES):
        for layer in layers:
            features[f"features.{layer}.weight"] = torch.randn(out, channels, 3, 3) * (
                2 / (9 * channels)) ** 0.5
            features[f"features.{layer}.bias"] = 0.1 * torch.randn(out)
            channels = out
        linear[f"lin{k}.model.1.weight"] = torch.rand(1, out, 1, 1)
    return features, linear


def features_of(image, weights):
    x = (2 * image - 1 - SHIFT.to(image)) / SCALE.to(image)
    for k, (layers, _) in enumerate(STAGES):
        if k > 0:
            x = F.max_pool2d(x, 2, 2)
        for layer in layers:
            x = F.relu(F.conv2d(x, weights[f"features.{layer}.weight"],
                                weights[f"features.{layer}.bias"], padding=1))
        yield x / (x.square().sum(1, keepdim=True).sqrt() + 1e-10)


def lpips(render, target, weights):
    value = 0
    for k, (a, b) in enumerate(zip(features_of(render, weights), features_of(target, weights))):
        value = value + F.conv2d((a - b) ** 2, weights[f"lin{k}.model.1.weight"]).mean((2, 3))
    return value


@torch.enable_grad()
def value_and_gradient(render, target, grad, weights):
    image = render.clone().requires_grad_()
    value = lpips(image, target, weights)
    value.backward(grad)
    return value.detach().flatten(1).numpy(), image.grad.numpy()


def as_one(features, linear):
    """The names of a state dict of lpips.LPIPS."""
    named = dict(linear)
    for k, (layers, _) in enumerate(STAGES):
        for layer in layers:
            for part in ("weight", "bias"):
                named[f"net.slice{k + 1}.{layer}.{part}"] = features[f"features.{layer}.{part}"]
    named["scaling_layer.shift"] = SHIFT
    return named


def compare(what, got, exact, single):
    """`exact` is of float64, `single` of float32. A rectifier or a maximum that is within rounding of its
    edge goes either way, which changes the gradient by up to 1e-3; PyTorch's two implementations differ as much."""
    norm = numpy.linalg.norm(exact)
    errors = [numpy.linalg.norm(got - other) / norm for other in (exact, single)]
    own = numpy.linalg.norm(single - exact) / norm
    print(f"{what}: {errors[0]:.1e} of its norm from PyTorch's float64, {errors[1]:.1e} from its "
          f"float32, which are {own:.1e} apart")
    if got.shape != exact.shape or not min(errors) <= 1e-4:
        sys.exit(f"FAILED: {what}")


def main():
    features, linear = random_weights()
    single = {**features, **linear}
    double = {k: v.double() for k, v in single.items()}
    with torch.no_grad(), tempfile.TemporaryDirectory() as folder:
        path = lambda name: os.path.join(folder, name)
        torch.save(features, path("vgg16.pth"), _use_new_zipfile_serialization=False)
        torch.save(linear, path("lin.pth"), _use_new_zipfile_serialization=False)
        torch.save(as_one(features, linear), path("all.pth"))
        for side, files in ((32, ["vgg16.pth", "lin.pth"]), (35, ["all.pth"])):
            render = torch.rand(2, 3, side, side) * 1.2 - 0.1
            target = (render + 0.2 * torch.randn(2, 3, side, side)).clamp(0, 1)
            grad = torch.tensor([[1.0], [-0.5]])
            numpy.savez(path("in.npz"), render=render.numpy(), target=target.numpy(),
                        grad=grad.numpy())
            subprocess.run([sys.argv[1], "lpips", path("in.npz"), path("out.npz"),
                            *map(path, files)], check=True)
            pairs = [value_and_gradient(render.to(kind), target.to(kind), grad.to(kind), weights)
                     for kind, weights in ((torch.double, double), (torch.float, single))]
            with numpy.load(path("out.npz")) as out:
                for i, name in enumerate(("value", "grad_render")):
                    compare(f"{side} pixels, {name}", out[name], pairs[0][i], pairs[1][i])
            os.remove(path("out.npz"))
    print(f"all agree (PyTorch {torch.__version__})")


main()
