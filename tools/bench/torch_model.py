#!/usr/bin/env python3
"""Splatter Image's network in PyTorch: `vkrun bench model --peer` alternates it with libsplat.

Random weights, no embedding, no dropout; the head that makes Gaussians is part of a pass. Protocol: one
line "ready {json}" on standard output; then for each line of standard input one of milliseconds,
"forward" for a pass without gradients, "step" for one with, whose backward pass adds the gradients of the
sum of all outputs to those of the parameters; "quit" ends. With --exchange FOLDER the network has the
weights and images of weights.safetensors and images.f32 in there, and "outputs" writes float32.f64 and
float64.f64: the raw output, then means, opacities, scales, rotations and spherical harmonics, computed in
either precision and written as float64. With --check FILE it compares outputs and
gradients with a file of golden/net instead.

With --device cuda the network and its input are on the GPU, and a time ends when the GPU is done. Products are
real float32 unless --tf32 is given, and cuDNN measures its algorithms in the first passes. With --graphs the
first pass of a kind captures a CUDA graph, and all passes of that kind replay it.

Source  Szymanowicz et al. 2024, arXiv:2312.13150; the U-Net is DDPM++ of Karras et al. 2022,
        arXiv:2206.00364, without noise conditioning
Exit status  0 success, 1 --check found a difference, 2 wrong usage, 3 there is no PyTorch, or no CUDA device where
             it was asked for, 4 a file cannot be read or a pass failed
"""

import argparse
import copy
import json
import lzma
import math
import os
import sys
import time
import traceback


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    add = parser.add_argument
    add("--resolution", type=int, default=128)
    add("--channels", type=int, default=3, help="of the input images, without the origin distance")
    add("--base-dim", type=int, default=128)
    add("--num-blocks", type=int, default=4)
    add("--channel-mult", default="1,2,2,2")
    add("--attention", default="16", help="resolutions with attention")
    add("--views", type=int, default=1, help="per object, attending to each other")
    add("--batch", type=int, default=1, help="images of a pass: objects times views")
    add("--head", default="depth:1,point:3,opacity:1,scale:3,rotation:4,colour:3,rest:9",
        help="blocks of output channels in their order, as libsplat's layout of the head has them")
    add("--lora", type=int, default=0, help="rank of adapters, then the only trained parameters")
    add("--device", choices=["cpu", "cuda"], default="cpu")
    add("--tf32", action="store_true", help="cuda: allow TF32 in products of matrices and in cuDNN")
    add("--graphs", action="store_true", help="cuda: replay passes as CUDA graphs")
    add("--threads", type=int, help="cpu: default 2")
    add("--passes", type=int, default=0, help="time so many of each kind, print their minima, and end")
    add("--isa", choices=["default", "avx2"], help="cpu: default, or at most 256-bit vectors")
    add("--layout", choices=["contiguous", "channels_last"], default="contiguous")
    add("--fov", type=float, default=51.98948897809546, help="degrees")
    add("--inverted-x", type=int, default=0, help="1: rays' x axis points left")
    add("--inverted-y", type=int, default=1, help="0: rays' y axis points up")
    add("--znear", type=float, default=0.8)
    add("--zfar", type=float, default=1.8)
    add("--exchange", metavar="FOLDER", help="with weights and images; outputs go there")
    add("--check", metavar="FILE", help=".npz or .npz.xz of golden/net without embedding")
    options = parser.parse_args()
    refuse_without_effect(options)
    options.threads, options.isa = options.threads or 2, options.isa or "default"
    return options


def refuse_without_effect(options):
    of_the_other = ("threads", "isa") if options.device == "cuda" else ("tf32", "graphs")
    for name in of_the_other:
        if getattr(options, name):
            stop(2, f"--{name} has no effect with --device {options.device}")
    if options.graphs and options.check:
        stop(2, "--graphs has no effect with --check, which runs one pass")


def stop(status, message):
    print(f"torch_model.py: {message}", file=sys.stderr)
    sys.exit(status)


def first_line(error):
    return next(iter(str(error).strip().splitlines()), type(error).__name__)


