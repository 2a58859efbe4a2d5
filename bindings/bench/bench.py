"""What a call costs in Python; README.md describes the three measurements. Argument: a scene."""

import json
import sys
import time
from typing import Callable, List

import numpy as np

import libsplat as splat

ROUNDS, CALLS, SIDE, WIDTH, HEIGHT = 40, 10000, 1024, 144, 240


def measure(call: Callable[[int], None], factor: float) -> List[float]:
    """[shortest, median] of the rounds in ms, times a factor, after two that do not count."""
    call(0)
    call(1)
    times = []
    for i in range(ROUNDS):
        start = time.perf_counter_ns()
        call(i)
        times.append((time.perf_counter_ns() - start) * 1e-6 * factor)
    times.sort()
    return [round(times[0], 3), round(times[ROUNDS // 2], 3)]


def main() -> None:
    device = splat.Device()
    tensor = splat.Tensor.zeros(device, (SIDE, SIDE))
    numbers = np.empty((SIDE, SIDE), np.float32)
    scene = splat.Scene.load(sys.argv[1])
    cameras = splat.Camera.orbit(scene, 2, width=WIDTH, height=HEIGHT)
    rasterizer = splat.Rasterizer(device, len(scene), WIDTH, HEIGHT)

    def get(_: int) -> None:
        for _ in range(CALLS):
            tensor.info

    def read(_: int) -> None:
        tensor.numpy(out=numbers)

    def render(turn: int) -> None:  # an unchanged view is not drawn again
        rasterizer.forward(scene, [cameras[turn % 2]])
        rasterizer.read("rgb")

    print(json.dumps({"language": "Python", "getter_ns": measure(get, 1e6 / CALLS),
                      "read_ms": measure(read, 1), "render_ms": measure(render, 1)}))


main()
