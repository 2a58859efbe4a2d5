#!/usr/bin/env python3
"""The smoke list in Python; README.md describes the cases.

Argument: a folder with config.json and a data set.
"""
import ctypes
import gc
import json
import sys
import threading
from pathlib import Path
from typing import Any, List

import numpy as np

import libsplat as splat
from libsplat import _library, _native

COUNT, WIDTH, HEIGHT = 1000, 144, 96
WHITE = (1, 1, 1)


def fnv(data: Any) -> str:
    """FNV-1a with 64 bits."""
    value = 14695981039346656037
    for byte in memoryview(data).cast("B"):
        value = (value ^ byte) * 1099511628211 & 0xFFFFFFFFFFFFFFFF
    return f"{value:016x}"


def tell(case: str, **facts: Any) -> None:
    line = {"case": case, **facts}
    print(json.dumps(line, separators=(",", ":"), ensure_ascii=False), flush=True)


def make_scene() -> splat.Scene:
    state = 1

    def draw() -> int:
        nonlocal state
        state = (1664525 * state + 1013904223) & 0xFFFFFFFF
        return state >> 24

    rows: List[List[float]] = []
    for _ in range(COUNT):
        row = [(draw() - 128) / 128 for _ in range(3)] + [-3 - draw() / 128 for _ in range(3)]
        row += [1.0] + [(draw() - 128) / 256 for _ in range(3)] + [(draw() - 128) / 32]
        rows.append(row + [(draw() - 128) / 128 for _ in range(12)])
    values = np.array(rows, np.float32)
    return splat.Scene(values[:, :3], log_scales=values[:, 3:6], rotations=values[:, 6:10],
                       opacity_logits=values[:, 10], sh=values[:, 11:].reshape(COUNT, 4, 3))


def make_rasterizer(device: splat.Device) -> splat.Rasterizer:
    return splat.Rasterizer(device, COUNT, WIDTH, HEIGHT, views=2, sh_degree=1, backward=True)


def cameras_of(scene: splat.Scene) -> List[splat.Camera]:
    return splat.Camera.orbit(scene, 2, width=WIDTH, height=HEIGHT, elevation=0.5)


def picture() -> Any:
    y, x = np.mgrid[:64, :80]
    disc = (2 * x - 79)**2 + (2 * y - 63)**2 < 2304
    return np.stack([5 * x, 7 * y, x * y, 255 * disc], -1).astype(np.uint8)


def ply(scene: splat.Scene) -> str:
    return fnv(scene.to_bytes("ply"))


def case_render(device: splat.Device, scene: splat.Scene) -> None:
    with make_rasterizer(device) as rasterizer:
        rasterizer.forward(scene, cameras_of(scene), WHITE)
        tell("render", rgb=fnv(rasterizer.read("rgb")),
             rgba=fnv(rasterizer.images(channels=4)[1].array.copy()))


def case_gradient(device: splat.Device, scene: splat.Scene) -> None:
    tensors: Any = {name: scene.tensor(name, device)
                    for name in ("means", "scales", "rotations", "opacities", "sh")}
    with make_rasterizer(device) as rasterizer:
        rasterizer.forward_arrays(cameras_of(scene), WHITE, **tensors)
        found = rasterizer.backward(["means", "opacities"],
                                    rgb=np.ones((2, HEIGHT, WIDTH, 3), np.float32))
    tell("gradient", **{name: fnv(tensor.numpy()) for name, tensor in found.items()})


def doubles(*values: Any) -> str:
    return fnv(np.hstack(values).astype(np.float64))


def case_judge(scene: splat.Scene) -> None:
    y, x = np.mgrid[:48, :48]
    p, g = ((value % 64 + 1).astype(np.float32) / 64
            for value in (3 * x * y + x + 2 * y, x * y + 3 * x + 5 * y))
    one = np.ones_like(p)
    depth = splat.compare_depth(p, g)
    normal = splat.compare_normals(np.stack([p, g, one], -1), np.stack([g, p, one], -1))
    mask = splat.compare_masks(p, g)
    points = scene.compare_points(np.stack([p, g, p - g], -1).reshape(-1, 3), 0.25, 0)
    tell("judge",
         depth=doubles(depth.abs_rel, depth.rmse, depth.si_rmse, depth.within, depth.scale,
                       depth.shift),
         normal=doubles(normal.mean, normal.median, normal.rmse, normal.within),
         mask=doubles(mask.mae, mask.iou, mask.precision, mask.recall, mask.f_beta),
         fidelity=doubles(splat.compare_fidelity(p, g).vif),
         edges=fnv(splat.filter_map(g, "canny")),
         points=doubles(points.accuracy, points.completeness, points.chamfer,
                        points.chamfer_squared, points.precision, points.recall, points.f_score))


