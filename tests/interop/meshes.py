#!/usr/bin/env python3
"""Usage: tests/interop/meshes.py DESCRIBE_MESH [NPM_FOLDER] [FOLDER]

Meshes that trimesh and pygltflib write, and the bunny of an npm package, read by describe_mesh and by trimesh:
triangles, boxes, areas, materials, texels. With FOLDER all .glb, .gltf and .obj below it, whoever wrote them.
Exit status 77: skipped, with the reason.
"""
import json
import os
import re
import subprocess
import sys
import tempfile

try:
    import numpy
    import pygltflib
    import trimesh
    from PIL import Image
except ImportError as error:
    print(f"skipped: {error}; apt-get install python3-numpy python3-pil; pip install trimesh pygltflib")
    sys.exit(77)


def described(program, *paths):
    lines = subprocess.run([program, *paths], check=True, stdout=subprocess.PIPE, text=True).stdout
    return [json.loads(line) for line in lines.splitlines()]


def expect(condition, message):
    if not condition:
        sys.exit(f"FAILED: {message}")


def close(a, b, bound):
    scale = max(1e-30, numpy.abs(numpy.asarray(b)).max())
    return numpy.abs(numpy.asarray(a) - numpy.asarray(b)).max() <= bound * scale


def compare(path, ours, theirs):
    """`theirs` is a trimesh.Trimesh of all that the file places."""
    expect("error" not in ours, f"{path}: {ours.get('error')}")
    expect(ours["triangles"] == len(theirs.faces),
           f"{path}: {ours['triangles']} triangles, trimesh has {len(theirs.faces)}")
    expect(close([ours["low"], ours["high"]], theirs.bounds, 2e-6),
           f"{path}: box {ours['low']} to {ours['high']}, trimesh has {theirs.bounds.tolist()}")
    expect(close(ours["area"], theirs.area, 1e-5),
           f"{path}: area {ours['area']}, trimesh has {theirs.area}")


def load(path):
    return trimesh.load_scene(path, process=False).to_geometry()


def painted_box(image):
    box = trimesh.creation.box((1, 2, 3))
    material = trimesh.visual.material.PBRMaterial(
        baseColorTexture=image, baseColorFactor=[255, 128, 0, 255], doubleSided=True)
    box.visual = trimesh.visual.TextureVisuals(uv=box.vertices[:, :2], material=material)
    return box


def of_trimesh(program, folder):
    rng = numpy.random.default_rng(1)
    pixels = rng.integers(0, 256, (5, 7, 4), numpy.uint8)
    box = painted_box(Image.fromarray(pixels))
    ball = trimesh.creation.icosphere(subdivisions=3)
    ball.visual.vertex_colors = rng.integers(0, 256, (len(ball.vertices), 4))
    scene = trimesh.Scene()
    scene.add_geometry(box, transform=trimesh.transformations.rotation_matrix(1, [1, 2, 3], [4, 5, 6]))
    scene.add_geometry(ball, transform=numpy.diag([2, 1, -3, 1.0]))
    scene.add_geometry(trimesh.creation.annulus(0.2, 0.5, 1))
    glb = os.path.join(folder, "scene.glb")
    scene.export(glb)
    for name, data in trimesh.exchange.gltf.export_gltf(scene).items():
        with open(os.path.join(folder, name.replace("model", "scene")), "wb") as file:
            file.write(data)
    found = described(program, glb, os.path.join(folder, "scene.gltf"))
    for path, ours in zip((glb, "scene.gltf"), found):
        compare(path, ours, scene.to_geometry())
        sums = pixels.reshape(-1, 4).astype(float).sum(0).tolist()
        expect(ours["textures"] == [{"width": 7, "height": 5, "sums": sums}],
               f"{path}: textures {ours['textures']}, expected {sums}")
        painted = [m for m in ours["materials"] if m["texture"] == 0]
        expect(len(painted) == 1 and painted[0]["double_sided"], f"{path}: {ours['materials']}")
        expect(close(painted[0]["color"], [1, 128 / 255, 0, 1], 1e-2), f"{path}: {painted}")
        expect(ours["colors"] == ours["vertices"], f"{path}: no colours of vertices")
    # Opaque, for trimesh writes a JPEG or PNG by the mode of the image.
    box = painted_box(Image.fromarray(pixels[:, :, :3]))
    box.visual = trimesh.visual.TextureVisuals(uv=box.vertices[:, :2], image=Image.fromarray(pixels[:, :, :3]))
    obj = os.path.join(folder, "box.obj")
    box.export(obj)
    ours = described(program, obj)[0]
    compare(obj, ours, box)
    expect([(t["width"], t["height"]) for t in ours["textures"]] == [(7, 5)], f"{obj}: {ours}")
    points = trimesh.creation.icosphere(subdivisions=2)
    points.vertices += 1e6
    far = os.path.join(folder, "far.obj")
    points.export(far)
    compare(far, described(program, far)[0], points)


