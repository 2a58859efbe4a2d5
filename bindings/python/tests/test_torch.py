"""PyTorch: gradients against float64 autograd, passes in flight, modules, refusals."""
import copy
import gc
import io
import unittest
import weakref
from typing import Any, Optional, Tuple, get_type_hints

import libsplat as splat
from shared import PYTHON, Case, cameras, picture, run_program, scene

try:
    from libsplat import torch as bridge
    from libsplat.torch import torch
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
draw: Any = bridge.rasterize  # lists of tensors are spread over its arguments


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
            module = bridge.Module(kind, shapes, seed=1)
            x = (torch.rand(shapes["x"]) - 0.5).requires_grad_()
            inputs = [x, *module.parameters()]
            exact = [each.detach().double().requires_grad_() for each in inputs]
            y, z = module(x), function(*exact)
            got = [y, *torch.autograd.grad(y.square().sum(), inputs)]
            wanted = [z, *torch.autograd.grad(z.square().sum(), exact)]
            for a, b in zip(got, wanted):
                self.assertLess(float((a - b).abs().max() / b.abs().max()), 1e-5, kind)

    def test_modules_are_copied_and_saved(self) -> None:
        shapes = {"x": (2, 3), "weight": (4, 3), "bias": (4,)}
        module, x = bridge.Module("linear", shapes, seed=1), torch.rand(2, 3)
        self.assertEqual(repr(module), "Module('linear', x=[2,3], weight=[4,3], bias=[4])")
        file = io.BytesIO()
        torch.save(torch.nn.Sequential(module).eval(), file)
        file.seek(0)
        newer = {"weights_only": False} if hasattr(torch.serialization, "add_safe_globals") else {}
        for again in (copy.deepcopy(module), torch.load(file, **newer)[0]):
            self.assertTrue(torch.equal(again(x), module(x)))
            again(x).sum().backward()
            self.assertIsNone(module.weight.grad)
            with torch.no_grad():
                again.weight += 1
            self.assertFalse(torch.equal(again(x), module(x)))
        self.assertFalse(again.training)
        self.assertIs(copy.deepcopy(module).native._device, module.native._device)

    def test_what_torch_takes(self) -> None:
        given = splat.Image(picture())
        if hasattr(torch.serialization, "add_safe_globals"):  # older ones ask for number after number
            self.assertTrue(torch.equal(torch.as_tensor(given), torch.from_numpy(picture())))
        self.assertTrue(torch.equal(torch.from_dlpack(given), torch.from_numpy(picture())))
        file = io.BytesIO()
        torch.save([CAMERA], file)
        file.seek(0)
        self.assertEqual(torch.load(file), [CAMERA])

    def test_types_of_what_is_drawn(self) -> None:
        hints = get_type_hints(bridge.Drawn, None, {"Values": torch.Tensor})
        self.assertEqual((hints["images"], hints["alpha"], hints["depth"]),
                         (torch.Tensor, torch.Tensor, Optional[torch.Tensor]))

    def test_memory_is_released(self) -> None:
        device = splat.Device()
        given = gaussians()
        slopes = []
        for _ in range(2):
            drawn = [draw(*given, CAMERA, device=device) for _ in range(5)]
            held = device.memory.live_bytes
            bridge.release_memory()
            slopes += [torch.autograd.grad(each.images.sum(), given[0])[0] for each in drawn]
            del drawn
            gc.collect()
            bridge.release_memory()
            self.assertLess(device.memory.live_bytes, held // 100)
        for each in slopes:
            self.assertTrue(torch.equal(each, slopes[0]))

    def test_a_refusal_spoils_nothing(self) -> None:
        given = gaussians()
        bad = [*given[:3], given[3][:, None], given[4]]
        expected = draw(*given, CAMERA).images
        for _ in range(40):
            self.refused(splat.ShapeMismatch, "opacities", draw, *bad, CAMERA)
            gc.collect()
            self.assertTrue(torch.equal(draw(*given, CAMERA).images, expected))

    def test_a_graph_in_a_cycle_spoils_nothing(self) -> None:
        given = gaussians()
        for _ in range(3):
            drawn = draw(*given, CAMERA).images
            drawn.grad_fn.metadata["me"] = cycle = [drawn.grad_fn.next_functions]
            cycle.append(cycle)
            holder: Any = [drawn]
            holder.append(holder)
            del drawn, cycle, holder
            gc.collect()
            draw(*given, CAMERA).images.sum().backward()

    def test_a_refusal_leaves_nothing(self) -> None:
        given = gaussians()
        bad = [*given[:3], given[3][:, None], given[4]]
        gc.collect()
        gc.disable()
        try:
            live = []
            for _ in range(4):
                try:
                    draw(*bad, CAMERA)
                except splat.ShapeMismatch as error:
                    held = weakref.ref(error)
                self.assertIsNone(held())
                live.append(splat.default_device().memory.live_bytes)
            self.assertEqual(live, live[:1] * 4)
        finally:
            gc.enable()

    def test_a_background_gets_its_gradient(self) -> None:
        given, behind = gaussians(), torch.tensor([0.2, 0.5, 0.9], requires_grad=True)
        views = [CAMERA, splat.Camera(24, 20, 30)]
        weight = torch.rand(2, 20, 24, 3)
        drawn = draw(*given, views, behind)
        ((drawn.images * weight).sum() + drawn.alpha.square().sum()).backward()
        exact = ((1 - drawn.alpha.detach().double())[..., None] * weight.double()).sum((0, 1, 2))
        self.assertLess(float((behind.grad - exact).abs().max() / exact.max()), 1e-6)

        def loss(color: Any) -> Any:
            with torch.no_grad():
                return (draw(*given, views, color).images.double() * weight).sum()

        for index in range(3):  # the image is linear in the background
            step = torch.eye(3)[index] / 4
            slope = (loss(behind + step) - loss(behind - step)) * 2
            self.assertLess(abs(float(behind.grad[index] / slope) - 1), 1e-5)
        plain = draw(*given, views, [0.2, 0.5, 0.9]).images
        self.assertTrue(torch.equal(plain, drawn.images))

    def test_backgrounds_of_other_kinds(self) -> None:
        given = [each.detach() for each in gaussians()]
        for number in (torch.float64, torch.float32, torch.float16, torch.bfloat16):
            behind = torch.tensor([0.25, 0.5, 1], dtype=number, requires_grad=True)
            draw(*given, CAMERA, behind).images.sum().backward()
            self.assertEqual((behind.grad.dtype, behind.grad.shape), (number, (3,)))
        none = [each[:0] for each in given]
        behind = torch.zeros(3, requires_grad=True)
        drawn = draw(*none, CAMERA, behind)
        (drawn.images * torch.tensor([1.0, 2, 3])).sum().backward()
        self.assertEqual(behind.grad.tolist(), [480, 960, 1440])
        drawn.alpha.sum().backward()  # the background has no part in it
        self.assertEqual(behind.grad.tolist(), [480, 960, 1440])
        self.refused(splat.ShapeMismatch, "background", draw, *given, CAMERA, torch.ones(1, 3))
        self.refused(splat.InvalidArgument, "background", draw, *given, CAMERA, [*behind])
        self.refused(splat.InvalidArgument, "meta", draw, *given, CAMERA,
                     torch.ones(3, device="meta"))

    @unittest.skipUnless(hasattr(torch, "compile"), "this version of PyTorch compiles nothing")
    def test_compiled_functions_draw_the_same(self) -> None:
        given = gaussians()

        def loss(*values: Any) -> Any:
            drawn = draw(*values, CAMERA)
            return (drawn.images * 2).square().mean() + drawn.alpha.sum()

        plain = loss(*given)
        slopes = torch.autograd.grad(plain, given)
        for backend in ("eager", "aot_eager"):
            compiled = torch.compile(loss, backend=backend)
            for _ in range(3):
                found = compiled(*given)
                self.assertTrue(torch.equal(found, plain))
                for one, two in zip(torch.autograd.grad(found, given), slopes):
                    self.assertTrue(torch.equal(one, two))

    def test_bad_input(self) -> None:
        given = gaussians()
        for degree in (3, 0):
            self.refused(splat.InvalidArgument, "colors is RGB", draw, *given, CAMERA,
                         sh_degree=degree)
        self.refused(splat.InvalidArgument, "sh_degree is 1.0", draw, *given[:4],
                     torch.rand(30, 4, 3), CAMERA, sh_degree=1.0)
        self.refused(splat.InvalidArgument, "'x' has the shape", bridge.Module, "linear",
                     {"x": (2.7, 3), "weight": (4, 3), "bias": (4,)})
        self.refused(splat.InvalidArgument, "float64", draw, given[0].double(), *given[1:], CAMERA)
        self.refused(splat.InvalidArgument, "meta", draw, given[0].to("meta"), *given[1:], CAMERA)
        self.refused(splat.ShapeMismatch, "scales", draw, given[0], given[1][:9], *given[2:],
                     CAMERA)
        for device in ("cpu", torch.device("cpu")):
            self.refused(TypeError, "expected a Device or None", draw, *given, CAMERA, device=device)
        self.refused(TypeError, "cameras[0] is a str, expected a Camera", draw, *given, ["a"])
        self.refused(TypeError, "Module(): shapes is an int, expected a mapping",
                     bridge.Module, "linear", 3)
        sparse = torch.eye(30, 3).to_sparse().requires_grad_()
        self.refused(splat.InvalidArgument, "means has the layout torch.sparse_coo", draw, sparse,
                     *given[1:], CAMERA)
        slope, = torch.autograd.grad(draw(*given, CAMERA).images.square().sum(), given[0],
                                     create_graph=True)
        with self.assertRaisesRegex(RuntimeError, "once_differentiable"):
            slope.sum().backward()

    def test_the_example_fits_a_picture(self) -> None:
        example = PYTHON / "examples" / "fit_torch.py"
        status, told, errors = run_program(example.read_text(encoding="utf-8"))
        self.assertEqual((status, errors), (0, ""))
        self.assertGreaterEqual(float(told.split(" dB")[0]), 30, told)

    def test_the_example_fits_a_scene(self) -> None:
        views = cameras(8, 40, 30)
        for index, image in enumerate(splat.render(scene(), views)):
            views[index].name = f"{index}.png"
            image.save(self.folder / views[index].name)
        splat.save_cameras(self.folder / "transforms.json", views)
        example = (PYTHON / "examples" / "fit_scene_torch.py").read_text(encoding="utf-8")
        place = [str(self.folder), str(self.folder / "scene.ply"), "100"]
        status, told, errors = run_program(f"import sys\nsys.argv[1:] = {place}\n{example}")
        self.assertEqual((status, errors), (0, ""))
        self.assertGreater(float(told.split()[2]), 16, told)
        self.assertEqual(len(splat.Scene.load(self.folder / "scene.ply")), 2000)
