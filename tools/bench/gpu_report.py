"""gpu.md of tools/bench/gpu: the figures of gpu.json as tables."""

KIB = 1024.0


def table(heads, rows):
    text = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return text + ["| " + " | ".join(str(cell).replace("|", "/") for cell in row) + " |" for row in rows] + [""]


def number(value, digits=3):
    return "" if value is None else f"{value:.{digits}g}"


def pair(figures, first="min"):
    """Minimum (or best) and median."""
    return "" if not figures else f"{number(figures[first])} / {number(figures['median'])}"


def size(count):
    for unit in ("B", "KiB", "MiB", "GiB"):
        if count < KIB or unit == "GiB":
            return f"{count:.0f} {unit}" if unit == "B" else f"{count:.1f} {unit}"
        count /= KIB
    return ""


def device(figures):
    driver, vulkan = figures["driver"], figures["vulkan"]
    rows = [(key, ", ".join(value) if isinstance(value, list) else size(value) if key.endswith("bytes") else value)
            for key, value in driver.items()]
    if "problem" in vulkan:
        rows.append(("memory", vulkan["problem"]))
    else:
        rows += [("lanes of a subgroup", " to ".join(map(str, vulkan["lanes"]))),
                 ("heaps", ", ".join(size(heap["bytes"]) + (" of the device" if heap["device"] else " of the host")
                                     for heap in vulkan["memory"]["heaps"])),
                 ("memory types", "; ".join(dict.fromkeys(t["kind"] for t in vulkan["memory"]["types"] if t["kind"]))),
                 ("cooperative matrices", "yes" if "VK_KHR_cooperative_matrix" in vulkan["extensions"] else "no")]
    rows += [(key, value) for key, value in figures.get("clocks", {}).items()]
    rows += [(f"{name} kernels", text) for name, text in figures["kernels"].items()]
    return table(["device", ""], rows)


def dispatch(figures):
    ceilings = figures["ceilings"]
    names = {"copy_gb_per_s": "copy by a kernel, GB/s", "transfer_gb_per_s": "vkCmdCopyBuffer, GB/s",
             "fma_tflop_per_s": "multiply-adds, TFLOP/s", "shuffle_t_per_s": "shuffles, 1e12/s"}
    text = table(["ceiling", "best / median"],
                 [(title, pair(ceilings[key], "best") or "no shuffles") for key, title in names.items()])
    rows = [(row["chain"], pair(row["us"]), pair(row["record_us"])) for row in figures["chains"]]
    rows += [("a submission of nothing", pair(figures["submit_us"]), ""),
             ("a submission of an empty list", pair(figures["submit_empty_list_us"]), "")]
    text += table(["chain of 1000 empty dispatches", "us each, min / median", "us to record"], rows)
    return text + table(["mapped memory", "write GB/s", "read GB/s", "read 4 bytes, us"],
                        [(row["memory"], number(row["write_gb_per_s"]), number(row["read_gb_per_s"]),
                          pair(row["read_4_bytes_us"])) for row in figures["mapped"]])


def checks(figures):
    rows = [(f"self-test of {name} kernels", text) for name, text in figures.get("self_test", {}).items()]
    for kind, found in figures.get("hashes", {}).items():
        rows.append((f"hashes of {kind}, twice", found.get("problem") or
                     f"{found['lines']} lines, " + ("equal" if found["equal"] else "**different**")))
    stress = figures.get("stress", {"problem": "not reached"})
    rows.append(("stress --quick", stress.get("problem") or
                 f"{stress['results']} results, {len(stress['failed'])} failed, worst error / allowed "
                 f"{stress['worst']:.2f}"))
    for layer, found in figures.get("tests", {}).items():
        failed = "".join(f"; **{name}**" for name in found["failed"][:20])
        left_out = f"; not run: {', '.join(found['left_out'])}" if found["left_out"] else ""
        rows.append((f"tests of {layer}", f"{found['passed']} passed, {found['skipped']} skipped, "
                                          f"{len(found['failed'])} failed{failed}{left_out}"))
    return table(["check", "result"], rows)


def ops(figures):
    heads = ["operator", "case", "direction", "replays", "ms, min / median", "TFLOP/s", "GB/s", "of the ceiling",
             "rel. L2 to float64"]
    rows = []
    for row in figures["rows"]:
        if "problem" in row:
            rows.append((row["op"], row["problem"], *[""] * 7))
            continue
        wrong = "" if row.get("good") in (True, None) else " **wrong**"
        rows.append((row["op"], row["case"], row["direction"], row["replays"], pair(row["ms"]),
                     number(row.get("tflop_per_s")), number(row.get("gb_per_s")),
                     f"{100 * row['of_ceiling']:.0f} %" if "of_ceiling" in row else "",
                     number(row.get("relative_l2"), 2) + wrong))
    return [f"Shapes: {figures['shapes']}. Rates are those of the shortest run. The ceiling is that of multiply-adds "
            "or of copies, whichever is nearer. Operations are those of a direct convolution: F(2x2) and F(4x4) do "
            "fewer and may pass 100 %.", ""] + table(heads, rows)


