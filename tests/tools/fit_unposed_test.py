#!/usr/bin/env python3
"""vkrun fit of photographs without cameras and of videos: fit_unposed_test.py VKRUN FOLDER

ffmpeg, ffprobe and colmap are programs made here, alone on PATH, which note how they are called. FAKE_... of their
environment say what they find.
"""

import json
import os
import pathlib
import shutil
import signal
import struct
import subprocess
import sys
import time
import unittest
import zlib

VKRUN, FOLDER = (pathlib.Path(path).resolve() for path in sys.argv[1:3])
BIN = FOLDER / "bin"
WIDTH, HEIGHT = 48, 36

FAKE_COLMAP = r'''
command = sys.argv[1]
if "--help" in sys.argv:
    newer = os.environ.get("FAKE_NEWER")
    kind = "Matching" if "matcher" in command else "Extraction"
    print(f"  --{'Feature' if newer else 'Sift'}{kind}.use_gpu arg (=1)")
    sys.exit()
note()
value = lambda name: sys.argv[sys.argv.index(name) + 1]
if command == os.environ.get("FAKE_FAILS"):
    print("E0101 something: the disk is on fire", file=sys.stderr)
    sys.exit(3)
if command == os.environ.get("FAKE_HANGS"):
    open(os.environ["CALLS"] + ".pid", "w").write(str(os.getpid()))
    time.sleep(60)
if command == "feature_extractor":
    names = open(value("--image_list_path")).read().splitlines()
    assert int(value("--SiftExtraction.max_num_features")) > 0
    for i, name in enumerate(names):
        assert os.path.exists(os.path.join(value("--image_path"), name)), name
        print(f"Processed file [{i + 1}/{len(names)}]")
    open(value("--database_path"), "w").write("\n".join(names))
elif command.endswith("_matcher"):
    assert command == "sequential_matcher" or int(value("--ExhaustiveMatching.block_size")) > 0
    print("Matching block [1/1, 1/1] in 0.1s")
elif command == "mapper":
    names = open(value("--database_path")).read().splitlines()
    count = int(os.environ.get("FAKE_REGISTERED", len(names)))
    width, height = json.loads(os.environ["FAKE_SIZE"])
    for i in range(3, count + 1):
        print(f"Registering image #{i} ({i})" if not os.environ.get("FAKE_NEWER") else
              f"I2026 incremental_pipeline.cc:400] Registering image #{i} (num_reg_frames={i})")
    if count == 0:
        print("No good initial image pair found.")
        sys.exit(1)
    for model, kept in enumerate([names[:1], names[:count]]):
        out = os.path.join(value("--output_path"), str(model))
        os.makedirs(out)
        with open(out + "/cameras.bin", "wb") as file:
            file.write(struct.pack("<QIiQQ4d", 1, 1, 1, width, height, width, width, width / 2, height / 2))
        with open(out + "/images.bin", "wb") as file:
            file.write(struct.pack("<Q", len(kept)))
            for i, name in enumerate(kept):
                half = math.pi * i / len(names)
                file.write(struct.pack("<I4d3dI", i + 1, math.cos(half), 0, math.sin(half), 0, 0, 0, 4, 1))
                file.write(name.encode() + b"\0" + struct.pack("<Q", 0))
        with open(out + "/points3D.bin", "wb") as file:
            places = [(.06 * (i % 6) - .15, .06 * (i // 6 % 6) - .15, .06 * (i // 36) - .15) for i in range(216)]
            places += [(.1 * (i % 2), 1.2, .02 * i) for i in range(7)]  # apart
            file.write(struct.pack("<Q", len(places)))
            for i, place in enumerate(places):
                file.write(struct.pack("<Q3d3BdQ", i + 1, *place, 200, 100, 40, 1.0, 0))
'''

FAKE_FFPROBE = r'''
note()
if os.environ.get("FAKE_BROKEN"):
    print("moov atom not found", file=sys.stderr)
    sys.exit(1)
if "FAKE_FRAMES" in os.environ:
    print("nb_read_packets=" + os.environ["FAKE_FRAMES"])
'''