def of_pygltflib(program, folder):
    """Indices of each type, lists, strips and fans, with the square's corners as floats."""
    corners = numpy.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], numpy.float32)
    for component, dtype in ((5121, "u1"), (5123, "<u2"), (5125, "<u4")):
        for mode, indices in ((4, [0, 1, 2, 0, 2, 3]), (5, [0, 1, 3, 2]), (6, [0, 1, 2, 3])):
            data = numpy.array(indices, dtype).tobytes()
            data += bytes(-len(data) % 4)
            gltf = pygltflib.GLTF2(
                scene=0, scenes=[pygltflib.Scene(nodes=[0])], nodes=[pygltflib.Node(mesh=0)],
                meshes=[pygltflib.Mesh(primitives=[pygltflib.Primitive(
                    attributes=pygltflib.Attributes(POSITION=1), indices=0, mode=mode)])],
                accessors=[
                    pygltflib.Accessor(bufferView=0, componentType=component, count=len(indices), type="SCALAR"),
                    pygltflib.Accessor(bufferView=1, componentType=5126, count=4, type="VEC3",
                                       min=[0, 0, 0], max=[1, 1, 0])],
                bufferViews=[
                    pygltflib.BufferView(buffer=0, byteOffset=0, byteLength=len(data)),
                    pygltflib.BufferView(buffer=0, byteOffset=len(data), byteLength=corners.nbytes)],
                buffers=[pygltflib.Buffer(byteLength=len(data) + corners.nbytes)])
            gltf.set_binary_blob(data + corners.tobytes())
            path = os.path.join(folder, f"indices{component}_{mode}.glb")
            gltf.save_binary(path)
            ours = described(program, path)[0]
            expect(ours.get("triangles") == 2 and ours["area"] == 1 and ours["unused"] == 0,
                   f"{path}: {ours}")


def of_npm(program, folder, npm_folder):
    """The bunny of the package 'bunny': lists of positions and of cells."""
    path = os.path.join(npm_folder, "bunny.js")
    if not os.path.exists(path):
        print(f"without the bunny: '{path}' is not there")
        return
    with open(path, encoding="utf-8") as file:
        text = file.read()
    positions, cells = (json.loads(re.search(name + r"\s*=\s*(\[.*?\]\])", text, re.S).group(1))
                        for name in ("positions", "cells"))
    obj = os.path.join(folder, "bunny.obj")
    with open(obj, "w", encoding="ascii") as file:
        file.writelines(f"v {x!r} {y!r} {z!r}\n" for x, y, z in positions)
        file.writelines(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in cells)
    compare(obj, described(program, obj)[0], trimesh.Trimesh(positions, cells, process=False))
    glb = os.path.join(folder, "bunny.glb")
    trimesh.Trimesh(positions, cells, process=False).export(glb)
    compare(glb, described(program, glb)[0], load(glb))


def of_folder(program, folder):
    count = 0
    for root, _, names in os.walk(folder):
        for name in sorted(names):
            if name.endswith((".glb", ".gltf", ".obj")):
                path = os.path.join(root, name)
                compare(path, described(program, path)[0], load(path))
                count += 1
    print(f"{count} meshes of '{folder}'")


def main():
    program = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        of_trimesh(program, folder)
        of_pygltflib(program, folder)
        if len(sys.argv) > 2:
            of_npm(program, folder, sys.argv[2])
    if len(sys.argv) > 3:
        of_folder(program, sys.argv[3])
    print("the same as by trimesh")


main()
