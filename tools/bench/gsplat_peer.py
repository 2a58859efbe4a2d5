#!/usr/bin/env python3
"""Times gsplat on a scene of 3D Gaussian splatting, as a peer of `vkrun bench raster --convention gsplat`.

    gsplat_peer.py SCENE.ply CAMERAS.json [--gsplat PATH]

PATH is a folder that holds the package gsplat: a source tree or a folder of installed packages. A source tree is
compiled at its first import, by all cores; TORCH_EXTENSIONS_DIR is where it is kept. --deadline ends a build or a
measurement that takes too long, with the compilers it started. CAMERAS.json is a transforms.json with one size and
one lens, as scenes.py writes it.

A call draws one view. `forward` is without gradients; `forward_backward` gives the gradients of means, scales,
rotations, opacities and harmonics from a fixed random gradient of the image. Scales and opacities are activated
beforehand. The views take turns, and so do the two kinds, until --seconds have passed, but at least 3 rounds. Times
are those between two CUDA events around a call; `wall_min_ms` and `wall_median_ms` are those of
the host's clock. Parameters that
are not named here have gsplat's defaults.

Prints one JSON object: {gsplat, torch, cuda, device, max_alpha, max_alpha_from, packed, packed_is_default, import_s,
scene, count, degree, width, height, views, background, forward, forward_backward, mean_colors}. forward and
forward_backward are {min_ms, median_ms, wall_min_ms, wall_median_ms, runs} over all views; mean_colors has red, green and blue of
each view. max_alpha, at which the opacity of a pixel is clamped, is 0.99 in libsplat: images of a version with
another limit differ. Everything else that is printed, also by gsplat's build, goes to --log.

Exit status  0 success, 1 a pass failed, 2 wrong usage, 3 there is no PyTorch, CUDA device or gsplat, 4 a file
             cannot be read, 5 the deadline has passed
"""

import argparse
import inspect
import json
import os
import pathlib
import re
import signal
import statistics
import sys
import threading
import time
import traceback

NAME = "gsplat_peer.py"
TO_OPENCV = [1.0, -1.0, -1.0, 1.0]


class Failure(Exception):
    def __init__(self, status, message):
        super().__init__(message)
        self.status = status


def color(text):
    numbers = [float(part) for part in text.split(",")]
    if len(numbers) != 3:
        raise ValueError
    return numbers


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("scene", type=pathlib.Path)
    add("cameras", type=pathlib.Path)
    add("--gsplat", type=pathlib.Path, metavar="PATH", help="default: the interpreter's own")
    add("--seconds", type=float, default=8, help="of timing; default 8")
    add("--deadline", type=float, metavar="S", help="end after so many seconds in all")
    add("--packed", choices=["default", "on", "off"], default="default")
    add("--background", type=color, default="0,0,0", metavar="R,G,B")
    add("--log", default=os.devnull, metavar="FILE", help="default: it is dropped")
    parser.set_defaults(stage="starting")
    return parser.parse_args()


def one_line(error):
    """The line of a compiler's output that names an error, or the first."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    named = [line for line in lines if re.search(r"\berror\b\s*[:C]", line)]
    return (named or lines or [type(error).__name__])[0][:500]


def stop_all(options, stderr):
    """Ends the build tool, which ends its compilers, then this process. Runs in a thread of its own."""
    try:
        children = pathlib.Path(f"/proc/self/task/{os.getpid()}/children").read_text(encoding="ascii").split()
    except OSError:
        children = []
    for child in children:
        os.kill(int(child), signal.SIGTERM)
    print(f"{NAME}: the deadline of {options.deadline:g} s has passed while {options.stage}", file=stderr, flush=True)
    os._exit(5)


def load_torch():
    try:
        import torch
        torch.cuda.init()
        torch.zeros(1, device="cuda")
        return torch
    except (ImportError, OSError, RuntimeError, AssertionError) as missing:
        raise Failure(3, f"no PyTorch with a CUDA device: {one_line(missing)}") from missing


def load_gsplat(torch, folder):
    """The package, from the folder if one is given. PyTorch is loaded before, so that the folder cannot replace it."""
    if folder is not None:
        if not (folder / "gsplat/__init__.py").is_file():
            raise Failure(3, f"'{folder}' has no gsplat/__init__.py")
        sys.path.insert(0, str(folder.resolve()))
    os.environ.setdefault("MAX_JOBS", str(os.cpu_count()))
    os.environ.setdefault("TORCH_CUDA_ARCH_LIST", "{}.{}".format(*torch.cuda.get_device_capability()))
    try:
        import gsplat
        from gsplat.cuda import _backend
    except Exception as failed:
        traceback.print_exc()
        raise Failure(3, f"gsplat cannot be imported: {one_line(failed)}") from failed
    if _backend._C is None:
        raise Failure(3, "gsplat is without CUDA: it is not compiled, and found no nvcc")
    return gsplat


def max_alpha_of(gsplat):
    """The largest opacity of a pixel, and where it is read. Sources lie beside the package's Python files."""
    root = pathlib.Path(gsplat.__file__).parent
    patterns = (("cuda/include/Common.h", r"#define\s+MAX_ALPHA\s+(0\.\d+)"),
                ("cuda/csrc/RasterizeToPixels3DGSFwd.cu", r"alpha\s*=\s*min\(\s*(0\.\d+)f?\s*,"))
    for name, pattern in patterns:
        try:
            found = re.search(pattern, (root / name).read_text(encoding="utf-8"))
        except OSError:
            continue
        if found:
            return float(found[1]), f"gsplat/{name}"
    numbers = [int(n) for n in re.findall(r"\d+", gsplat.__version__)[:2]]
    return (0.99 if numbers >= [1, 6] else 0.999), f"version {gsplat.__version__}"


