"""Objects in any order, the log, signals, forks, and the end of the interpreter."""
import copy
import ctypes
import gc
import itertools
import os
import pickle
import sys
import threading
import time
import types
import unittest
import weakref
from typing import Any, List

import libsplat as splat
from libsplat import _calls, _handle, _library, _native
from shared import CONFIG, Case, arrays, cameras, run_program, scene, values


class Order(Case):
    """Closing and collecting."""

    def make(self) -> List[Any]:
        """A device, and objects that it keeps or that keep it."""
        device = splat.Device()
        rasterizer, drawn = splat.Rasterizer(device, 50, 48, 32), scene()
        state = rasterizer.state()
        rasterizer.forward(drawn, cameras(), state=state)
        return [device, rasterizer, drawn, state, splat.Tensor.zeros(device, (64, 64))]

    def test_many_orders(self) -> None:
        for order in list(itertools.permutations(range(5)))[::7]:
            made: List[Any] = self.make()
            alive = [weakref.ref(each) for each in made]
            for index in order:
                if index % 2:
                    made[index].close()
                made[index] = None
            gc.collect()
            self.assertEqual([ref() for ref in alive], [None] * 5)

    def test_memory_goes_back(self) -> None:
        device, rasterizer, drawn, state, tensor = self.make()
        self.assertGreater(device.memory.live_bytes, 0)
        del rasterizer, drawn, state, tensor
        gc.collect()
        self.assertEqual(device.memory.live_bytes, 0)

    def test_a_closed_device_leaves_its_objects_usable(self) -> None:
        device, rasterizer, drawn, _, tensor = self.make()
        device.close()
        rasterizer.forward(drawn, cameras())
        self.assertEqual(tensor.numpy().sum(), 0)
        self.assertEqual(repr(device), "Device(closed)")

    def test_objects_in_cycles(self) -> None:
        class Holder:
            pass
        device, *others = self.make()
        for each in others:
            holder = Holder()
            holder.me, holder.it = holder, each  # type: ignore[attr-defined]
        before = device.memory.live_bytes
        del others, each, holder
        gc.collect()
        self.assertLess(device.memory.live_bytes, before)

    def test_half_made_objects(self) -> None:
        errors: List[Any] = []
        hook, sys.unraisablehook = sys.unraisablehook, errors.append
        try:
            cases: List[Any] = [
                (splat.Device, 99), (splat.Tensor, self.device, b""), (splat.Scene, 1),
                (splat.Rasterizer, self.device, -1, 1, 1), (splat.Comparison, {}, {}),
                (splat.Model, self.device, "nonsense: 1"), (splat.Predictor, self.device, "gone"),
                (splat.Module, self.device, "gone", {}), (splat.Training, "gone", "nonsense: 1"),
                (splat.Weights, {"a": "b"}), (splat.Dataset, "gone"), (splat.Lpips, [], 0),
                (splat.Optimizer, self.device, [])]
            for kind, *arguments in cases:
                with self.assertRaises(splat.Error):
                    kind(*arguments)
                half = kind.__new__(kind)
                self.assertTrue(half.closed)
                half.close()
                self.refused(splat.InvalidHandle, "was closed", getattr, half, "handle")
                del half
            gc.collect()
        finally:
            sys.unraisablehook = hook
        self.assertEqual(errors, [])

    def test_no_copies(self) -> None:
        made = splat.Tensor(self.device, 1)
        for function in (copy.copy, copy.deepcopy, pickle.dumps):
            self.refused(TypeError, "cannot be copied", function, made)

    def test_the_library_refuses_dead_handles(self) -> None:
        made, lib = scene(), _library.lib
        handle = made.handle
        made.close()
        info = _native.splat_scene_info(struct_size=ctypes.sizeof(_native.splat_scene_info))
        for dead in (handle, 0, 1, self.device.handle):
            self.assertEqual(lib.splat_scene_get_info(dead, ctypes.byref(info)),
                             _native.Result.ERROR_INVALID_HANDLE)