FAKE_FFMPEG = r'''
note()
width, height = json.loads(os.environ["FAKE_SIZE"])
for i in range(int(os.environ["FAKE_FRAMES"])):
    shift = 0 if os.environ.get("FAKE_STILL") else i
    # Every third frame has edges of full contrast.
    gray = 255 if i % 3 == 1 or os.environ.get("FAKE_STILL") else 130
    row = lambda y: b"".join(bytes([gray, gray, 40]) if (x + shift) // 6 % 2 == y // 6 % 2 else b"\0\0\0"
                             for x in range(width))
    sys.stdout.buffer.write(b"P6\n%d %d\n255\n" % (width, height) + b"".join(map(row, range(height))))
'''

HEAD = f"""#!{sys.executable}
import json, math, os, struct, sys, time
def note():
    with open(os.environ["CALLS"], "a") as file:
        file.write(json.dumps([os.path.basename(sys.argv[0])] + sys.argv[1:]) + "\\n")
"""


def make_programs():
    shutil.rmtree(FOLDER, ignore_errors=True)
    BIN.mkdir(parents=True)
    for name, text in [("colmap", FAKE_COLMAP), ("ffprobe", FAKE_FFPROBE), ("ffmpeg", FAKE_FFMPEG)]:
        (BIN / name).write_text(HEAD + text)
        (BIN / name).chmod(0o755)


def png(pixel, channels=3):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + b"".join(bytes(pixel(x, y)) for x in range(WIDTH)) for y in range(HEIGHT))
    head = struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 2 if channels == 3 else 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