def read_scene(torch, path):
    """Activated leaves on the GPU: means, quats, scales, opacities and harmonics [N,K,3]."""
    data = path.read_bytes()
    head, end, body = data.partition(b"end_header\n")
    lines = head.decode("ascii", "replace").splitlines()
    names = [line.split()[2] for line in lines if line.startswith("property float ")]
    count = re.search(r"^element vertex (\d+)$", head.decode("ascii", "replace"), re.MULTILINE)
    known = {"ply", "format binary_little_endian 1.0", *(f"property float {name}" for name in names)}
    others = [line for line in lines if line not in known and not re.match("element vertex |comment ", line)]
    if not end or not count or others:
        raise Failure(4, f"'{path}': expected a binary .ply of floats, found '{(others or ['no header'])[0][:60]}'")
    values = torch.frombuffer(bytearray(body), dtype=torch.float32)
    if values.numel() != int(count[1]) * len(names) or not values.numel():
        raise Failure(4, f"'{path}': {values.numel()} numbers, expected {count[1]} x {len(names)}, and some")
    columns = dict(zip(names, values.view(-1, len(names)).unbind(1)))
    take = lambda *wanted: torch.stack([columns[name] for name in wanted], 1)
    rest = [f"f_rest_{i}" for i in range(sum(name.startswith("f_rest_") for name in names))]
    if len(rest) not in (0, 9, 24, 45):
        raise Failure(4, f"'{path}': {len(rest)} f_rest_, expected 0, 9, 24 or 45")
    sh = take("f_dc_0", "f_dc_1", "f_dc_2")[:, None]
    if rest:
        sh = torch.cat([sh, take(*rest).view(len(sh), 3, -1).transpose(1, 2)], 1)
    leaves = {"means": take("x", "y", "z"), "quats": take("rot_0", "rot_1", "rot_2", "rot_3"),
              "scales": take("scale_0", "scale_1", "scale_2").exp(), "opacities": columns["opacity"].sigmoid(),
              "colors": sh}
    return {name: leaf.contiguous().to("cuda").requires_grad_() for name, leaf in leaves.items()}


def read_cameras(torch, path):
    """Width, height, intrinsics [1,3,3], and world to camera of each view [1,4,4]."""
    file = json.loads(path.read_text(encoding="utf-8"))
    width, height = int(file["w"]), int(file["h"])
    lens = torch.tensor([[[file["fl_x"], 0, file["cx"]], [0, file["fl_y"], file["cy"]], [0, 0, 1]]])
    poses = torch.tensor([frame["transform_matrix"] for frame in file["frames"]], dtype=torch.float64)
    views = torch.linalg.inv(poses @ torch.diag(torch.tensor(TO_OPENCV, dtype=torch.float64)))
    return width, height, lens.float().to("cuda"), list(views.float().to("cuda").split(1))


