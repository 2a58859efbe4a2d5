"""Train with several processes, which reach each other by torch.distributed (Gloo).

    torchrun --nproc_per_node 2 train_ranks.py RUN data.root=cars opt.batch_size=8 opt.micro_batch=4
    python3 train_ranks.py RUN KEY=VALUE...     starts two processes itself

Ranks times opt.micro_batch divide opt.batch_size. 1, 2, 4... processes end with the same bits.
"""
import datetime
import os
import socket
import subprocess
import sys
from typing import Any, List

import torch
import torch.distributed as dist

import libsplat as splat

LIMIT = datetime.timedelta(minutes=10)  # how long a rank waits for another


class Gloo(splat.Ranks):
    """Gloo sends arrays of NumPy as tensors of the same memory."""

    def send_receive(self, peer: int, sent: Any, received: Any) -> None:
        request = dist.isend(torch.from_numpy(sent), peer)
        dist.recv(torch.from_numpy(received), peer)
        request.wait()

    def broadcast(self, root: int, data: Any) -> None:
        dist.broadcast(torch.from_numpy(data), root)

    def barrier(self) -> None:
        dist.barrier()


def device_of(rank: int) -> splat.Device:
    """The GPU of this process on its machine; without any GPU, the CPU."""
    gpus = [each for each in splat.devices() if each.usable and each.kind != splat.DeviceKind.CPU]
    local = int(os.environ.get("LOCAL_RANK", rank))
    return splat.Device(index=gpus[local % len(gpus)].index) if gpus else splat.default_device()


def train(folder: str, values: List[str]) -> None:
    """What each process does."""
    dist.init_process_group("gloo", timeout=LIMIT)
    ranks = Gloo(dist.get_rank(), dist.get_world_size())
    with splat.Training(folder, values=values, device=device_of(ranks.rank), ranks=ranks) as training:
        for event in training:
            if event.text and ranks.rank == 0:
                print(event.text, flush=True)
    dist.destroy_process_group()


def start(count: int, words: List[str]) -> int:
    """Run `count` processes with torchrun's variables; the exit status of the first that failed."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    given = {**os.environ, "WORLD_SIZE": str(count), "MASTER_ADDR": "127.0.0.1", "MASTER_PORT": str(port)}
    processes = [subprocess.Popen([sys.executable, sys.argv[0], *words], env={**given, "RANK": str(rank)})
                 for rank in range(count)]
    return max(process.wait() for process in processes)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    if "RANK" in os.environ:
        train(sys.argv[1], sys.argv[2:])
    else:
        sys.exit(start(2, sys.argv[1:]))
