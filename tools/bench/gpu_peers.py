"""Part `peers` of tools/bench/gpu: the same work by PyTorch with CUDA, by gsplat and by CUB's sort, where they are."""

import json
import pathlib
import tempfile

from programs import last_line

# Their configurations; None: the one that vkrun takes without.
NETWORKS = {"cars64": "tools/weights/cars64/config.json", "published": None}
# One row each: what, options of `vkrun bench model`.
TORCH = (("float32", []), ("TF32", ["--peer-tf32"]), ("float32, CUDA graphs", ["--peer-graphs"]),
         ("TF32, CUDA graphs", ["--peer-tf32", "--peer-graphs"]),
         ("float32, contiguous", ["--peer-layout", "contiguous"]))
PASSES = (("forward", "forward"), ("forward_backward", "forward + backward"))
MOST_OF_GSPLAT = 300  # seconds of a call, the first of which may build it
SORTED = (65536, 1048576, 1400000, 4194304)


def peers(bench, figures):
    figures["rows"] = rows = []
    for peer in (torch, sort, gsplat):  # the last one may have to be built for minutes
        try:
            rows.extend(peer(bench))
        except (KeyError, ValueError, TypeError) as problem:
            rows.append({"peer": peer.__name__, "what": "all", "problem": f"{type(problem).__name__}: {problem}"})


def pair(figures):
    return {"min": figures["min_ms"], "median": figures["median_ms"]}


def torch(bench):
    """PyTorch with CUDA; on a CPU the same network with two threads."""
    rows, python = [], bench.python("torch")
    if python is None:
        return [{"peer": "PyTorch", "what": "all", "problem": "no PyTorch here: --python PROGRAM names an interpreter"}]
    for name, config in NETWORKS.items():
        for what, options in TORCH if not bench.is_cpu else (("float32", []),):
            row = {"peer": "PyTorch", "what": f"{name}, 4 objects, {what}"}
            found = bench.json("bench", "model", *bench.config(config), "--objects", "4", "--backward", "--rounds",
                               "2" if bench.is_cpu else "10", "--peer", "--peer-device",
                               "cpu" if bench.is_cpu else "cuda", *options, "--python", python, most=bench.left() / 3)
            if "problem" in found:
                rows.append(row | found)
                continue
            peer = found["peer"]
            for key, title in PASSES:
                rows.append(row | {"what": f"{row['what']}: {title}", "peer_ms": pair(peer[key]),
                                   "ours_ms": pair(found[key]),
                                   "versions": ", ".join(f"{k} {peer[k]}" for k in ("torch", "cuda", "cudnn", "blas")
                                                         if peer.get(k))})
    return rows


def gsplat(bench):
    row = {"peer": "gsplat", "what": "scenes"}
    if bench.options.gsplat is None:
        return [row | {"problem": "not given: --gsplat PATH names the folder that holds it"}]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        status, _, errors = bench.script("numpy", "scenes.py", folder, most=bench.left() / 3)
        if status != 0:
            return [row | {"problem": f"no scenes: {last_line(errors)}"}]
        for name in ("si128_trained", "synth500k", "million"):
            scene, cameras = (pathlib.Path(folder, name + ending) for ending in (".ply", ".json"))
            status, output, errors = bench.script(
                "torch", "gsplat_peer.py", scene, cameras, "--gsplat", bench.options.gsplat, "--seconds", "2",
                "--deadline", str(max(int(min(bench.left(), MOST_OF_GSPLAT)), 1)), "--log", bench.out / "gsplat.log",
                TORCH_EXTENSIONS_DIR=str(bench.out / "gsplat"))
            row = {"peer": "gsplat", "what": name}
            if status != 0:
                rows.append(row | {"problem": last_line(errors)})
                continue
            found = json.loads(output)
            ours = bench.json("bench", "raster", scene, "--cameras", cameras, "--convention", "gsplat", "--no-plain",
                              "--no-skips", "--samples", "10", "--seconds", "2").get("result", {}).get("fast")
            versions = (f"gsplat {found['gsplat']}, torch {found['torch']}, alpha at most {found['max_alpha']} "
                        f"(ours 0.99), {'packed' if found['packed'] else 'not packed'}")
            for key, title in (("forward", "forward"), ("forward_backward", "forward + backward")):
                both = ("render",) if key == "forward" else ("forward", "backward")
                rows.append(row | {"what": f"{name}: {title}", "versions": versions,
                                   "peer_ms": {each: found[key][f"wall_{each}_ms"] for each in ("min", "median")},
                                   "ours_ms": ours and {each: sum(ours[one][each + "_ms"] for one in both)
                                                        for each in ("min", "median")}})
    return rows


def sort(bench):
    """CUB's radix sort of pairs beside ours, by the number of pairs and bits."""
    sizes = list(map(str, SORTED))
    status, output, errors = bench.call(bench.build / "tests/raster/radix_sort_bench", "--json", *sizes,
                                        most=bench.left() / 3)
    ours, problem = by_size(output), f"ours: {last_line(errors)}" if status != 0 else None
    theirs, versions = {}, ""
    with tempfile.TemporaryDirectory() as folder:
        program = pathlib.Path(folder, "cub_sort")
        source = bench.root / "tools/bench/cub_sort.cu"
        status, _, errors = bench.run_for(bench.left() / 2, ["nvcc", "-O3", "-arch=native", "-o", program, source],
                                          bench.plain)
        if status == 0:
            status, output, errors = bench.run_for(bench.left(), [program, *sizes], bench.plain)
            theirs = by_size(output)
            versions = f"CUB {json.loads(output)['cub']}" if theirs else ""
        missing = "no nvcc on this machine to build it with" if status == 127 else last_line(errors)
    rows = []
    for items, bits in dict.fromkeys([*ours, *theirs]):
        row = {"peer": "CUB", "what": f"sort of {items} pairs, {bits} bits", "versions": versions}
        row |= {"ours_ms": ours[items, bits]} if (items, bits) in ours else {}
        rows.append(row | ({"peer_ms": theirs[items, bits]} if (items, bits) in theirs else {"problem": missing}))
    return rows + ([{"peer": "CUB", "what": "sort", "problem": problem}] if problem else [])


def by_size(output):
    try:
        return {(one["items"], one["bits"]): pair(one) for one in json.loads(output)["results"]}
    except ValueError:
        return {}