def case_maps() -> None:
    mask, found = splat.picture_mask(picture())
    y, x = np.mgrid[:48, :48]
    depth = ((3 * x * y + x + 2 * y) % 64 + 1).astype(np.float32) / 64
    tell("maps", found=int(found), mask=fnv(mask),
         normal=fnv(splat.normals_from_depth(depth, 48, distances=(1, 2))))


def case_data(folder: Path) -> None:
    store = folder / "store_python"
    with splat.Dataset(folder) as dataset:
        for shard in ((1, 2), (0, 2)):
            splat.export_dataset(dataset, store, layout="store", shard=shard)
    with splat.Dataset(store) as dataset:
        tell("data", objects=len(dataset), rgb=fnv(dataset.read(1)["images"]))


def case_errors(scene: splat.Scene) -> None:
    try:
        splat.describe(9999)
    except splat.InvalidArgument as error:
        tell("error", code=int(error.code), name=error.name, message=error.message)
    handle = scene.handle
    scene.close()
    info = _native.splat_scene_info(struct_size=ctypes.sizeof(_native.splat_scene_info))
    code = _library.lib.splat_scene_get_info(handle, ctypes.byref(info))
    tell("handle", code=code, name=_library.lib.splat_result_name(code).decode())


def case_cancel(device: splat.Device, predictor: splat.Predictor, folder: Path) -> None:
    config = (folder / "config.json").read_text("utf-8")
    kind = None
    with splat.Training(folder / "run_python", config, values=[f"data.root='{folder}'"],
                        device=device, overwrite=True) as training:
        for event in training:
            if event.kind == splat.RunEventKind.STEP and kind != event.kind:
                thread = threading.Thread(target=training.interrupt)
                thread.start()
                thread.join()
            kind = event.kind
    stop = threading.Event()

    def cancel() -> None:
        while not stop.wait(0.001):
            device.cancel()

    thread = threading.Thread(target=cancel)
    thread.start()
    try:
        while True:
            predictor.predict(picture())
    except splat.Cancelled as error:
        tell("cancel", event=int(kind or 0), code=int(error.code), name=error.name)
    finally:
        stop.set()
        thread.join()


def case_busy() -> None:
    device = splat.Device()
    predictor = splat.Predictor(device)
    tensors = [splat.Tensor.zeros(device, (64, 64)) for _ in range(8)]
    scene, rasterizer = make_scene(), make_rasterizer(device)
    rasterizer.forward(scene, cameras_of(scene), WHITE)
    started, found = threading.Event(), []

    def work() -> None:
        started.set()
        for _ in range(4):
            found.append(predictor.predict(picture()).scene)

    thread = threading.Thread(target=work)
    thread.start()
    started.wait()
    for each in (device, *tensors, scene, rasterizer):
        each.close()
    thread.join()
    predictor.close()
    tell("busy", ply=ply(found[3]), result="ok")


def destroy_in_mixed_order(device_first: bool) -> int:
    """Let the collector end one device's objects. Returns the bytes that live on it afterwards."""
    device = splat.Device()
    tensor = splat.Tensor.zeros(device, (64, 64))
    rasterizer, scene = make_rasterizer(device), make_scene()
    state = rasterizer.state()
    rasterizer.forward(scene, cameras_of(scene), WHITE, state=state)
    predictor = splat.Predictor(device)
    predictor.predict(picture())
    if device_first:
        device.close()
    del rasterizer
    del predictor
    gc.collect()
    tensor.write(np.ones((64, 64), np.float32))
    del tensor
    del scene
    del state
    gc.collect()
    return 0 if device_first else device.memory.live_bytes


def main(folder: Path) -> None:
    # The import has compared the sizes of all structs with the library's.
    tell("version", version=splat.__version__, layout="ok")
    names = splat.prior_preset_text().encode()
    tell("presets", bytes=len(names), names=fnv(names))
    device = splat.Device()
    tell("device", kind=int(device.info.kind))
    scene = make_scene()
    case_render(device, scene)
    case_gradient(device, scene)
    predictor = splat.Predictor(device)
    prediction = predictor.predict(picture())
    tell("predict", gaussians=prediction.report["gaussians"], ply=ply(prediction.scene),
         found=int(prediction.pictures[0].found))
    case_judge(scene)
    case_maps()
    case_data(folder)
    case_errors(scene)
    case_cancel(device, predictor, folder)
    case_busy()
    live = destroy_in_mixed_order(False)
    destroy_in_mixed_order(True)
    tell("order", live_bytes=live, result="ok")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: smoke.py FOLDER")
    main(Path(sys.argv[1]))
