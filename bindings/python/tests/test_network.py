"""Weights, models, modules, operators, and the optimizer."""
from typing import Any, Tuple

import numpy as np

import libsplat as splat
from shared import CONFIG, Case, values


class WeightFiles(Case):
    """Named arrays."""

    def test_arrays_come_back(self) -> None:
        given = {"a.weight": values(2, 3), "b": values(4), "scalar": np.float32(3),
                 "none": values(0, 2)}
        weights = splat.Weights(given)
        self.assertEqual(list(weights), list(given))
        names: Any = ("safetensors", "npz")
        for name in names:
            weights.save(self.folder / f"a.{name}")
            self.assertEqual((self.folder / f"a.{name}").read_bytes(), weights.to_bytes(name))
            for source in (False, True):
                with splat.Weights.load(weights.to_bytes(name) if source else
                                        self.folder / f"a.{name}") as again:
                    for key, array in given.items():
                        np.testing.assert_array_equal(again[key], array)
                        np.testing.assert_array_equal(again.view(key), array)
        self.assertEqual((weights.info("b").shape, len(weights), "b" in weights, "c" in weights),
                         ((4,), 4, True, False))
        self.assertFalse(weights.view("b").flags.writeable)
        self.assertEqual(splat.Weights.load(weights.to_bytes(half=True)).info("b").dtype, "float16")

    def test_names_that_no_array_has(self) -> None:
        weights = splat.Weights({"a": values(2), "5": values(1), "\u00fc": values(1)})
        for name in ("a\0b", "a\0", "\ud800", "a\udcff", "b", "", 5, None, b"a"):
            self.assertNotIn(name, weights)
        self.assertIn("\u00fc", weights)
        for name in ("\ud800", "a\0"):
            for function in ("__getitem__", "view", "info"):
                self.refused(splat.MissingName, "name has", getattr(weights, function), name)
        calls: Tuple[Any, ...] = (splat.builtin_weights, splat.Weights.load, splat.Camera.load,
                                  splat.config_preset, splat.prior_preset)
        for call in calls:
            self.refused(splat.InvalidArgument, "surrogate", call, "\ud800")
        weights.close()
        self.refused(splat.InvalidHandle, "was closed", weights.__contains__, "a\0b")

    def test_writes_into_copies_are_refused(self) -> None:
        weights = splat.Weights({"a": values(2, 2), "none": values(0, 2)})
        self.refused(ValueError, "read-only", weights["a"].__setitem__, 0, 1)
        self.refused(ValueError, "read-only", weights.view("a").__setitem__, 0, 1)

    def test_adapters_fold(self) -> None:
        base = {"layer.weight": values(4, 3)}
        parts = {"layer.lora_A": values(2, 3, seed=1), "layer.lora_B": values(4, 2, seed=2)}
        folded = splat.Weights(base).fold(splat.Weights(parts), alpha=2)
        np.testing.assert_allclose(folded["layer.weight"], base["layer.weight"] +
                                   parts["layer.lora_B"] @ parts["layer.lora_A"], rtol=1e-6)
        undone = folded.fold(splat.Weights(parts), alpha=2, out=True)
        np.testing.assert_allclose(undone["layer.weight"], base["layer.weight"], atol=1e-6)

    def test_bad_input(self) -> None:
        self.refused(splat.InvalidArgument, "float64", splat.Weights, {"a": np.zeros(3)})
        self.refused(splat.InvalidArgument, "9 dimensions", splat.Weights,
                     {"a": np.zeros((1,) * 9, np.float32)})
        weights = splat.Weights({"a": values(2)})
        self.refused(splat.MissingName, "b", lambda: weights["b"])
        self.refused(splat.FormatError, "", splat.Weights.load, b"nonsense")
        self.refused(splat.NotFound, "", splat.Weights.load, self.folder / "a.pth")
        self.refused(splat.NotFound, "trucks", splat.builtin_weights, "trucks")
        view = weights.view("a")
        weights.close()
        self.refused(splat.InvalidHandle, "this Weights was closed", weights.view, "a")
        np.testing.assert_array_equal(view, values(2))  # the view keeps them