class Drawing:
    """The calls that are timed."""

    def __init__(self, torch, rasterization, options):
        self.torch, self.rasterization = torch, rasterization
        self.leaves = read_scene(torch, options.scene)
        self.width, self.height, self.lens, self.views = read_cameras(torch, options.cameras)
        self.degree = round(self.leaves["colors"].shape[1] ** 0.5) - 1
        default = inspect.signature(rasterization).parameters["packed"].default
        self.packed = default if options.packed == "default" else options.packed == "on"
        self.packed_is_default = self.packed == default
        self.background = options.background
        self.backgrounds = torch.tensor([self.background]).to("cuda") if any(self.background) else None
        torch.manual_seed(1)
        self.gradient = torch.rand(1, self.height, self.width, 3).to("cuda")

    def draw(self, view):
        return self.rasterization(
            **self.leaves, viewmats=view, Ks=self.lens, width=self.width, height=self.height, sh_degree=self.degree,
            packed=self.packed, backgrounds=self.backgrounds)[0]

    def forward(self, view):
        with self.torch.no_grad():
            return self.draw(view)

    def forward_backward(self, view):
        return self.torch.autograd.grad(self.draw(view), list(self.leaves.values()), self.gradient)

    def mean_colors(self):
        return [self.forward(view).double().mean((0, 1, 2)).tolist() for view in self.views]


def timed(torch, call, view):
    """Milliseconds between two CUDA events, and on the host's clock."""
    begin, end = (torch.cuda.Event(enable_timing=True) for _ in range(2))
    torch.cuda.synchronize()
    start = time.perf_counter()
    begin.record()
    call(view)
    end.record()
    end.synchronize()
    return begin.elapsed_time(end), (time.perf_counter() - start) * 1e3


def measure(torch, drawing, seconds):
    """Figures of both kinds of passes."""
    kinds = {"forward": drawing.forward, "forward_backward": drawing.forward_backward}
    times = {kind: [] for kind in kinds}
    for view in drawing.views:
        for call in kinds.values():
            timed(torch, call, view)
    start, rounds = time.perf_counter(), 0
    while rounds < 3 or time.perf_counter() - start < seconds:
        for view in drawing.views:
            for kind, call in kinds.items():
                times[kind].append(timed(torch, call, view))
        rounds += 1
    figures = {}
    for kind, pairs in times.items():
        device, wall = zip(*pairs)
        figures[kind] = {"min_ms": min(device), "median_ms": statistics.median(device), "wall_min_ms": min(wall),
                         "wall_median_ms": statistics.median(wall), "runs": len(pairs)}
    return figures


def run(options):
    options.stage = "loading PyTorch"
    torch = load_torch()
    options.stage = "importing or compiling gsplat"
    start = time.perf_counter()
    gsplat = load_gsplat(torch, options.gsplat)
    import_s = time.perf_counter() - start
    options.stage = "reading the scene"
    try:
        drawing = Drawing(torch, gsplat.rasterization, options)
    except (OSError, ValueError, KeyError, TypeError) as failed:
        missing = "there is no " if isinstance(failed, KeyError) else ""
        raise Failure(4, f"'{options.scene}' or '{options.cameras}': {missing}{one_line(failed)}") from failed
    options.stage = "measuring"
    max_alpha, max_alpha_from = max_alpha_of(gsplat)
    figures = measure(torch, drawing, options.seconds)
    return {"gsplat": gsplat.__version__, "torch": torch.__version__, "cuda": torch.version.cuda,
            "device": torch.cuda.get_device_name(), "max_alpha": max_alpha, "max_alpha_from": max_alpha_from,
            "packed": drawing.packed, "packed_is_default": drawing.packed_is_default, "import_s": round(import_s, 3),
            "scene": options.scene.name, "count": len(drawing.leaves["means"]), "degree": drawing.degree,
            "width": drawing.width, "height": drawing.height, "views": len(drawing.views),
            "background": drawing.background, **figures, "mean_colors": drawing.mean_colors()}


def separate(options):
    """Standard output and error for the caller alone; file descriptors 1 and 2 go to the log."""
    own = [os.fdopen(os.dup(number), "w") for number in (1, 2)]
    log = os.open(options.log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    os.dup2(log, 1)
    os.dup2(log, 2)
    return own


def main():
    options = parse()
    try:
        output, stderr = separate(options)
    except OSError as failed:
        print(f"{NAME}: {failed}", file=sys.stderr)
        return 4
    try:
        if options.deadline:
            watch = threading.Timer(options.deadline, stop_all, [options, stderr])
            watch.daemon = True
            watch.start()
        print(json.dumps(run(options)), file=output, flush=True)
        return 0
    except Failure as failed:
        message, status = failed, failed.status
    except Exception as failed:
        traceback.print_exc()
        places = [call.lineno for call in traceback.extract_tb(failed.__traceback__) if call.filename == __file__]
        message, status = f"line {places[-1]}: {type(failed).__name__}: {one_line(failed)}", 1
    print(f"{NAME}: {message}", file=stderr, flush=True)
    return status


if __name__ == "__main__":
    sys.exit(main())