class Unposed(unittest.TestCase):
    def setUp(self):
        # A shell would stumble over this.
        self.folder = FOLDER / f"{self.id().split('.')[-1]} é $(false) 'a"
        self.folder.mkdir()
        self.calls_file = self.folder / "calls"
        self.out = self.folder / "run"
        self.photos = self.folder / "my photos"

    def make_photos(self, count=12):
        self.photos.mkdir()
        for i in range(count):
            (self.photos / f"ä {i:02}.png").write_bytes(
                png(lambda x, y: [9 * i, 255 if (x + i) // 6 % 2 == y // 6 % 2 else 0, 90]))
        return self.photos

    def environment(self, environment):
        own = {"PATH": str(BIN), "CALLS": str(self.calls_file), "FAKE_SIZE": json.dumps([WIDTH, HEIGHT]),
               "SPLAT_PRIORS_DIR": str(self.folder / "models")}
        return os.environ | own | environment

    def fit(self, status, *words, **environment):
        if status != 0:
            words += ("--steps", 2)
        done = subprocess.run([VKRUN, "fit", *map(str, words), "--out", self.out], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True, env=self.environment(environment), check=False)
        said = done.stdout + done.stderr
        self.assertEqual(done.returncode, status, said)
        return said

    def calls(self):
        """What was called since the last time."""
        lines = self.calls_file.read_text().splitlines() if self.calls_file.exists() else []
        self.calls_file.unlink(missing_ok=True)
        return [json.loads(line) for line in lines]

    def expect(self, said, *parts):
        for part in parts:
            self.assertIn(str(part), said)

    def test_photographs_get_cameras_once(self):
        said = self.fit(0, self.make_photos(), "--steps", 4, "--json")
        self.expect(said, "one lens", "colmap: registered 12 of 12", "12 of 12 photographs have a place")
        calls = self.calls()
        self.assertEqual([call[1] for call in calls],
                         ["help", "feature_extractor", "exhaustive_matcher", "mapper"])
        self.assertEqual(calls[1][-4:-2], ["--SiftExtraction.use_gpu", "0"])
        self.assertEqual(calls[2][-4:-2], ["--SiftMatching.use_gpu", "0"])
        self.assertEqual(json.loads(said[said.index("{\n"):said.rindex("}") + 1])["gaussians"], 223)
        self.assertEqual((self.out / "data/images").resolve(), self.photos)
        self.assertTrue((self.out / "scene.ply").exists())
        self.expect((self.out / "colmap.log").read_text(), "'mapper'", "Registering image #12")
        # A run that is there, and what was made for it.
        self.expect(self.fit(2, self.photos), "holds a run: --resume it")
        self.fit(0, "--resume")
        self.fit(0, self.photos, "--resume")
        self.fit(0, self.photos, "--steps", 3, "--overwrite")
        self.assertEqual(self.calls(), [])
        # Other photographs have other cameras, and end the run.
        (self.photos / "ä 00.png").unlink()
        self.fit(1, self.photos, "--overwrite", FAKE_FAILS="exhaustive_matcher")
        self.expect(self.fit(2, "--resume"), "repeat the command without --resume")
        self.expect(self.fit(0, self.photos, "--steps", 3), "11 of 11")

    def test_newer_colmap_has_other_names(self):
        said = self.fit(0, self.make_photos(), "--steps", 2, FAKE_NEWER="1")
        self.expect(said, "colmap: registered 12 of 12")
        calls = self.calls()
        self.assertEqual(calls[1][-4:-2], ["--FeatureExtraction.use_gpu", "0"])
        self.assertEqual(calls[2][-4:-2], ["--FeatureMatching.use_gpu", "0"])

    def test_missing_programs_are_named(self):
        self.make_photos()
        video = self.folder / "film.mp4"
        video.write_bytes(b"film")
        empty = str(self.folder / "nothing")
        self.expect(self.fit(1, self.photos, PATH=empty), "apt install colmap", "transforms.json")
        self.expect(self.fit(1, video, PATH=empty), "apt install ffmpeg", "winget", "brew")
        self.assertFalse(self.out.exists())

    def test_few_places_are_told(self):
        self.make_photos()
        self.expect(self.fit(4, self.photos, FAKE_REGISTERED="0"), "0 of 12 photographs only", "two thirds")
        self.assertFalse((self.out / "data").exists())
        said = self.fit(4, self.photos, FAKE_REGISTERED="5")
        self.expect(said, "5 of 12 photographs only", "take more", "vkrun fit ")
        self.assertTrue((self.out / "data/sparse/0/points3D.bin").exists())
        self.fit(0, self.photos, "--steps", 2)

    def test_failures_of_colmap_are_told(self):
        self.make_photos()
        said = self.fit(1, self.photos, FAKE_FAILS="exhaustive_matcher")
        self.expect(said, "colmap exhaustive_matcher failed with status 3", "the disk is on fire", "colmap.log")
        said = self.fit(1, self.photos, FAKE_FAILS="mapper")
        self.expect(said, "colmap mapper failed with status 3", "the disk is on fire", "colmap.log")
        self.fit(0, self.photos, "--steps", 2)

    def test_sharpest_frames_of_a_video(self):
        video = self.folder / "-film.MP4"
        video.write_bytes(b"film")
        said = self.fit(0, video, "--frames", 10, "--steps", 3, FAKE_FRAMES="30")
        self.expect(said, "of 30 frames the sharpest of every 3", "10 of 10 photographs have a place")
        calls = self.calls()
        self.assertEqual([call[:2] for call in calls[2:]],
                         [["ffmpeg", "-v"], ["colmap", "feature_extractor"], ["colmap", "sequential_matcher"],
                          ["colmap", "mapper"]])
        self.assertIn(f"file:{video}", calls[2])
        names = sorted(path.name for path in (self.out / "photos").iterdir())
        self.assertEqual(names, [f"frame_{3 * i + 2:06}.png" for i in range(10)])
        self.fit(0, video, "--resume")
        self.expect(self.fit(2, self.out / "photos", "--overwrite"), "makes 'photos' anew")
        self.assertEqual(len(list((self.out / "photos").iterdir())), 10)
        self.assertEqual(self.calls(), [])

    def test_options_of_other_input(self):
        video = self.folder / "film.mov"
        video.write_bytes(b"film")
        self.expect(self.fit(2, video, "--cameras", "transforms"), "a video has none of")
        self.expect(self.fit(2, self.make_photos(), "--frames", 20), "--frames is for a video")
        apart = self.folder / "apart"
        (apart / "train").mkdir(parents=True)
        shutil.copy(self.photos / "ä 00.png", apart / "train/a.png")
        pose = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]
        (apart / "transforms.json").write_text(json.dumps(
            {"camera_angle_x": 1, "frames": [{"file_path": "train/a.png", "transform_matrix": pose}]}))
        self.expect(self.fit(2, apart, "--object"), "give --masks")
        self.assertFalse(self.out.exists())
        self.assertEqual(self.calls(), [])

    def test_videos_that_cannot_be_used(self):
        video = self.folder / "film.mov"
        video.write_bytes(b"film")
        self.expect(self.fit(4, video), "no video stream")
        self.expect(self.fit(4, video, FAKE_BROKEN="1"), "moov atom not found")
        self.expect(self.fit(4, video, FAKE_FRAMES="7"), "too short: 7 frames")
        self.assertFalse(self.out.exists())
        self.expect(self.fit(4, video, FAKE_FRAMES="12", FAKE_STILL="1"), "no motion")
        self.fit(0, video, "--steps", 2, FAKE_FRAMES="12")

    def test_interrupted_preparation_goes_on(self):
        video = self.folder / "film.mp4"
        video.write_bytes(b"film")
        pid_file = pathlib.Path(f"{self.calls_file}.pid")
        process = subprocess.Popen([VKRUN, "fit", video, "--out", self.out, "--steps", "3"], stderr=subprocess.PIPE,
                                   env=self.environment({"FAKE_FRAMES": "12", "FAKE_HANGS": "mapper"}), text=True)
        while not pid_file.exists() or not pid_file.read_text():
            self.assertIsNone(process.poll())
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        said = process.communicate()[1]
        self.assertEqual(process.returncode, 130, said)
        self.expect(said, "interrupted: the same command goes on")
        with self.assertRaises(ProcessLookupError):
            os.kill(int(pid_file.read_text()), 0)
        self.calls()
        self.expect(self.fit(2, "--resume"), "repeat the command without --resume")
        self.fit(0, video, "--steps", 3)
        self.assertNotIn("ffmpeg", [call[0] for call in self.calls()])

    def test_other_formats_are_named(self):
        self.make_photos()
        (self.photos / "IMG_1.HEIC").write_bytes(b"?")
        self.expect(self.fit(0, self.photos, "--steps", 2), "IMG_1.HEIC", "are left out", "heif-convert")
        heic = self.folder / "heic"
        heic.mkdir()
        (heic / "a.heif").write_bytes(b"?")
        self.expect(self.fit(4, heic), "heif-convert", "magick")

    def test_object_alone(self):
        self.make_photos()
        self.expect(self.fit(4, self.photos, "--object"), "u2net")
        masks = self.folder / "masks"
        masks.mkdir()
        for photo in self.photos.iterdir():
            (masks / photo.name).write_bytes(png(lambda x, y: [255 if x < WIDTH // 2 + 20 else 0], channels=1))
        said = self.fit(0, self.photos, "--object", "--masks", masks, "--steps", 2)
        self.expect(said, "--object: 216 of 223 Gaussians are the object; 0 lay outside the masks, 7 apart")
        self.expect(self.fit(0, "--resume"), "--object: 216 of 223")
        for mask in masks.iterdir():
            mask.write_bytes(png(lambda x, y: [255 if y < HEIGHT // 2 + 4 else 0], channels=1))
        said = self.fit(0, self.photos, "--object", "--masks", masks, "--steps", 2, "--overwrite")
        self.expect(said, "7 lay outside the masks, 0 apart")
        # A run without --object keeps all Gaussians.
        posed = self.folder / "posed"
        shutil.copytree(self.out / "data", posed, symlinks=True)
        self.fit(0, posed, "--steps", 2, "--overwrite")
        self.assertNotIn("--object", self.fit(0, "--resume"))

    def test_foreign_folders_stay(self):
        self.make_photos()
        self.out.mkdir()
        (self.out / "mine.txt").write_text("mine")
        self.expect(self.fit(2, self.photos), "is not a run")
        self.assertEqual([path.name for path in self.out.iterdir()], ["mine.txt"])
        self.assertEqual(self.calls(), [["colmap", "help"]] * 0)


if __name__ == "__main__":
    make_programs()
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