class Models(Case):
    """Whole networks."""

    def make(self, **options: object) -> splat.Model:
        model = splat.Model(self.device, CONFIG, **options)  # type: ignore
        model.init(3)
        return model

    def test_forward_and_backward(self) -> None:
        model, images = self.make(gradients=True, input_gradients=True), values(1, 3, 16, 16)
        model.forward(images)
        self.assertEqual(model.read("means").shape, (1, 256, 3))
        self.assertEqual((len(model.scene()), model.info.gaussians), (256, 256))
        name = model.ports()[0].name
        model.zero_gradients()
        model.backward(means=np.ones((1, 256, 3), np.float32))
        gradient = model.read(f"grad:{name}")
        self.assertGreater(np.abs(gradient).max(), 0)
        self.assertEqual(model.read("grad:images").shape, (1, 3, 16, 16))
        # The same through tensors that share the model's memory.
        model.tensor("images").write(images)
        model.forward()
        model.tensor("grad:means").write(np.ones((1, 256, 3), np.float32))
        model.zero_gradients()
        model.backward()
        np.testing.assert_array_equal(model.read(f"grad:{name}"), gradient)
        self.assertEqual(model.tensor("means[0]").shape, (256, 3))

    def test_a_pass_is_one_list(self) -> None:
        device = splat.Device(profile=True)
        model, slopes = splat.Model(device, CONFIG, gradients=True), np.ones((1, 256, 3), np.float32)
        model.init(3)

        def forward() -> None:
            model.forward(values(1, 3, 16, 16))

        def backward() -> None:
            model.backward(means=slopes)

        for call in (forward, backward) * 2:
            device.reset_profile()
            call()
            self.assertEqual(device.profile()["lists"]["count"], 1)

    def test_state_dicts(self) -> None:
        model, other = self.make(), splat.Model(self.device, CONFIG)
        other.load(model.store())
        for port in model.ports()[:3]:
            np.testing.assert_array_equal(other.read(port.name), model.read(port.name))
        port = model.ports()[0]
        model.write(port.name, np.ones(port.shape, np.float32))
        self.assertEqual(model.read(port.name).min(), 1)
        self.assertTrue(port.trainable)
        self.assertEqual(model.report["config"]["model"]["base_dim"], 8)

    def test_bad_input(self) -> None:
        model = self.make()
        self.refused(splat.InvalidArgument, "base_dimm", splat.Model, self.device,
                     {"model": {"base_dimm": 8}})
        self.refused(splat.ShapeMismatch, "", model.forward, values(1, 4, 16, 16))
        self.refused(splat.ShapeMismatch, "[N,channels,R,R]", model.forward, values(3, 16, 16))
        self.refused(splat.InvalidArgument, "finite", model.forward,
                     values(1, 3, 16, 16) + np.float32("nan"))
        model.forward(values(1, 3, 16, 16))
        self.refused(splat.InvalidState, "gradients=True", model.backward, means=values(1, 256, 3))
        self.refused(splat.NotFound, "no parameter 'x'", model.write, "x", values(1))
        self.refused(splat.NotFound, "", model.read, "x")
        self.refused(splat.InvalidState, "adapters", model.export, "adapters")
        self.refused(splat.InvalidArgument, "", model.load, splat.Weights({"a": values(1)}))
        with model.tensor("images").map():
            self.refused(splat.InvalidState, "mapped", model.forward, values(1, 3, 16, 16))
        model.close()
        self.refused(splat.InvalidHandle, "this Model was closed", model.forward)


class Parts(Case):
    """Operators and modules."""

    def test_operator(self) -> None:
        self.assertIn("silu", {each["name"] for each in splat.operators()})
        x = values(1, 4, 2, 2) - 0.5
        a, b, grad_b, grad_a = (splat.Tensor(self.device, array)
                                for array in (x, x * 0, x * 0 + 1, x * 0))
        op = splat.Op(self.device, "silu", [a], [b], grad_outputs=[grad_b], grad_inputs=[grad_a])
        self.refused(splat.InvalidState, "forward", op.backward)
        op.forward()
        sigmoid = 1 / (1 + np.exp(-x.astype(float)))
        np.testing.assert_allclose(b, x * sigmoid, rtol=1e-5, atol=1e-6)
        op.backward()
        np.testing.assert_allclose(grad_a, sigmoid * (1 + x * (1 - sigmoid)), rtol=1e-4)

    def test_module(self) -> None:
        module = splat.Module(self.device, "conv2d",
                              {"x": (1, 2, 5, 5), "weight": (3, 2, 3, 3), "bias": (3,)},
                              gradients=True, input_gradients=True)
        module.init(1)
        x, grad = values(1, 2, 5, 5), values(1, 3, 5, 5, seed=1)
        module.forward(x=x)
        module.backward(y=grad)
        np.testing.assert_allclose(module.read("grad:bias"), grad.sum((0, 2, 3)), rtol=1e-5)
        weight, y = module.read("weight"), module.read("y")
        self.assertAlmostEqual(float(y[0, 1, 2, 2]), float((weight[1] * x[0, :, 1:4, 1:4]).sum()),
                               4)
        module.zero_gradients()
        self.assertEqual(module.read("grad:weight").max(), 0)
        self.assertEqual(module.report["type"], "conv2d")

    def test_bad_input(self) -> None:
        tensor = splat.Tensor.zeros(self.device, (1, 4, 2, 2))
        self.refused(splat.InvalidArgument, "sillu", splat.Op, self.device, "sillu", [tensor],
                     [tensor])
        self.refused(splat.ShapeMismatch, "", splat.Op, self.device, "silu", [tensor],
                     [splat.Tensor.zeros(self.device, (1, 3, 2, 2))])
        self.refused(splat.InvalidArgument, "", splat.Op, self.device, "silu", [], [tensor])
        make = splat.Module
        self.refused(splat.ShapeMismatch, "", make, self.device, "conv2d", {"x": (1, 2, 4, 4)})
        self.refused(splat.InvalidArgument, "", make, self.device, "silu", {"x": (1, 2, 4, 4)},
                     attributes={"size": 3})
        self.refused(splat.InvalidArgument, "'x' has the shape", make, self.device, "silu",
                     {"x": (1, 2.5, 4, 4)})
        self.refused(splat.InvalidArgument, "dimensions", make, self.device, "silu",
                     {"x": (1,) * 9})
        module = make(self.device, "silu", {"x": (1, 2, 4, 4)})
        self.refused(splat.NotFound, "expected one of x, y", module.read, "z")
        self.refused(splat.ShapeMismatch, "expected [1,2,4,4]", module.forward, x=values(2, 2))
        self.refused(splat.InvalidState, "without gradients", module.backward)