def limit(options):
    """Set variables that libraries read once, when they are loaded."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = str(options.threads)
    if options.isa == "avx2":
        os.environ["ATEN_CPU_CAPABILITY"] = "avx2"
        os.environ["DNNL_MAX_CPU_ISA"] = "AVX2"
        os.environ["OPENBLAS_CORETYPE"] = "Haswell"


OPTIONS = parse()
limit(OPTIONS)
try:
    import torch
    import torch.nn.functional as F
    from torch import nn
except (ImportError, OSError) as missing:
    stop(3, first_line(missing))

HALF = math.sqrt(0.5)


class Conv(nn.Module):
    """Resampling (x2 nearest, or 2 x 2 mean), then a convolution; an adapter where `rank` is not 0."""

    def __init__(self, cin, cout, kernel, up=False, down=False, rank=0, alpha=1.0):
        super().__init__()
        self.weight = nn.Parameter(torch.empty(cout, cin, kernel, kernel))
        self.bias = nn.Parameter(torch.zeros(cout))
        nn.init.xavier_uniform_(self.weight)
        self.up, self.down, self.rank = up, down, rank
        if up or down:
            self.register_buffer("resample_filter", torch.full((1, 1, 2, 2), 0.25))
        if rank:
            self.scale = alpha / rank
            self.lora_A = nn.Parameter(torch.randn(rank, cin * kernel * kernel) * 0.01)
            self.lora_B = nn.Parameter(torch.zeros(cout, rank))

    def forward(self, x):
        if self.up:
            x = F.interpolate(x, scale_factor=2, mode="nearest")
        if self.down:
            x = F.avg_pool2d(x, 2)
        weight = self.weight
        if self.rank:
            weight = weight + (self.lora_B @ self.lora_A).view_as(weight) * self.scale
        return F.conv2d(x, weight, self.bias, padding=weight.shape[-1] // 2)


def norm(channels):
    return nn.GroupNorm(min(32, channels // 4), channels, eps=1e-6)


def attend(q, k, v):
    """[n,c,L] each: softmax over keys."""
    weights = torch.softmax(torch.einsum("ncq,nck->nqk", q, k / math.sqrt(k.shape[1])), dim=2)
    return torch.einsum("nqk,nck->ncq", weights, v)


class Block(nn.Module):
    def __init__(self, cin, cout, o, up=False, down=False, attention=False):
        super().__init__()
        resamples = up or down
        self.norm0 = norm(cin)
        self.conv0 = Conv(cin, cout, 3, up, down, 0 if resamples else o.lora, o.alpha)
        self.norm1 = norm(cout)
        self.conv1 = Conv(cout, cout, 3, rank=o.lora, alpha=o.alpha)
        self.skip = Conv(cin, cout, 1, up, down) if resamples or cin != cout else None
        self.views, self.attention = o.views, attention
        if attention:
            self.norm2 = norm(cout)
            self.qkv = Conv(cout, 3 * cout, 1, rank=o.lora, alpha=o.alpha)
            self.proj = Conv(cout, cout, 1, rank=o.lora, alpha=o.alpha)

    def forward(self, x):
        y = self.conv0(F.silu(self.norm0(x)))
        y = self.conv1(F.silu(self.norm1(y)))
        y = (y + (x if self.skip is None else self.skip(x))) * HALF
        return self.attended(y) if self.attention else y

    def attended(self, y):
        n, c, h, w = y.shape
        v = self.views
        if v > 1:  # the views of an object one below the other
            y = y.view(n // v, v, c, h, w).transpose(1, 2).reshape(n // v, c, v * h, w)
        q, k, value = self.qkv(self.norm2(y)).reshape(y.shape[0], c, 3, -1).unbind(2)
        y = (self.proj(attend(q, k, value).reshape(y.shape)) + y) * HALF
        if v > 1:
            y = y.view(n // v, c, v, h, w).transpose(1, 2).reshape(n, c, h, w)
        return y


class Encoder(nn.Module):
    """The U-Net; names are those of published state dicts."""

    def __init__(self, o, outputs):
        super().__init__()
        widths = [o.base_dim * m for m in o.channel_mult]
        at = lambda level: f"{o.resolution >> level}x{o.resolution >> level}"
        attends = lambda level: (o.resolution >> level) in o.attention
        self.enc, self.dec = nn.ModuleDict(), nn.ModuleDict()
        c, skips = o.base_dim, [o.base_dim]
        self.enc[at(0) + "_conv"] = Conv(o.channels, c, 3)
        for level, width in enumerate(widths):
            if level:
                self.enc[at(level) + "_down"] = Block(c, c, o, down=True)
                skips.append(c)
            for i in range(o.num_blocks):
                self.enc[f"{at(level)}_block{i}"] = Block(c, width, o, attention=attends(level))
                c = width
                skips.append(c)
        for level in reversed(range(len(widths))):
            if level == len(widths) - 1:
                self.dec[at(level) + "_in0"] = Block(c, c, o, attention=True)
                self.dec[at(level) + "_in1"] = Block(c, c, o)
            else:
                self.dec[at(level) + "_up"] = Block(c, c, o, up=True)
            for i in range(o.num_blocks + 1):
                last = i == o.num_blocks and attends(level)
                self.dec[f"{at(level)}_block{i}"] = Block(c + skips.pop(), widths[level], o,
                                                          attention=last)
                c = widths[level]
        self.dec[at(0) + "_aux_norm"] = norm(c)
        self.dec[at(0) + "_aux_conv"] = Conv(c, outputs, 3)

    def forward(self, x):
        skips = []
        for layer in self.enc.values():
            x = layer(x)
            skips.append(x)
        for name, layer in self.dec.items():
            if "_block" in name:
                x = torch.cat([x, skips.pop()], dim=1)
            x = F.silu(layer(x)) if name.endswith("_aux_norm") else layer(x)
        return x


class Network(nn.Module):
    def __init__(self, o):
        super().__init__()
        self.head = o.head
        channels = sum(o.head.values())
        self.encoder = Encoder(o, channels)
        self.out = Conv(channels, channels, 1)

    def forward(self, x):
        return self.out(self.encoder(x))


def rays_of(resolution, fov_degrees, inverted_x=0, inverted_y=1):
    focal = resolution / (2 * math.tan(math.radians(fov_degrees) / 2))
    side = (torch.arange(resolution) + 0.5 - resolution / 2) / focal
    y, x = torch.meshgrid(side, side, indexing="ij")
    x, y = -x if inverted_x else x, y if inverted_y else -y
    return torch.stack([x, y, torch.ones_like(x)])[None]


class Predictor(nn.Module):
    """Images [N,C,R,R] to Gaussians of each object, its views one after the other."""

    def __init__(self, o):
        super().__init__()
        self.views, self.near, self.far = o.views, o.znear, o.zfar
        self.register_buffer("ray_dirs", rays_of(o.resolution, o.fov, o.inverted_x, o.inverted_y))
        self.register_buffer("sh_basis", torch.tensor([[0., 0, -1], [-1, 0, 0], [0, 1, 0]]), False)
        self.network_with_offset = Network(o)

    def forward(self, x, v2w, quaternion):
        """v2w [N,4,4] of row vectors, quaternion [N,4] w x y z."""
        raw = self.network_with_offset(x)
        head = self.network_with_offset.head
        block = {name: part.flatten(2).transpose(1, 2)
                 for name, part in zip(head, raw.split(list(head.values()), dim=1))}
        depth = block["depth"]
        rays = self.ray_dirs.flatten(2).transpose(1, 2)
        points = rays * (torch.sigmoid(depth) * (self.far - self.near) + self.near) + block["point"]
        points = torch.cat([points, torch.ones_like(depth)], dim=2) @ v2w
        q, r = quaternion[:, None], F.normalize(block["rotation"], dim=2)
        w = q[..., :1] * r[..., :1] - (q[..., 1:] * r[..., 1:]).sum(2, True)
        xyz = q[..., :1] * r[..., 1:] + r[..., :1] * q[..., 1:] + torch.cross(
            q[..., 1:].expand_as(r[..., 1:]), r[..., 1:], dim=2)
        made = {"xyz": points[..., :3] / (points[..., 3:] + 1e-10),
                "opacity": torch.sigmoid(block["opacity"]), "scaling": torch.exp(block["scale"]),
                "rotation": torch.cat([w, xyz], dim=2), "features_dc": block["colour"][:, :, None]}
        if "rest" in block:
            turn = self.sh_basis.T @ v2w[:, :3, :3] @ self.sh_basis
            rest = block["rest"].unflatten(2, (3, 3))
            made["features_rest"] = torch.einsum("nmsc,nst->nmtc", rest, turn)
        n = x.shape[0] // self.views
        return {k: v.reshape(n, -1, *v.shape[2:]) for k, v in made.items()}


class Settings:
    """The options, or those of a golden file."""

    def __init__(self, options, golden=None):
        numbers = lambda text: [int(n) for n in text.split(",") if n]
        self.__dict__.update(vars(options))
        self.channel_mult, self.attention = numbers(options.channel_mult), numbers(options.attention)
        self.head = {name: int(count) for name, count in (part.split(":") for part in options.head.split(","))}
        self.alpha = 1.0
        if golden is None:
            return
        cfg = [int(n) for n in golden["cfg"]]
        self.resolution, self.channels, self.base_dim, self.num_blocks, sh_degree = cfg[:5]
        if sh_degree == 0:
            self.head.pop("rest", None)
        self.views = cfg[5] if cfg[6] else 1
        self.attention = [cfg[9]]
        self.znear, self.zfar, self.fov = (float(n) for n in golden["cfgf"][:3])
        if "lora_rank" in golden:
            self.lora, self.alpha = int(golden["lora_rank"]), float(golden["lora_alpha"])


def prepare_cuda():
    try:
        torch.cuda.init()
        torch.zeros(1, device="cuda")
    except (RuntimeError, AssertionError) as missing:
        stop(3, f"PyTorch {torch.__version__} has no CUDA device: {first_line(missing)}")
    torch.backends.cuda.matmul.allow_tf32 = OPTIONS.tf32
    torch.backends.cudnn.allow_tf32 = OPTIONS.tf32
    torch.backends.cudnn.benchmark = True


def build(settings):
    torch.set_num_threads(settings.threads)
    torch.manual_seed(1)
    model = Predictor(settings)
    if settings.lora:
        for name, parameter in model.named_parameters():
            parameter.requires_grad_("lora_" in name)
    return model.to(OPTIONS.device)


def check(path):
    """Largest error over the norm-wise tolerances of golden/net/INDEX.md: 2e-4 absolute of outputs,
    1e-4 relative of each gradient."""
    import numpy
    with (lzma.open if path.endswith(".xz") else open)(path, "rb") as file:
        golden = dict(numpy.load(file))
    model = build(Settings(OPTIONS, golden))
    take = lambda name: torch.from_numpy(golden[name]).float().to(OPTIONS.device)
    named = dict(model.named_parameters())
    given = {k[2:] for k in golden if k.startswith("p.")}
    if given != set(named):
        print("names differ:", sorted(given ^ set(named))[:6])
        return 1
    with torch.no_grad():
        for name, parameter in named.items():
            parameter.copy_(take("p." + name))
    flat = lambda name: take(name).flatten(0, 1)
    outputs = model(flat("x"), flat("v2w"), flat("quat"))
    sum((take("g." + k) * v).sum() for k, v in outputs.items()).backward()
    worst = max((v - take("o64." + k)).abs().max().item() for k, v in outputs.items())
    gradients = [k for k in golden if k.startswith("d.")]
    wrong = max(((named[k[2:]].grad - take(k)).norm() / take(k).norm()).item() for k in gradients)
    print(f"outputs: {worst:.1e} at most; {len(gradients)} gradients: {wrong:.1e} of their norm at most")
    return 0 if worst < 2e-4 and wrong < 1e-4 else 1


def blas():
    """The library of PyTorch's products on the CPU, or None if it is none of the fast ones."""
    if torch.backends.mkl.is_available():
        return "MKL"
    with open("/proc/self/maps", encoding="utf-8") as maps:
        return "OpenBLAS" if "openblas" in maps.read() else None


