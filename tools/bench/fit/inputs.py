"""What `run` fits: parts of a COLMAP model, renders of a scene on two orbits, maps of depth and normals."""

import json
import pathlib
import struct


class Reader:
    def __init__(self, path):
        self.data, self.at = path.read_bytes(), 0

    def take(self, layout):
        values = struct.unpack_from("<" + layout, self.data, self.at)
        self.at += struct.calcsize("<" + layout)
        return values

    def name(self):
        end = self.data.index(b"\0", self.at)
        text, self.at = self.data[self.at:end], end + 1
        return text.decode()


def read_images(model):
    """[(id, name, pose, camera)] of images.bin, by name; pose is the quaternion and the translation."""
    reader = Reader(model / "images.bin")
    images = []
    for _ in range(*reader.take("Q")):
        number, *pose, camera = reader.take("I7dI")
        images.append((number, reader.name(), pose, camera))
        marks, = reader.take("Q")
        reader.at += 24 * marks
    return sorted(images, key=lambda image: image[1])


def read_points(model):
    """[(id, xyz, rgb, error, track)] of points3D.bin; a track is [(image, index)]."""
    reader = Reader(model / "points3D.bin")
    points = []
    for _ in range(*reader.take("Q")):
        number, x, y, z, *rgb, error = reader.take("Q3d3Bd")
        length, = reader.take("Q")
        track = reader.take(f"{2 * length}I")
        points.append((number, (x, y, z), rgb, error, list(zip(track[::2], track[1::2]))))
    return points


def part_of_model(data, out, keep, least_track):
    """A folder with the images of COLMAP model `data` whose place by name `keep` takes, and the points that at least so
    many of them see. Returns the names."""
    model, to = data / "sparse/0", out / "sparse/0"
    to.mkdir(parents=True, exist_ok=True)
    images = [image for i, image in enumerate(read_images(model)) if keep(i)]
    numbers = {image[0] for image in images}
    packed = struct.pack("<Q", len(images))
    for number, name, pose, camera in images:
        packed += struct.pack("<I7dI", number, *pose, camera) + name.encode() + b"\0" + struct.pack("<Q", 0)
    (to / "images.bin").write_bytes(packed)
    points = []
    for number, xyz, rgb, error, track in read_points(model):
        track = [seen for seen in track if seen[0] in numbers]
        if len(track) >= least_track:
            points.append(struct.pack("<Q3d3BdQ", number, *xyz, *rgb, error, len(track)) +
                          b"".join(struct.pack("<II", *seen) for seen in track))
    (to / "points3D.bin").write_bytes(struct.pack("<Q", len(points)) + b"".join(points))
    (to / "cameras.bin").write_bytes((model / "cameras.bin").read_bytes())
    if not (out / "images").exists():
        (out / "images").symlink_to((data / "images").resolve())
    return [image[1] for image in images]


def render_orbits(vkrun, scene, points, out):
    """72 renders of 288 x 480 on two orbits, with transforms.json and the points of a COLMAP text model."""
    frames = []
    for orbit, elevation in enumerate((10, 35)):
        folder = out / "orbit"
        vkrun("render", scene, "--orbit", 36, "--elevation", elevation, "--size", "288x480", "--convention", "gsplat",
              "--out", folder, "--overwrite")
        document = json.loads((folder / "transforms.json").read_text())
        for frame in document["frames"]:
            name = f"{orbit}_{frame['file_path']}"
            (folder / frame["file_path"]).rename(out / name)
            frames.append({**frame, "file_path": name})
    rows = [line.split()[1:7] for line in points.read_text().splitlines() if line and line[0] != "#"]
    head = "".join(f"property {kind} {name}\n" for kind, name in
                   [("float", name) for name in "xyz"] + [("uchar", name) for name in ("red", "green", "blue")])
    (out / "points.ply").write_text(f"ply\nformat ascii 1.0\nelement vertex {len(rows)}\n{head}end_header\n" +
                                    "".join(" ".join(row) + "\n" for row in rows))
    (out / "transforms.json").write_text(json.dumps({"ply_file_path": "points.ply", "frames": frames}))


def render_masks(vkrun, scene, cameras, names, out):
    """OUT/NAME: what of the views of a camera file a scene covers, as pictures."""
    drawn = out / "drawn"
    vkrun("render", scene, "--cameras", cameras, "--convention", "gsplat", "--outputs", "alpha", "--out", drawn,
          "--overwrite")
    for name in names:
        (drawn / f"{pathlib.PurePosixPath(name).stem}_alpha.png").rename(out / name)


def distorted_places(width, height, fx, fy, cx, cy, k1, k2, p1, p2):
    """[height,width] columns and rows of a pinhole picture that the pixels of COLMAP's OPENCV camera show."""
    import numpy as np
    column, row = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    to_x, to_y = (column - cx) / fx, (row - cy) / fy
    x, y = to_x, to_y
    for _ in range(20):
        r2 = x * x + y * y
        radial = 1 + k1 * r2 + k2 * r2 * r2
        x, y = ((to_x - 2 * p1 * x * y - p2 * (r2 + 2 * x * x)) / radial,
                (to_y - p1 * (r2 + 2 * y * y) - 2 * p2 * x * y) / radial)
    return (np.clip((x * fx + cx).astype(int), 0, width - 1), np.clip((y * fy + cy).astype(int), 0, height - 1))


def render_maps(vkrun, scene, cameras, names, out, lens=None):
    """OUT/depth and OUT/normals: maps of a scene in the views of a camera file, degraded. Depths are distances whose
    inverses have another scale and shift in each view and noise of 5 %; 0 where little is drawn. Normals have as much
    noise. lens: k1 to p2 of COLMAP's OPENCV camera, as the photographs have."""
    import numpy as np
    drawn = out / "drawn"
    vkrun("render", scene, "--cameras", cameras, "--ignore-distortion", "--convention", "gsplat", "--outputs",
          "alpha,depth,normal", "--format", "npy", "--out", drawn, "--overwrite")
    random = np.random.default_rng(1)
    for name in names:
        stem = str(pathlib.PurePosixPath(name).with_suffix(""))
        alpha, depth, normal = (np.load(drawn / f"{stem}_{kind}.npy") for kind in ("alpha", "depth", "normal"))
        alpha, depth = alpha.squeeze(), depth.squeeze()
        if lens is not None:
            column, row = distorted_places(*lens)
            alpha, depth, normal = alpha[row, column], depth[row, column], normal[row, column]
        there = (alpha > 0.5) & (depth > 0)
        near = 1 / np.where(there, depth, 1)
        near = random.uniform(0.5, 2) * near + random.uniform(0, 1) * near[there].mean()
        near *= 1 + 0.05 * random.standard_normal(near.shape)
        length = np.linalg.norm(normal, axis=2, keepdims=True)
        normal = normal / np.maximum(length, 1e-6) + 0.05 * random.standard_normal(normal.shape)
        for kind, values in (("depth", np.where(there, 1 / near, 0)), ("normals", normal * there[..., None])):
            path = out / kind / f"{stem}.npy"
            path.parent.mkdir(parents=True, exist_ok=True)
            np.save(path, values.astype(np.float32))


def opencv_lens(model):
    """Width to p2 of the only camera of cameras.bin."""
    reader = Reader(model / "cameras.bin")
    reader.take("QIi")
    width, height = reader.take("QQ")
    return (width, height, *reader.take("8d"))
