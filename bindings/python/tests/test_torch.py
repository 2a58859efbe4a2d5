"""PyTorch: gradients against float64 autograd, passes in flight, modules, refusals."""
import unittest
from typing import Any, Tuple

import splat
from shared import PYTHON, Case, run_program

try:
    import splat.torch
    from splat.torch import torch
except ImportError as error:
    raise unittest.SkipTest(str(error))


def gaussians(count: int = 30) -> Any:
    """Gaussians in front of a camera at the origin."""
    torch.manual_seed(3)
    given = [torch.rand(count, 3) * 2 - 1, torch.rand(count, 3) / 5 + 0.05,
             torch.rand(count, 4) + 0.1, torch.rand(count) * 0.6 + 0.1, torch.rand(count, 3)]
    given[0] += torch.tensor([0.0, 0, 4])
    given[2] /= given[2].norm(dim=1, keepdim=True)
    return [each.requires_grad_() for each in given]


CAMERA = splat.Camera(24, 20, 24)
draw: Any = splat.torch.rasterize  # lists of tensors are spread over its arguments


def reference(means: Any, scales: Any, turns: Any, opacities: Any, colors: Any) -> Any:
    """EWA splatting in plain torch: [20,24,3]."""
    w, x, y, z = turns.unbind(1)  # the convention "3dgs" takes quaternions as they are
    turn = torch.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
                       1).reshape(-1, 3, 3)
    px, py, pz = means.unbind(1)
    zero = torch.zeros_like(pz)
    slope = torch.stack([24 / pz, zero, -24 * px / pz**2, zero, 24 / pz, -24 * py / pz**2],
                        1).reshape(-1, 2, 3)
    half = slope @ turn * scales[:, None]
    conic = torch.inverse(half @ half.transpose(1, 2) + 0.3 * torch.eye(2, dtype=means.dtype))
    rows, columns = torch.meshgrid(torch.arange(20).double() + 0.5, torch.arange(24).double() + 0.5,
                                   indexing="ij")
    image, through = torch.zeros(20, 24, 3, dtype=means.dtype), torch.ones(20, 24)
    for i in torch.argsort(pz).tolist():
        d = torch.stack([columns - (24 * px[i] / pz[i] + 12), rows - (24 * py[i] / pz[i] + 10)], -1)
        alpha = opacities[i] * torch.exp(-0.5 * ((d @ conic[i]) * d).sum(-1))
        alpha = torch.where(alpha < 1 / 255, torch.zeros_like(alpha), alpha)
        image = image + (through * alpha)[..., None] * colors[i]
        through = through * (1 - alpha)
    return image


class Torch(Case):
    """Autograd through the library."""

    def test_gradients_match_float64(self) -> None:
        given = gaussians()
        exact = [each.detach().double().requires_grad_() for each in given]
        weight = torch.rand(20, 24, 3)
        drawn = draw(*given, CAMERA)
        (drawn.images[0] * weight).sum().backward()
        image = reference(*exact)
        (image * weight).sum().backward()
        self.assertLess(float((drawn.images[0] - image).abs().max()), 1e-3)
        for one, two in zip(given, exact):
            self.assertLess(float((one.grad - two.grad).abs().max() / two.grad.abs().max()), 1e-3)

    def test_two_passes_in_flight(self) -> None:
        one, two = gaussians(), gaussians(20)
        alone = [torch.autograd.grad(draw(*each, CAMERA).images.square().sum(),
                                     each) for each in (one, two)]
        losses = [draw(*each, CAMERA).images.square().sum()
                  for each in (one, two)]
        second = torch.autograd.grad(losses[1], two)
        first = torch.autograd.grad(losses[0], one)
        for got, expected in zip([*first, *second], [*alone[0], *alone[1]]):
            self.assertTrue(torch.equal(got, expected))

    def test_modules(self) -> None:
        calls = torch.nn.functional
        cases: Tuple[Any, ...] = (
            ("linear", {"x": (2, 3), "weight": (4, 3), "bias": (4,)}, calls.linear),
            ("conv2d", {"x": (1, 2, 5, 5), "weight": (3, 2, 3, 3), "bias": (3,)},
             lambda *v: calls.conv2d(*v, padding=1)),
            ("silu", {"x": (1, 4, 2, 2)}, calls.silu))
        for kind, shapes, function in cases:
            module = splat.torch.Module(kind, shapes, seed=1)
            x = (torch.rand(shapes["x"]) - 0.5).requires_grad_()
            inputs = [x, *module.parameters()]
            exact = [each.detach().double().requires_grad_() for each in inputs]
            y, z = module(x), function(*exact)
            got = [y, *torch.autograd.grad(y.square().sum(), inputs)]
            wanted = [z, *torch.autograd.grad(z.square().sum(), exact)]
            for a, b in zip(got, wanted):
                self.assertLess(float((a - b).abs().max() / b.abs().max()), 1e-5, kind)

    def test_bad_input(self) -> None:
        given = gaussians()
        self.refused(splat.InvalidArgument, "float64", draw, given[0].double(), *given[1:], CAMERA)
        self.refused(splat.InvalidArgument, "meta", draw, given[0].to("meta"), *given[1:], CAMERA)
        self.refused(splat.ShapeMismatch, "scales", draw, given[0], given[1][:9], *given[2:],
                     CAMERA)
        slope, = torch.autograd.grad(draw(*given, CAMERA).images.square().sum(), given[0],
                                     create_graph=True)
        with self.assertRaisesRegex(RuntimeError, "once_differentiable"):
            slope.sum().backward()

    def test_the_example_fits_a_picture(self) -> None:
        example = PYTHON / "examples" / "fit_torch.py"
        status, told, errors = run_program(example.read_text(encoding="utf-8"))
        self.assertEqual(status, 0, errors)
        self.assertGreaterEqual(float(told.split(" dB")[0]), 30, told)