def read_floats(data):
    return torch.frombuffer(bytearray(data), dtype=torch.float32)


def load(model, path):
    """The parameters of a .safetensors file of float32, by their names."""
    with open(path, "rb") as file:
        entries = json.loads(file.read(int.from_bytes(file.read(8), "little")))
        data = file.read()
    for name, parameter in model.named_parameters():
        begin, end = entries[name]["data_offsets"]
        with torch.no_grad():
            parameter.copy_(read_floats(data[begin:end]).view(entries[name]["shape"]))


class Passes:
    def __init__(self):
        self.settings = Settings(OPTIONS)
        self.model = build(self.settings).eval()
        n, r = OPTIONS.batch, OPTIONS.resolution
        self.input = [torch.rand(n, OPTIONS.channels, r, r), torch.eye(4).repeat(n, 1, 1),
                      torch.tensor([1., 0, 0, 0]).repeat(n, 1)]
        if OPTIONS.exchange:
            load(self.model, os.path.join(OPTIONS.exchange, "weights.safetensors"))
            with open(os.path.join(OPTIONS.exchange, "images.f32"), "rb") as file:
                self.input[0] = read_floats(file.read()).view(n, OPTIONS.channels, r, r)
        if OPTIONS.layout == "channels_last":
            self.model = self.model.to(memory_format=torch.channels_last)
            self.input[0] = self.input[0].contiguous(memory_format=torch.channels_last)
        self.input = [value.to(OPTIONS.device) for value in self.input]
        self.graphs = {}

    def forward(self):
        with torch.no_grad():
            self.model(*self.input)

    def step(self):
        outputs = self.model(*self.input)
        torch.autograd.backward(list(outputs.values()), [torch.ones_like(v) for v in outputs.values()])

    def outputs(self):
        for name, dtype in ("float32", torch.float32), ("float64", torch.float64):
            model, values = copy.deepcopy(self.model).to(dtype), [value.to(dtype) for value in self.input]
            with torch.no_grad():
                made = model(*values)
                sh = [made[k] for k in ("features_dc", "features_rest") if k in made]
                parts = [model.network_with_offset(values[0]), made["xyz"], made["opacity"],
                         made["scaling"], made["rotation"], torch.cat(sh, dim=2)]
            with open(os.path.join(OPTIONS.exchange, name + ".f64"), "wb") as file:
                for part in parts:
                    file.write(part.contiguous().double().cpu().numpy().tobytes())

    def captured(self, kind):
        """The graph of a pass. Passes before it choose algorithms and make the gradients to which it adds."""
        side = torch.cuda.Stream()
        side.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(side):
            for _ in range(3):
                getattr(self, kind)()
        torch.cuda.current_stream().wait_stream(side)
        graph = torch.cuda.CUDAGraph()
        with torch.cuda.graph(graph):
            getattr(self, kind)()
        return graph

    def run(self, kind):
        if not OPTIONS.graphs or kind == "outputs":
            return getattr(self, kind)()
        if kind not in self.graphs:
            self.graphs[kind] = self.captured(kind)
        return self.graphs[kind].replay()

    def milliseconds(self, kind):
        wait = torch.cuda.synchronize if OPTIONS.device == "cuda" else lambda: None
        wait()
        start = time.perf_counter()
        self.run(kind)
        wait()
        return (time.perf_counter() - start) * 1e3

    def about(self):
        parameters = list(self.model.parameters())
        made = {"torch": torch.__version__, "device": OPTIONS.device, "layout": OPTIONS.layout,
                "parameters": sum(p.numel() for p in parameters),
                "trainable": sum(p.numel() for p in parameters if p.requires_grad)}
        if OPTIONS.device == "cpu":
            return made | {"threads": torch.get_num_threads(), "isa": OPTIONS.isa, "blas": blas(),
                           "onednn": torch.backends.mkldnn.is_available()}
        return made | {"name": torch.cuda.get_device_name(), "cuda": torch.version.cuda,
                       "cudnn": torch.backends.cudnn.version(), "tf32": OPTIONS.tf32, "graphs": OPTIONS.graphs}


