"""Several threads at once, and what they borrow from the library."""
import asyncio
import gc
import threading
from typing import Any, Callable, List, Tuple
from unittest import mock

import numpy as np

import libsplat as splat
from libsplat import _library, _records
from shared import CONFIG, Case, cameras, scene, values


class Lent(Case):
    """What the library lends is copied before a close on another thread takes it away."""

    def closed_meanwhile(self, make: Callable[[], Any], call: Callable[[Any], object], target: Any,
                         name: str) -> None:
        """`call` copies by the function `name` of `target`; the object goes only when it has."""
        kind, real = make.__name__, getattr(target, name)
        gone: List[int] = []
        early: List[int] = []
        destroy = f"splat_{kind}_destroy"
        end = getattr(_library.lib, destroy)

        def destroyed(handle: int) -> int:
            gone.append(handle)
            return int(end(handle))

        def copied(*arguments: Any) -> Any:
            thread = threading.Thread(target=made.close)
            thread.start()
            thread.join()
            early.extend(gone)
            return real(*arguments)

        with mock.patch.object(_library.lib, destroy, destroyed):
            made = make()
            handle = made.handle
            with mock.patch.object(target, name, copied):
                call(made)
        gc.collect()
        self.assertEqual((early, gone, made.closed), ([], [handle], True))
        self.refused(splat.InvalidHandle, "was closed", call, made)

    def test_names_and_arrays(self) -> None:
        data = self.folder / "data"
        splat.write_synthetic(data, train=1, val=1, train_views=4, test_views=3, resolution=16)
        dataset = splat.Dataset(data, resolution=16, background=(1, 1, 1))
        config = splat.config_merge(CONFIG, f"data.root='{data}'")
        images = values(4, 3, 16, 16)

        def weights() -> Any:
            return splat.Weights({"a": images})

        def model() -> Any:
            return splat.Model(self.device, CONFIG)

        def module() -> Any:
            return splat.Module(self.device, "silu", {"x": (1, 8, 4, 4)})

        def predictor() -> Any:
            return splat.Predictor(self.device)

        def evaluator() -> Any:
            return splat.Evaluator(None, dataset, method="random")

        def batches() -> Any:
            return splat.Batches(dataset, config)

        def run() -> Any:
            return splat.Training(self.folder / "run", config, device=self.device)

        def tensor() -> Any:
            return splat.Tensor.zeros(self.device, (2, 2))

        def fill(made: Any) -> None:
            with made.map() as array:
                array += np.ones(2)

        parts: List[Tuple[Callable[[], Any], Callable[[Any], object], Any, str]] = [
            (weights, lambda made: made.info("a"), _records.WeightsInfo, "of"),
            (weights, lambda made: made.view("a"), np, "dtype"),
            (model, lambda made: made.ports(), splat.model, "Port"),
            (module, lambda made: made.ports("input"), splat.model, "Port"),
            (predictor, lambda made: made.info, _records.PredictorInfo, "of"),
            (evaluator, lambda made: made.score_images(0, images), _records.ObjectScores, "of"),
            (batches, lambda made: made.next(0), splat.Batch, "_copy"),
            (run, lambda made: made.next(), _records.RunEvent, "of"),
            (tensor, fill, np, "ones")]
        for part in parts:
            with self.subTest(part[0].__name__, copied_by=part[3]):
                self.closed_meanwhile(*part)

    def test_an_event_is_copied_before_the_next_call(self) -> None:
        splat.write_synthetic(self.folder, train=1, val=1, train_views=4, test_views=3, resolution=16)
        real, entered, copy = _library.lib.splat_run_next, [], _records.RunEvent.of
        second = threading.Event()

        def enter(*arguments: Any) -> int:
            entered.append(1)
            if len(entered) == 2:
                second.set()
            return int(real(*arguments))

        def copied(raw: Any) -> Any:
            if not other.is_alive() and not early:
                other.start()
                early.append(second.wait(0.3))
            return copy(raw)

        early: List[bool] = []
        with splat.Training(self.folder / "run", CONFIG, values=[f"data.root='{self.folder}'"],
                            device=self.device) as training:
            other = threading.Thread(target=training.next)
            with mock.patch.object(_library.lib, "splat_run_next", enter), \
                    mock.patch.object(_records.RunEvent, "of", copied):
                training.next()
                other.join()
        self.assertEqual((early, len(entered)), ([False], 2))


