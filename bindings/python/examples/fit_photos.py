"""Fit a scene to a folder of photographs with their cameras: a COLMAP project, or transforms.json and images.

Arguments: the folder of photographs, a new folder for the run and its scene.ply, seconds (60).
"""
import sys
from pathlib import Path

import libsplat as splat

photos, run = sys.argv[1:3]
seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 60
with splat.Fit(run, photos, seconds=seconds) as fit:
    for event in fit:
        if event.text:
            print(event.text)
    fit.scene.save(Path(run) / "scene.ply")
    print(f"held-out PSNR {fit.report['val_psnr']:.2f} dB, {len(fit.scene)} Gaussians")