class Log(Case):
    """The log callback."""

    def tearDown(self) -> None:
        splat.set_log(None)

    def test_messages(self) -> None:
        heard: List[Any] = []
        splat.set_log(lambda level, text: heard.append((level, text)), "info")
        splat.Device().close()
        self.assertEqual(heard[0][0], splat.LogLevel.INFO)
        self.assertIn("device", heard[0][1])
        splat.set_log(None)
        count = len(heard)
        splat.Device().close()
        self.assertEqual(len(heard), count)
        self.refused(splat.InvalidArgument, "min_level", splat.set_log, None, "loud")

    def test_exceptions_go_to_the_hook(self) -> None:
        caught: List[Any] = []

        def fail(level: splat.LogLevel, text: str) -> None:
            raise ValueError("in the callback")

        hook, sys.unraisablehook = sys.unraisablehook, caught.append
        try:
            splat.set_log(fail, "info")
            splat.Device().close()
        finally:
            sys.unraisablehook = hook
        self.assertEqual(str(caught[0].exc_value), "in the callback")
        self.assertIs(caught[0].exc_type, ValueError)
        if sys.version_info < (3, 13):
            self.assertIs(caught[0].object.__wrapped__, fail)
        else:  # the message has the function
            self.assertIn(fail.__qualname__, caught[0].err_msg)

    def test_the_usual_hook_tells_exceptions(self) -> None:
        status, output, errors = run_program("""
import functools, libsplat as splat, sys
def fail(level, text): raise ValueError("in the callback")
for callback in (fail, functools.partial(fail), sys.exit):
    splat.set_log(callback, "info")
    splat.Device().close()
splat.set_log(None)
print("goes on")
""")
        self.assertEqual((status, output), (0, "goes on\n"), errors)
        self.assertIn("ValueError: in the callback", errors)
        self.assertIn("<function fail", errors)
        self.assertNotIn("hook", errors)
        self.assertGreaterEqual(errors.count("Traceback"), 2)

    def test_a_callback_may_call_the_library(self) -> None:
        found: List[int] = []
        splat.set_log(lambda level, text: found.append(len(scene())), "info")
        splat.Device().close()
        self.assertEqual(found[0], 50)


