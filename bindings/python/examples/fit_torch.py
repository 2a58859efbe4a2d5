"""Fit 200 Gaussians to a smooth picture with torch.optim.Adam; prints PSNR and ms per step."""
import time
from typing import Any

import libsplat as splat
from libsplat.torch import rasterize, torch

W, H, COLUMNS, ROWS, STEPS = 128, 96, 20, 10, 300
row, column, channel = torch.arange(H)[:, None, None], torch.arange(W)[:, None], torch.arange(3)
photo = (0.5 + 0.2 * torch.sin(0.07 * column + channel) + 0.2 * torch.cos(0.06 * row - channel))
index = torch.arange(COLUMNS * ROWS)
x = (index % COLUMNS + 0.5) / COLUMNS - 0.5
y = ((index // COLUMNS + 0.5) / ROWS - 0.5) * H / W
means = torch.stack([x, y, torch.ones_like(x)], 1).requires_grad_()
scales = torch.full((len(x), 3), 0.04, requires_grad=True)
rotations = torch.tensor([[1.0, 0, 0, 0]]).repeat(len(x), 1).requires_grad_()
opacities = torch.full((len(x),), 0.9)
colors = torch.full((len(x), 3), 0.5, requires_grad=True)
adam: Any = torch.optim.Adam([{"params": [means, scales], "lr": 1e-3},
                              {"params": [rotations, colors]}], lr=1e-2)
camera = splat.Camera(W, H, W)
start = time.perf_counter()
for _ in range(STEPS):
    adam.zero_grad()
    drawn = rasterize(means, scales, rotations, opacities, colors, camera)
    loss = (drawn.images[0] - photo).square().mean()
    loss.backward()
    adam.step()
ms = (time.perf_counter() - start) * 1e3 / STEPS
print(f"{-10 * torch.log10(loss).item():.1f} dB, {ms:.2f} ms per step")