def networks(figures):
    heads = ["network", "objects", "pass", "wall ms, min / median", "on the device ms", "submits", "dispatches",
             "fills and copies", "barriers", "levels", "bytes moved", "GFLOP/s"]
    rows = []
    for row in figures["rows"]:
        if "problem" in row:
            rows.append((row["network"], row["objects"], row["problem"], *[""] * 9))
            continue
        for key, title in (("forward", "forward"), ("forward_backward", "forward + backward")):
            lists = row["lists"].get(key, {})
            rows.append((row["network"], row["objects"], title, pair({"min": row[key]["min_ms"],
                                                                      "median": row[key]["median_ms"]}),
                         number(lists.get("device_ms"), 4), lists.get("submits", row["lists"].get("problem", "")),
                         lists.get("dispatches", ""), lists.get("copies", ""), lists.get("barriers", ""),
                         lists.get("levels", ""),
                         size(lists["bytes"]) if "bytes" in lists else "", number(row[key]["gflop_per_s"], 4)))
    return ["The times on the device are those of one more pass with timestamps; bytes as the operators count them.",
            ""] + table(heads, rows)


def raster(figures):
    heads = ["scene", "Gaussians", "size", "pass", "wall ms, min / median", "stages on the device, ms", "largest error"]
    rows = []
    for row in figures["rows"]:
        if "problem" in row:
            rows.append((row["scene"], row["problem"], *[""] * 5))
            continue
        fast = row["fast"]
        for name in ("render", "forward", "backward"):
            stages = ", ".join(f"{stage} {number(ms)}" for stage, ms in fast[name]["stages_ms"].items())
            error = fast["max_gradient_error" if name == "backward" else "max_rgb_error"]
            rows.append((row["scene"], row["gaussians"], f"{row['width']}x{row['height']}", name,
                         pair({"min": fast[name]["min_ms"], "median": fast[name]["median_ms"]}), stages,
                         number(error, 2)))
    return table(heads, rows)


def training(figures):
    heads = ["objects", "views", "steps", "ms a step, min / median", "network", "rendering", "update"]
    return table(heads, [(row["objects"], row["views"], row["problem"], *[""] * 4) if "problem" in row else
                         (row["objects"], row["views"], row["steps"], pair(row["step_ms"]), number(row["network_ms"]),
                          number(row["render_ms"]), number(row["update_ms"])) for row in figures["rows"]])


def peers(figures):
    return table(["peer", "what", "peer ms, min / median", "libsplat ms, min / median", "peer / libsplat", "versions"],
                 [(row["peer"], row["what"], row.get("problem") or pair(row["peer_ms"]), pair(row.get("ours_ms")),
                   number(row["peer_ms"]["min"] / row["ours_ms"]["min"])
                   if row.get("ours_ms") and row.get("peer_ms") else "",
                   row.get("versions", "")) for row in figures["rows"]])


SECTIONS = {"device": ("Device", device), "dispatch": ("Ceilings and overheads", dispatch),
            "checks": ("Checks", checks), "ops": ("Operators", ops), "networks": ("Networks", networks),
            "raster": ("Rasterizer", raster), "training": ("Training steps", training), "peers": ("Peers", peers)}


def write(folder, document):
    found = document["device"]
    what = "A CPU, no GPU: " if found["kind"] == "cpu" else ""
    text = [f"# {what}{found['name']} ({found['driver']})", "",
            "By `tools/bench/gpu`; gpu.json beside this has every figure."]
    for name, (title, section) in SECTIONS.items():
        figures = document["parts"].get(name)
        if figures is None:
            continue
        text += ["", f"## {title}", ""]
        if "problem" in figures:
            text += [figures["problem"], ""]
        else:
            try:
                text += section(figures)
            except Exception as missing:  # in a part that was cut off or failed
                text += [f"Without a table: {type(missing).__name__} {missing}.", ""]
        text += [", ".join(str(figures[key]) for key in ("status", "code", "begun") if key in figures)
                 + f", {figures.get('seconds', 0)} of {figures.get('share', 0)} s."]
    whole = folder / "gpu.md.tmp"
    whole.write_text("\n".join(text).rstrip() + "\n", encoding="utf-8")
    whole.replace(folder / "gpu.md")