class Programs(Case):
    """What needs a process of its own."""

    def test_exit_with_live_objects_and_a_callback(self) -> None:
        text = """
import libsplat as splat, sys, threading, numpy
from shared import picture
splat.set_log(lambda level, text: print(text, file=sys.stderr), "error")
device = splat.default_device()
predictor = splat.Predictor(device)
tensor = splat.Tensor(device, [1, 2, 3]); array = tensor.array
kept = [tensor, predictor, splat.Scene(numpy.ones((9, 3), numpy.float32))]; kept.append(kept)
def work():
    while True: predictor.predict(picture())
if BUSY: threading.Thread(target=work, daemon=True).start()
import atexit, random, time; time.sleep(random.random() / 2)
atexit.register(lambda: print("end", predictor.info.views))
"""
        for busy in ("False", *["True"] * 5):
            self.assertEqual(run_program(text.replace("BUSY", busy)), (0, "end 1\n", ""))

    @unittest.skipIf("libtsan" in os.environ.get("LD_PRELOAD", ""),
                     "ThreadSanitizer ends a forked child that starts threads")
    def test_a_forked_child(self) -> None:
        self.assertEqual(run_program("""
import os, libsplat as splat, sys
from shared import cameras, scene
first = os.fork()  # before any device is opened: the child may open one
if first == 0:
    splat.render(scene(), cameras()[0])
    sys.exit(0)
assert os.waitpid(first, 0)[1] == 0
device = splat.default_device()
rasterizer, drawn = splat.Rasterizer(device, 50, 48, 32), scene()
rasterizer.forward(drawn, cameras())
child = os.fork()
if child == 0:
    for call in (lambda: rasterizer.forward(drawn, cameras()), lambda: splat.Tensor(device, 1),
                 device.cancel, splat.Device, lambda: splat.render(drawn, cameras()[0])):
        try: call()
        except splat.InvalidState as error: assert "fork" in str(error), error
        else: raise SystemExit("no error")
    assert len(drawn) == 50
    del rasterizer, drawn
    sys.exit(0)
print(os.waitpid(child, 0)[1])
rasterizer.forward(drawn, cameras())
""")[:2], (0, "0\n"))

    def test_interrupts_end_a_long_call(self) -> None:
        splat.write_synthetic(self.folder, test=1, test_views=251, resolution=64, seed=1)
        status, output, errors = run_program("""
import os, signal, libsplat as splat, sys, threading, time
evaluator = splat.Evaluator(splat.Predictor(), data_path=os.environ["DATA"])
evaluator.score(0)
begun = time.monotonic()
evaluator.score(0)
full = time.monotonic() - begun
def score():  # 251 views, drawn by several command lists
    begun = time.monotonic()
    try: evaluator.score(0)
    except (KeyboardInterrupt, TimeoutError) as error: print(type(error).__name__, error)
    return time.monotonic() - begun
def interrupt():
    threading.Timer(full / 10, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
interrupt()
print(score() < 0.9 * full, signal.getsignal(signal.SIGINT) is signal.default_int_handler)
def stop(*_): raise TimeoutError("alarm")
signal.signal(signal.SIGALRM, stop)
signal.setitimer(signal.ITIMER_REAL, full / 10)
score()
heard = []
signal.signal(signal.SIGINT, lambda *_: heard.append(1))  # a handler that lets the call go on
interrupt()
score()
print(heard, evaluator.info.scored, evaluator.score(0).novel.views)
""", DATA=str(self.folder))
        self.assertEqual((status, output), (
            0, "KeyboardInterrupt \nTrue True\nTimeoutError alarm\n[1] 1 250\n"), errors)

    def test_interrupts_end_an_export(self) -> None:
        splat.write_synthetic(self.folder / "data", train=10, train_views=40, resolution=32)
        status, output, errors = run_program("""
import os, signal, libsplat as splat, threading
dataset, out = splat.Dataset(os.environ["DATA"]), os.environ["DATA"] + "/../out"
begun, counts = threading.Event(), []
def send():
    begun.wait()
    os.kill(os.getpid(), signal.SIGINT)
def progress(*count):
    counts.append(count)
    begun.set()
threading.Thread(target=send).start()
try: splat.export_dataset(dataset, out, layout="images", progress=progress)
except KeyboardInterrupt: print("interrupted", counts[-1][0] < counts[-1][1])
splat.export_dataset(dataset, out, layout="images", progress=progress)
print(counts[-1])
""", DATA=str(self.folder / "data"))
        self.assertEqual((status, output, errors), (0, "interrupted True\n(2000, 2000)\n", ""))

    def test_interrupts_at_any_time(self) -> None:
        status, output, errors = run_program("""
import os, random, signal, libsplat as splat, threading, time
from shared import cameras, scene
rasterizer, drawn, view = splat.Rasterizer(None, 50, 48, 32), scene(), cameras()
rasterizer.forward(drawn, view)
inside, count, threads = False, 0, len(os.listdir("/proc/self/task"))
def stop(*_):
    global inside
    if inside:
        inside = False
        raise KeyboardInterrupt
def send():
    for _ in range(400):
        time.sleep(random.random() / 200)
        os.kill(os.getpid(), signal.SIGINT)
signal.signal(signal.SIGINT, stop)
sender = threading.Thread(target=send)
sender.start()
while sender.is_alive():
    try:
        inside = True
        while sender.is_alive():
            rasterizer.forward(drawn, view)
    except KeyboardInterrupt:
        count += 1
inside = False
rasterizer.forward(drawn, view)
print(count > 200, rasterizer.read().shape, len(os.listdir('/proc/self/task')) - threads < 10)
""")
        self.assertEqual((status, output), (0, "True (1, 32, 48, 3) True\n"), errors)