class Meeting:
    """A function for calls to run; it notes that two threads are in it at once."""

    def __init__(self) -> None:
        self.both, self.met = threading.Barrier(2), False

    def __call__(self, *_: object) -> int:
        try:
            self.both.wait(0.3)
            self.met = True
        except threading.BrokenBarrierError:
            pass
        return 0


class Threads(Case):
    """Several threads at once."""

    def together(self, *functions: Any) -> None:
        """Run functions at once; exceptions of any count."""
        errors: List[BaseException] = []

        def guarded(function: Any) -> None:
            try:
                function()
            except BaseException as error:
                errors.append(error)

        threads = [threading.Thread(target=guarded, args=(each,)) for each in functions]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        if errors:
            raise errors[0]

    def test_one_rasterizer(self) -> None:
        rasterizer, drawn = splat.Rasterizer(self.device, 50, 48, 32), scene()
        rasterizer.forward(drawn, cameras())
        expected = rasterizer.read()

        def work() -> None:
            for _ in range(20):
                rasterizer.forward(drawn, cameras())
                np.testing.assert_array_equal(rasterizer.read(), expected)

        self.together(work, work, work)
        meeting = Meeting()
        self.together(lambda: rasterizer._run(meeting), lambda: rasterizer._call(meeting))
        self.assertFalse(meeting.met)

    def test_evaluators_of_one_predictor(self) -> None:
        splat.write_synthetic(self.folder, test=2, test_views=3, resolution=64, seed=1)
        predictor = splat.Predictor(self.device)
        evaluators = [splat.Evaluator(predictor, data_path=self.folder) for _ in range(2)]
        expected = [evaluators[0].score(index).novel.psnr for index in range(2)]
        real, meeting = _library.lib.splat_evaluator_score, Meeting()
        found = [0.0, 0.0]

        def score(*arguments: Any) -> int:
            return meeting() or int(real(*arguments))

        def work(index: int) -> None:
            found[index] = evaluators[index].score(index).novel.psnr

        with mock.patch.object(_library.lib, "splat_evaluator_score", score):
            self.together(lambda: work(0), lambda: work(1))
        self.assertEqual((meeting.met, found), (False, expected))

    def test_errors_stay_with_their_thread(self) -> None:
        def missing(name: str) -> None:
            for _ in range(200):
                self.refused(splat.NotFound, name, splat.Scene.load, self.folder / name)

        self.together(lambda: missing("one.ply"), lambda: missing("two.ply"))

    def test_closing_beside_a_call(self) -> None:
        device = splat.Device()
        model = splat.Model(device, CONFIG)
        model.init(1)
        others = [splat.Tensor.zeros(device, (64, 64)) for _ in range(20)]
        started = threading.Event()

        def work() -> None:
            for _ in range(5):
                model.forward(values(1, 3, 16, 16))
                started.set()

        def close() -> None:
            started.wait()
            for each in (device, *others):
                each.close()

        self.together(work, close)
        model.close()

    def test_cancel_from_another_thread(self) -> None:
        device = splat.Device()
        model = splat.Model(device, CONFIG)
        stop = threading.Event()

        def cancel() -> None:
            while not stop.wait(0.0005):
                device.cancel()

        thread = threading.Thread(target=cancel)
        thread.start()
        try:
            with self.assertRaises(splat.Cancelled):
                while True:
                    model.forward(values(1, 3, 16, 16))
        finally:
            stop.set()
            thread.join()
        model.forward(values(1, 3, 16, 16))

    def test_cancel_ends_a_call_of_asyncio(self) -> None:
        device = splat.Device()
        model = splat.Model(device, CONFIG)

        def work() -> None:
            while True:
                model.forward(values(1, 3, 16, 16))

        async def main() -> None:
            task = asyncio.create_task(asyncio.to_thread(work))
            while not task.done():
                device.cancel()
                await asyncio.sleep(0.0005)
            with self.assertRaises(splat.Cancelled):
                await task

        asyncio.run(main())
