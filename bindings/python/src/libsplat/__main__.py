"""What runs without a program: a demonstration, and facts about this machine.

    python3 -m libsplat demo [PICTURE] [--out FOLDER]
    python3 -m libsplat doctor

Exit status: 0 done, 1 failed, 2 wrong usage, 3 no Vulkan device that can be used.
"""
import argparse
import base64
import html
import platform
import sys
import tempfile
import time
from pathlib import Path
from typing import List, Optional

import numpy as np

import libsplat as splat

from ._library import path as library

SIDE, FRAMES, VIEWS = 256, 24, 6

PAGE = """<!doctype html>
<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>libsplat</title>
<style>body {{ font: 16px sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; color: #222 }}
figure {{ display: inline-block; margin: 0 1em 1em 0 }} img {{ border: 1px solid #ccc; width: {side}px }}</style>
<h1>A scene from one picture</h1>
<p>{facts}</p>
<figure><img src="{picture}" alt="the picture"><figcaption>the picture</figcaption></figure>
<figure><img src="{turning}" alt="the scene from all around"><figcaption>the scene, turning</figcaption></figure>
<h2>From {count} sides</h2>
<p>{views}</p>
<p>{about}</p>
</html>
"""

ABOUT = ("The built-in weights are those of a small network that knows cars of 64 x 64 pixels only. scene.ply, "
         "beside this page, has the Gaussians.")


def embedded(png: bytes) -> str:
    """A picture inside of the page."""
    return "data:image/png;base64," + base64.b64encode(png).decode()


def synthetic_car() -> splat.Image:
    """A car that the built-in weights were not trained on."""
    with tempfile.TemporaryDirectory() as folder:
        splat.write_synthetic(folder, seed=1, resolution=64, test=2, test_views=16)
        seen, = Path(folder).glob("*/*_test/000001_*/rgb/000008.png")
        return splat.Image.load(seen)


def demo(given: Optional[str], folder: Path) -> None:
    """Make a scene from a picture, draw it, and show both in a page."""
    start = time.perf_counter()
    picture = splat.Image.load(given) if given else synthetic_car()
    prediction = splat.Predictor().predict(picture)
    predicted = time.perf_counter()
    scene = prediction.scene
    frames = splat.render(scene, splat.Camera.orbit(scene, FRAMES, width=SIDE, height=SIDE))
    drawn = time.perf_counter()

    folder.mkdir(parents=True, exist_ok=True)
    scene.save(folder / "scene.ply")
    turning = splat.animation_to_bytes(frames, 80)
    (folder / "orbit.png").write_bytes(turning)
    views = frames[::FRAMES // VIEWS]
    for index, view in enumerate(views):
        view.save(folder / f"view{index}.png")
    facts = (f"{len(scene)} Gaussians in {predicted - start:.1f} s, {FRAMES} views of {SIDE} x {SIDE} pixels in "
             f"{drawn - predicted:.1f} s, by libsplat {splat.__version__} on {splat.default_device().info.name}.")
    (folder / "report.html").write_text(PAGE.format(
        side=SIDE, facts=html.escape(facts), picture=embedded(picture.to_bytes()), turning=embedded(turning),
        count=len(views), views=" ".join(f'<img src="{embedded(view.to_bytes())}" alt="">' for view in views),
        about=ABOUT), "utf-8")
    print(facts)
    print(f"open {folder / 'report.html'}; there are scene.ply, orbit.png and view0.png to view{VIEWS - 1}.png, too")


def version_text(version: int) -> str:
    """1.3.246, of a number of Vulkan's."""
    return f"{version >> 22 & 0x7F}.{version >> 12 & 0x3FF}.{version & 0xFFF}"


def doctor() -> None:
    """Tell versions, files and devices, and open the best device."""
    print(f"libsplat {splat.__version__}: {library}")
    print(f"Python {platform.python_version()}, NumPy {np.__version__}, {platform.platform()}")
    print(f"weights: {splat.builtin_weights()}")
    for info in splat.devices():
        usable = "usable" if info.usable else "not usable"
        vulkan = version_text(info.vulkan_version)
        print(f"device {info.index}: {info.name}, {info.kind.name.lower()}, Vulkan {vulkan}, {info.driver}: "
              f"{usable}{': ' if info.reason else ''}{info.reason}")
    print(f"opened: {splat.default_device().info.name}")


def main(arguments: Optional[List[str]] = None) -> int:
    """The program; gives its exit status."""
    parser = argparse.ArgumentParser("python3 -m libsplat", description="Shows what libsplat does on this machine.",
                                     epilog="Exit status: 0 done, 1 failed, 2 wrong usage, 3 no usable Vulkan device.")
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("demo", help="make a scene from a picture and show it in a page")
    one.add_argument("picture", nargs="?", help="a picture of a car; default: one drawn here")
    one.add_argument("--out", type=Path, default=Path("out"), help="folder of the results (out)")
    commands.add_parser("doctor", help="tell versions, files and devices of this machine")
    given = parser.parse_args(arguments)
    try:
        if given.command == "demo":
            demo(given.picture, given.out)
        else:
            doctor()
    except (splat.Error, OSError) as error:
        print(f"libsplat: {error}", file=sys.stderr)
        return 3 if isinstance(error, (splat.NoDevice, splat.Unsupported)) else 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