class Garbage(Case):
    """Errors leave nothing to the collector."""

    def refusals(self) -> List[Any]:
        """Functions that raise, each in its own way: short and long calls, lent blocks, callbacks."""
        rasterizer, drawn = splat.Rasterizer(self.device, 50, 48, 32, backward=True), scene()
        given = arrays(50)
        bad = {**given, "opacities": given["opacities"][:, None]}
        splat.write_synthetic(self.folder / "data", train=1, train_views=3, resolution=16)
        dataset = splat.Dataset(self.folder / "data")
        evaluator = splat.Evaluator(None, dataset, method="random")
        module = splat.Module(self.device, "silu", {"x": (1, 8, 4, 4)})
        weights = splat.Weights({"a": given["means"]})
        model = splat.Model(self.device, CONFIG)
        mapped = splat.Tensor(self.device, given["means"])

        def fail(*_: int) -> None:
            raise ZeroDivisionError

        def in_a_block() -> None:
            with mapped.map() as array:
                array[9999] = 0

        def kept() -> None:
            with mapped.map() as array:
                return None if array[1:] is None else memoryview(array)  # type: ignore

        return [lambda: rasterizer.forward_arrays(cameras(), **bad),
                lambda: rasterizer.forward(drawn, cameras(1, 49, 32)), lambda: rasterizer.read("depth"),
                lambda: splat.Tensor.zeros(self.device, (2, -1)), lambda: splat.Scene(given["sh"]),
                lambda: evaluator.score(0), lambda: module.backward(), lambda: weights["b"],
                lambda: module.ports(98), lambda: model.forward(values(1, 3, 8, 8)),
                lambda: model.ports(99), lambda: splat.Predictor(self.device, "gone"),
                lambda: splat.Training(self.folder / "run", "nonsense: 1"), in_a_block, kept,
                lambda: splat.export_dataset(dataset, self.folder / "out", layout="images",
                                             progress=fail),
                lambda: splat.Scene.load(b"nonsense"),
                lambda: splat.Tensor(self.device, ["a"])]  # pyright: ignore[reportArgumentType]

    def left(self, call: Any) -> List[Any]:
        """What only the collector frees of a call that raises; `assertRaises` would empty the frames."""
        held = (BaseException, types.FrameType, types.TracebackType, _handle.Handle, _handle.Keeper)
        refused = False
        gc.collect()
        gc.disable()
        gc.set_debug(gc.DEBUG_SAVEALL)
        try:
            call()
        except Exception:
            refused = True
        try:
            self.assertTrue(refused, call)
            gc.collect()
            return [each for each in gc.garbage if isinstance(each, held)]  # ctypes leaves types
        finally:
            gc.set_debug(0)
            gc.garbage.clear()
            gc.enable()

    def test_refusals_leave_no_cycle(self) -> None:
        for call in self.refusals():
            self.assertEqual(self.left(call), [], call)

    def test_device_memory_is_free_behind_the_except_block(self) -> None:
        with splat.Device() as device:
            rasterizer, given = splat.Rasterizer(device, 1000, 48, 32), arrays(1000)
            bad = {**given, "opacities": given["opacities"][:, None]}
            gc.disable()
            try:
                for index in range(5):
                    try:
                        rasterizer.forward_arrays(cameras(), **bad)
                    except splat.ShapeMismatch as error:
                        held = weakref.ref(error)
                    self.assertIsNone(held())
                    if index == 0:
                        before = device.memory.live_bytes
                self.assertEqual(device.memory.live_bytes, before)
            finally:
                gc.enable()


class Calls(unittest.TestCase):
    """The way of long calls to their thread."""

    def test_it_costs_little(self) -> None:
        lib = _library.lib
        for _ in range(100):
            _calls.run(None, None, lib.splat_version)
        times = []
        for _ in range(1000):
            begun = time.perf_counter()
            _calls.run(None, None, lib.splat_version)
            times.append(time.perf_counter() - begun)
        self.assertLess(sorted(times)[500], 50e-6 * 4)  # 10 us where nothing else runs

    def test_exceptions_of_arguments_come_back(self) -> None:
        with self.assertRaises(ctypes.ArgumentError):
            _calls.run(None, None, _library.lib.splat_result_name, "no number")
        self.assertGreater(_calls.run(None, None, _library.lib.splat_version), 0)