class Optimizers(Case):
    """Adam."""

    def test_it_minimises(self) -> None:
        parameter = splat.Tensor(self.device, values(8))
        gradient = splat.Tensor.zeros(self.device, (8,))
        optimizer = splat.Optimizer(self.device, [("p", parameter, gradient)], rate=0.05,
                                    ema_decay=0.9)
        for _ in range(200):
            gradient.write(2 * (parameter.numpy() - 3))
            info = optimizer.step()
        np.testing.assert_allclose(parameter, np.full(8, 3), atol=0.05)
        self.assertEqual((info.step, info.elements, optimizer.info.step), (200, 8, 200))
        self.assertEqual(list(optimizer.store()), ["p"])
        state = splat.Weights.load(optimizer.state().to_bytes())
        optimizer.step()
        after = parameter.numpy()
        optimizer.load(state)
        self.assertEqual(optimizer.info.step, 200)
        optimizer.set_rate(0.1)
        optimizer.zero_gradients()
        self.assertEqual(gradient.numpy().max(), 0)
        self.assertEqual(after.shape, (8,))

    def test_rows(self) -> None:
        means = splat.Tensor(self.device, values(6, 3))
        gradient = splat.Tensor(self.device, np.ones((6, 3), np.float32))
        optimizer = splat.Optimizer(self.device, [("set.means", means, gradient)], rate=0.05)
        optimizer.step()
        before = means.numpy().copy()
        optimizer.gather_rows("set.*", np.flatnonzero(np.arange(6) % 2 == 0))
        np.testing.assert_array_equal(means.numpy()[:3], before[::2])
        self.assertEqual(optimizer.info.elements, 9)
        optimizer.gather_rows("set.*", [0, 1, 2, -1])
        np.testing.assert_array_equal(means.numpy()[3], before[3])
        self.assertEqual(optimizer.store()["set.means"].shape, (4, 3))
        self.refused(splat.InvalidArgument, "rows[0] is 4", optimizer.gather_rows, "*", [4])
        self.refused(splat.InvalidArgument, "expected integers", optimizer.gather_rows, "*", [0.5])

    def test_models_and_groups(self) -> None:
        model = splat.Model(self.device, CONFIG, gradients=True)
        model.init(1)
        module = splat.Module(self.device, "linear", {"x": (2, 3), "weight": (4, 3), "bias": (4,)},
                              gradients=True)
        optimizer = splat.Optimizer(self.device, [model, ("extra.", module)], schedule="cosine",
                                    total_steps=10, groups=[splat.Group("*.bias", 0.1)])
        model.forward(values(1, 3, 16, 16))
        model.backward(means=np.ones((1, 256, 3), np.float32))
        name = model.ports()[0].name
        before = model.read(name)
        self.assertEqual(optimizer.step().was_skipped, 0)
        self.assertFalse(np.array_equal(model.read(name), before))
        self.assertIn("extra.weight", optimizer.store())

    def test_bad_input(self) -> None:
        one, two, three = (splat.Tensor.zeros(self.device, (size,)) for size in (3, 4, 3))
        make = splat.Optimizer
        self.refused(splat.ShapeMismatch, "", make, self.device, [("p", one, two)])
        self.refused(splat.InvalidArgument, "an item must be", make, self.device, [one])
        self.refused(splat.InvalidArgument, "", make, self.device, [])
        self.refused(splat.InvalidArgument, "q*", make, self.device, [("p", one, three)],
                     groups=[splat.Group("q*")])
        self.refused(splat.InvalidState, "", make, self.device, [splat.Model(self.device, CONFIG)])
        other = make(self.device, [("p", one, three)])
        self.refused(splat.InvalidArgument, "", other.load, splat.Weights({"a": values(1)}))
        self.refused(splat.InvalidArgument, "rate", other.set_rate, -1)
