"""MoGe-2 in PyTorch, written from its description, for moge_peer.py: shapes and random weights of the smallest published
network, the network, and its export to ONNX for pictures of 14 pixels a patch, which then need no resampling.
"""

import json
import math
import struct

import numpy as np
import torch
import torch.nn.functional as F

WIDTH, BLOCKS, HEADS, SIDE, PATCH, HIDDEN = 384, 12, 6, 37, 14, 1536
TAPS = (5, 11)
WIDTHS = (WIDTH, 256, 128, 64, 32)
RESIDUAL = (0, 1, 1, 1, 0)  # blocks by level
STACKS = {"neck": 0, "points_head": 3, "normal_head": 3, "mask_head": 1}
BACKBONE = "encoder.backbone."


def shapes():
    """Shapes of all tensors by name, as the published file has them."""
    found = {BACKBONE + "cls_token": (1, 1, WIDTH), BACKBONE + "pos_embed": (1, 1 + SIDE * SIDE, WIDTH),
             BACKBONE + "mask_token": (1, WIDTH), "encoder.image_mean": (1, 3, 1, 1), "encoder.image_std": (1, 3, 1, 1)}

    def layer(name, *dims):
        found[name + ".weight"], found[name + ".bias"] = dims, (dims[0],)

    layer(BACKBONE + "patch_embed.proj", WIDTH, 3, PATCH, PATCH)
    layer(BACKBONE + "norm", WIDTH)
    for i in range(BLOCKS):
        block = f"{BACKBONE}blocks.{i}."
        layer(block + "norm1", WIDTH)
        layer(block + "attn.qkv", 3 * WIDTH, WIDTH)
        layer(block + "attn.proj", WIDTH, WIDTH)
        layer(block + "norm2", WIDTH)
        layer(block + "mlp.fc1", HIDDEN, WIDTH)
        layer(block + "mlp.fc2", WIDTH, HIDDEN)
        found[block + "ls1.gamma"] = found[block + "ls2.gamma"] = (WIDTH,)
    for tap in range(len(TAPS)):
        layer(f"encoder.output_projections.{tap}", WIDTH, WIDTH, 1, 1)
    for name, out in STACKS.items():
        for level, (width, blocks) in enumerate(zip(WIDTHS, RESIDUAL)):
            given = width if name != "neck" else WIDTH + 2 if level == 0 else 2
            layer(f"{name}.input_blocks.{level}", width, given, 1, 1)
            for block in range(blocks):
                for number in (2, 5):
                    layer(f"{name}.res_blocks.{level}.{block}.layers.{number}", width, width, 3, 3)
            if level + 1 == len(WIDTHS):
                break
            to = WIDTHS[level + 1]
            if level + 2 < len(WIDTHS):
                found[f"{name}.resamplers.{level}.0.weight"] = (width, to, 2, 2)
                found[f"{name}.resamplers.{level}.0.bias"] = (to,)
            layer(f"{name}.resamplers.{level}.1", to, to if level + 2 < len(WIDTHS) else width, 3, 3)
        if out:
            layer(f"{name}.output_blocks.{len(WIDTHS) - 1}", out, WIDTHS[-1], 1, 1)
    for number, out in ((0, WIDTH), (2, WIDTH), (4, 1)):
        layer(f"scale_head.{number}", out, WIDTH)
    return found


def random_weights():
    random = np.random.default_rng(7)
    weights = {}
    for name, shape in shapes().items():
        noise = random.standard_normal(shape)
        if name in ("encoder.image_mean", "encoder.image_std"):
            values = {"encoder.image_mean": [0.485, 0.456, 0.406], "encoder.image_std": [0.229, 0.224, 0.225]}[name]
            noise = np.reshape(values, shape)
        elif "gamma" in name:
            noise = np.full(shape, 0.3)
        elif "norm" in name and name.endswith("weight") and len(shape) == 1:
            noise = 1 + 0.1 * noise
        elif name.endswith("bias"):
            noise *= 0.02
        elif name.endswith(("token", "pos_embed")):
            noise *= 0.2
        else:  # outputs of order 1
            noise /= math.sqrt(shape[0] if shape[2:] == (2, 2) else math.prod(shape[1:]))
        weights[name] = noise.astype(np.float32)
    return weights


def write_safetensors(file, weights):
    head, at = {}, 0
    for name, values in weights.items():
        head[name] = {"dtype": "F32", "shape": list(values.shape), "data_offsets": [at, at + values.nbytes]}
        at += values.nbytes
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 8)
    with open(file, "wb") as out:
        out.write(struct.pack("<Q", len(text)) + text)
        for values in weights.values():
            out.write(values.tobytes())


