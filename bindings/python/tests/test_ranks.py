"""Trainings of several ranks: threads, and the example's processes, which reach each other by Gloo."""
import os
import queue
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Tuple

import numpy as np

import libsplat as splat
from shared import CONFIG, PYTHON, Case

LIMIT = 120.0  # seconds that a rank waits for another


class Gone(Exception):
    """Another rank has left."""


class Meeting:
    """Where the threads of a training meet."""

    def __init__(self, count: int) -> None:
        self.barrier = threading.Barrier(count, timeout=LIMIT)
        self.data = b""
        self.queues: Dict[Tuple[int, int], "queue.Queue[bytes]"] = {
            (a, b): queue.Queue() for a in range(count) for b in range(count)}


class Threads(splat.Ranks):
    """Ranks that are threads of this process."""

    def __init__(self, rank: int, meeting: Meeting) -> None:
        super().__init__(rank, meeting.barrier.parties)
        self.meeting = meeting

    def send_receive(self, peer: int, sent: Any, received: Any) -> None:
        self.meeting.queues[self.rank, peer].put(sent.tobytes())
        received[:] = np.frombuffer(self.meeting.queues[peer, self.rank].get(timeout=LIMIT), np.uint8)

    def broadcast(self, root: int, data: Any) -> None:
        if self.rank == root:
            self.meeting.data = data.tobytes()
        self.barrier()
        data[:] = np.frombuffer(self.meeting.data, np.uint8)
        self.barrier()

    def barrier(self) -> None:
        try:
            self.meeting.barrier.wait()
        except threading.BrokenBarrierError:
            raise Gone("another rank has left") from None


class Fails(Threads):
    """Rank 1 raises where gradients are exchanged."""

    def send_receive(self, peer: int, sent: Any, received: Any) -> None:
        if sent.nbytes > 1000:
            self.meeting.barrier.abort()
            if self.rank == 1:
                raise KeyError("unplugged")
            raise Gone("rank 1 has left")
        super().send_receive(peer, sent, received)


class Sums(Threads):
    """Gradients are summed by this class, in the order of ranks."""

    def sum(self, values: Any) -> None:
        shares = [np.array(values)]
        for peer in range(self.count):
            if peer != self.rank:
                shares.append(np.empty_like(values))
                self.send_receive(peer, values.view(np.uint8), shares[-1].view(np.uint8))
        values[:] = np.sum(shares, axis=0)


class Group(Case):
    """The same bits from 1 and from 2 ranks; exceptions of the callbacks."""

    def setUp(self) -> None:
        super().setUp()
        self.path = self.folder / "data"
        splat.write_synthetic(self.path, train=4, val=0, train_views=3, resolution=16, seed=1)
        self.values = [f"data.root='{self.path}'", "opt.batch_size=4", "opt.micro_batch=1", "opt.iterations=3"]

    def train(self, folder: Path, ranks: Optional[splat.Ranks] = None, device: Optional[splat.Device] = None,
              values: Any = None) -> None:
        with splat.Training(folder, CONFIG, values=values or self.values, ranks=ranks,
                            device=device or self.device) as training:
            kinds = [event.kind for event in training]
            self.assertEqual(kinds[-1], splat.RunEventKind.DONE)

    def of_threads(self, count: int, kind: Callable[[int, Meeting], splat.Ranks], folder: Path,
                   values: Any = None) -> List[Optional[BaseException]]:
        """What each rank raised."""
        meeting = Meeting(count)
        raised: List[Optional[BaseException]] = [None] * count

        def work(rank: int) -> None:
            try:
                with splat.Device(index=self.device.info.index) as device:
                    self.train(folder, kind(rank, meeting), device, values)
            except BaseException as error:
                meeting.barrier.abort()
                raised[rank] = error

        threads = [threading.Thread(target=work, args=(rank,)) for rank in range(count)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        return raised

    def weights(self, folder: Path) -> bytes:
        return (folder / "weights_last.safetensors").read_bytes()

    def test_two_threads_have_the_bits_of_one(self) -> None:
        self.train(self.folder / "one")
        self.assertEqual(self.of_threads(2, Threads, self.folder / "two"), [None, None])
        self.assertEqual(self.weights(self.folder / "one"), self.weights(self.folder / "two"))

    def test_a_sum_without_order(self) -> None:
        self.train(self.folder / "one")
        self.assertEqual(self.of_threads(2, Sums, self.folder / "two"), [None, None])
        one, two = (splat.Weights.load(self.folder / name / "weights_last.safetensors") for name in ("one", "two"))
        for name in one:
            np.testing.assert_allclose(two[name], one[name], rtol=1e-2, atol=1e-3)
        self.assertIn('"reproducible": false', (self.folder / "two/run.json").read_text(encoding="utf-8"))

    def test_exceptions_cross(self) -> None:
        first, second = self.of_threads(2, Fails, self.folder / "run")
        self.assertIsInstance(first, Gone)
        self.assertIsInstance(second, KeyError)
        self.assertIn("unplugged", str(second))

    def test_bad_ranks(self) -> None:
        for rank, count, words in ((0, 3, "power of two"), (2, 2, "rank")):
            self.refused(splat.InvalidArgument, words, self.train, self.folder / "bad",
                         splat.Ranks(rank, count))
        self.refused(splat.InvalidArgument, "a whole number", splat.Ranks, "a", 2)
        self.refused(NotImplementedError, "Ranks has no ", self.train, self.folder / "bad", splat.Ranks(0, 2))
        self.refused(TypeError, "ranks is an int", self.train, self.folder / "bad", 3)
        self.assertFalse((self.folder / "bad").exists())

    def test_processes_by_gloo(self) -> None:
        if subprocess.run([sys.executable, "-c", "import torch.distributed"], capture_output=True,
                          check=False).returncode != 0:
            self.skipTest(f"{sys.executable} has no PyTorch; apt-get install python3-torch")
        values = [f"{section}.{key}={value}" for section, keys in CONFIG.items() for key, value in keys.items()]
        done = subprocess.run(
            [sys.executable, PYTHON / "examples/train_ranks.py", self.folder / "two", *values, *self.values],
            capture_output=True, text=True, timeout=300, env={**os.environ, "PYTHONPATH": str(PYTHON / "src")},
            check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.train(self.folder / "one")
        self.assertEqual(self.weights(self.folder / "one"), self.weights(self.folder / "two"))