def answer(passes, kind):
    """What a line of standard input is told. A pass that fails, for want of memory perhaps, ends nothing."""
    if kind not in ("forward", "step") + (("outputs",) if OPTIONS.exchange else ()):
        return f"error: '{kind}', expected forward, step, outputs (with --exchange) or quit"
    try:
        return f"{passes.milliseconds(kind):.6f}"
    except (RuntimeError, OSError) as failed:
        return f"error: {first_line(failed)}"


def main():
    if OPTIONS.device == "cuda":
        prepare_cuda()
    if OPTIONS.check:
        return check(OPTIONS.check)
    passes = Passes()
    print("ready", json.dumps(passes.about()), flush=True)
    if OPTIONS.passes:
        for kind in ("forward", "step"):
            times = [passes.milliseconds(kind) for _ in range(OPTIONS.passes + 1)]
            print(f"{kind} {min(times[1:]):.3f} ms", flush=True)
        return 0
    for line in sys.stdin:
        if line.strip() == "quit":
            break
        print(answer(passes, line.strip()), flush=True)
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Exception as failed:
        places = [call.lineno for call in traceback.extract_tb(failed.__traceback__) if call.filename == __file__]
        stop(4, f"line {places[-1]}: {type(failed).__name__}: {first_line(failed)}")