class Moge(torch.nn.Module):
    """Points, normals and the mask of pictures [1,3,14 rows,14 columns] from 0 to 1, and the metric scale."""

    def __init__(self, weights, rows, columns, dtype=torch.float32):
        super().__init__()
        self.rows, self.columns, self.dtype = rows, columns, dtype
        self.names = {name: i for i, name in enumerate(weights)}
        self.all = torch.nn.ParameterList(torch.nn.Parameter(torch.from_numpy(values).to(dtype), requires_grad=False)
                                          for values in weights.values())

    def get(self, name):
        return self.all[self.names[name]]

    def of(self, name):
        return self.get(name + ".weight"), self.get(name + ".bias")

    def conv3(self, name, x):
        return F.conv2d(F.pad(x, (1, 1, 1, 1), mode="replicate"), *self.of(name))

    def encoder(self, x):
        x = (x - self.get("encoder.image_mean")) / self.get("encoder.image_std")
        x = F.conv2d(x, *self.of(BACKBONE + "patch_embed.proj"), stride=PATCH).flatten(2).transpose(1, 2)
        table = self.get(BACKBONE + "pos_embed")
        factors = [(count + 0.1) / SIDE for count in (self.rows, self.columns)]
        grid = table[:, 1:].reshape(1, SIDE, SIDE, WIDTH).permute(0, 3, 1, 2)
        grid = F.interpolate(grid, scale_factor=factors, mode="bicubic").flatten(2).transpose(1, 2)
        x = torch.cat([self.get(BACKBONE + "cls_token") + table[:, :1], x + grid], 1)
        normal = lambda name, y: F.layer_norm(y, (WIDTH,), *self.of(name), 1e-6)
        features, tap = 0, 0
        for i in range(BLOCKS):
            block = f"{BACKBONE}blocks.{i}."
            q, k, v = F.linear(normal(block + "norm1", x), *self.of(block + "attn.qkv")).unflatten(
                2, (3, HEADS, WIDTH // HEADS)).permute(2, 0, 3, 1, 4)
            weights = (q @ k.transpose(-1, -2) * (WIDTH // HEADS) ** -0.5).softmax(-1)
            h = F.linear((weights @ v).transpose(1, 2).flatten(2), *self.of(block + "attn.proj"))
            x = x + h * self.get(block + "ls1.gamma")
            h = F.gelu(F.linear(normal(block + "norm2", x), *self.of(block + "mlp.fc1")))
            x = x + F.linear(h, *self.of(block + "mlp.fc2")) * self.get(block + "ls2.gamma")
            if i in TAPS:
                y = normal(BACKBONE + "norm", x)
                image = y[:, 1:].transpose(1, 2).reshape(1, WIDTH, self.rows, self.columns)
                features = features + F.conv2d(image, *self.of(f"encoder.output_projections.{tap}"))
                tap += 1
        return features, y[:, 0]

    def view(self, level):
        """Coordinates of the pixels of a level, whose diagonal reaches from -1 to 1."""
        width, height = self.columns << level, self.rows << level
        diagonal = math.hypot(self.columns, self.rows)
        along = lambda n, patches: (torch.arange(n, dtype=self.dtype) * 2 + 1 - n) * (patches / diagonal / n)
        grid = torch.meshgrid(along(width, self.columns), along(height, self.rows), indexing="xy")
        return torch.stack(grid)[None]

    def stack(self, name, inputs):
        x, levels = 0, []
        for level, given in enumerate(inputs):
            x = x + F.conv2d(given, *self.of(f"{name}.input_blocks.{level}"))
            for block in range(RESIDUAL[level]):
                layers = f"{name}.res_blocks.{level}.{block}.layers."
                x = x + self.conv3(layers + "5", F.relu(self.conv3(layers + "2", F.relu(x))))
            levels.append(x)
            if level + 1 == len(inputs):
                break
            up = f"{name}.resamplers.{level}."
            if up + "0.weight" in self.names:
                x = F.conv_transpose2d(x, *self.of(up + "0"), stride=2)
            else:
                x = F.interpolate(x, scale_factor=2, mode="bilinear")
            x = self.conv3(up + "1", x)
        return levels

    def forward(self, image):
        features, token = self.encoder(image)
        inputs = [self.view(level) for level in range(len(WIDTHS))]
        levels = self.stack("neck", [torch.cat([features, inputs[0]], 1), *inputs[1:]])

        def result(name):
            x = F.conv2d(self.stack(name, levels)[-1], *self.of(f"{name}.output_blocks.{len(WIDTHS) - 1}"))
            return F.interpolate(x, image.shape[2:], mode="bilinear").permute(0, 2, 3, 1)

        points = result("points_head")
        depth = points[..., 2:].exp()
        for number in (0, 2):
            token = F.relu(F.linear(token, *self.of(f"scale_head.{number}")))
        return (torch.cat([points[..., :2] * depth, depth], -1), F.normalize(result("normal_head"), dim=-1),
                result("mask_head")[..., 0].sigmoid(), F.linear(token, *self.of("scale_head.4"))[:, 0].exp())


def export(file, weights, rows, columns):
    torch.onnx.export(Moge(weights, rows, columns).eval(), (torch.rand(1, 3, rows * PATCH, columns * PATCH),), file,
                      input_names=["image"], output_names=["points", "normal", "mask", "metric_scale"],
                      opset_version=17, dynamo=False)
