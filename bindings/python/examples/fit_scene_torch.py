"""Fit a scene to photographs with torch.optim.Adam, in a loop to change; `splat.Fit` is faster, grows and resumes.

Arguments: a folder of photographs with their cameras in a transforms.json, a .ply file to write, steps (500). Lenses
must not distort. Every 8th photograph is held out. 2000 Gaussians begin at random where the cameras look.
"""
import sys
from pathlib import Path
from typing import Any

import numpy as np

import libsplat as splat
from libsplat.torch import rasterize, torch

COUNT, DEGREE = 2000, 1
folder, scene_file = Path(sys.argv[1]), sys.argv[2]
steps = int(sys.argv[3]) if len(sys.argv) > 3 else 500
cameras = sorted(splat.Camera.load(folder / "transforms.json"), key=lambda camera: camera.name)
pictures = [splat.Image.load(folder / camera.name).planes()[:3] for camera in cameras]
photos = [torch.from_numpy(picture.transpose(1, 2, 0)) for picture in pictures]

# The place that is nearest to the axes of all cameras, and their distance from it.
poses = np.linalg.inv([camera.world_to_camera for camera in cameras])
centers, axes = poses[:, :3, 3], poses[:, :3, 2]
across = np.eye(3) - axes[:, :, None] * axes[:, None]
target = np.linalg.solve(across.sum(0), np.einsum("nij,nj->i", across, centers))
reach = float(np.linalg.norm(centers - target, axis=1).mean())

torch.manual_seed(0)
means = torch.tensor(target).float() + reach * (torch.rand(COUNT, 3) - 0.5)
log_scales = torch.full((COUNT, 3), reach / COUNT**(1 / 3) / 3).log()
rotations, logits = torch.tensor([[1.0, 0, 0, 0]]).repeat(COUNT, 1), torch.full((COUNT,), -2.0)
sh = torch.zeros(COUNT, (DEGREE + 1)**2, 3)
rates = [(means, 1e-3 * reach), (log_scales, 1e-2), (rotations, 2e-3), (logits, 1e-1), (sh, 1e-2)]
adam: Any = torch.optim.Adam([{"params": [value.requires_grad_()], "lr": rate} for value, rate in rates], eps=1e-15)

line = torch.exp(-(torch.arange(11) - 5.0)**2 / 4.5)
window = (line[:, None] * line / line.sum()**2).expand(3, 1, 11, 11)


def similarity(a: Any, b: Any) -> Any:
    """SSIM of two images [H,W,3]."""
    x, y = a.permute(2, 0, 1), b.permute(2, 0, 1)
    sums = [torch.nn.functional.conv2d(each, window, padding=5, groups=3) for each in (x, y, x * x, y * y, x * y)]
    mx, my, xx, yy, xy = sums
    return ((2 * mx * my + 1e-4) * (2 * (xy - mx * my) + 9e-4) /
            ((mx * mx + my * my + 1e-4) * (xx - mx * mx + yy - my * my + 9e-4))).mean()


def draw(view: int) -> Any:
    return rasterize(means, log_scales.exp(), rotations, logits.sigmoid(), sh, cameras[view],
                     convention="gsplat").images[0]


fitted = [view for view in range(len(photos)) if view % 8 != 0]
for step in range(steps):
    view = fitted[step * 7919 % len(fitted)]
    adam.param_groups[0]["lr"] = rates[0][1] * 0.1**(step / steps)
    adam.zero_grad()
    drawn = draw(view)
    loss = 0.8 * (drawn - photos[view]).abs().mean() + 0.2 * (1 - similarity(drawn, photos[view]))
    loss.backward()
    adam.step()

with torch.no_grad():
    errors = [(draw(view).clamp(0, 1) - photos[view]).square().mean() for view in range(0, len(photos), 8)]
    turned = rotations / rotations.norm(dim=1, keepdim=True)
    splat.Scene(means.numpy(), log_scales=log_scales.numpy(), rotations=turned.numpy(), opacity_logits=logits.numpy(),
                sh=sh.numpy()).save(scene_file)
print(f"held-out PSNR {sum(-10 * error.log10().item() for error in errors) / len(errors):.2f} dB")
