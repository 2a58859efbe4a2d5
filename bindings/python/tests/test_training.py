"""Configurations, data sets, training sessions, trainers."""
import json
import threading
from typing import Any, List, Tuple

import numpy as np

import libsplat as splat
from shared import CONFIG, Case

Kind = splat.RunEventKind


class Configurations(Case):
    """Keys and values."""

    def test_merge(self) -> None:
        merged = json.loads(splat.config_merge(CONFIG, "opt.base_lr=1e-3", "opt.base_lr=2e-3"))
        self.assertEqual((merged["opt"]["base_lr"], merged["model"]["base_dim"]), (2e-3, 8))
        self.assertIn("opt.base_lr", {key["key"] for key in splat.config_keys()})
        self.assertIn("ShapeNet", splat.config_presets()["cars"])
        nmr = json.loads(splat.config_merge(splat.config_preset("nmr"), "opt.batch_size=4"))
        self.assertEqual((nmr["data"]["training_resolution"], nmr["opt"]["batch_size"]), (64, 4))
        with self.assertRaisesRegex(splat.InvalidArgument, "there are: .*chairs"):
            splat.config_preset("car")
        self.assertEqual(splat.config_warnings(CONFIG), [])
        self.assertEqual(splat.path_name("../a/b"), "%2E.%2Fa%2Fb")
        self.refused(splat.InvalidArgument, "base_lr", splat.config_merge, None, "opt.base_lt=1")
        self.refused(splat.InvalidArgument, "", splat.config_merge, "a: [")
        self.refused(splat.InvalidArgument, "config is an int", splat.config_merge, 3)


class Data(Case):
    """Data sets and what makes them."""

    def setUp(self) -> None:
        super().setUp()
        self.path = self.folder / "data"
        splat.write_synthetic(self.path, train=2, val=1, train_views=4, test_views=3, resolution=16,
                              seed=1)

    def open(self, **options: Any) -> splat.Dataset:
        return splat.Dataset(self.path, resolution=16, background=(1, 1, 1), **options)

    def test_views(self) -> None:
        dataset = self.open(depth=True, normal=True, mask=True)
        self.assertEqual((len(dataset), dataset.views(1), dataset.report["format"]), (2, 4, "srn"))
        found = dataset.read(0, [2, 0, 2])
        shapes = {name: array.shape[1:] for name, array in found.items()}
        self.assertEqual(shapes, {"images": (3, 16, 16), "view_to_world": (4, 4),
                                  "quaternions": (4,), "focals": (2,), "origin_distances": (),
                                  "depths": (1, 16, 16), "normals": (3, 16, 16),
                                  "masks": (1, 16, 16)})
        np.testing.assert_array_equal(found["images"][0], found["images"][2])
        np.testing.assert_array_equal(found["view_to_world"][0], np.eye(4))
        np.testing.assert_array_equal(dataset.read(0)["images"].shape, (4, 3, 16, 16))
        self.assertEqual(dataset.check(0)["problems"], [])

    def test_planes(self) -> None:
        pixels = np.zeros((16, 16, 4), np.uint8)
        pixels[:4], pixels[4:12] = (255, 128, 128, 255), (0, 128, 128, 51)
        for rgb in sorted(self.path.rglob("rgb")):
            (rgb.parent / "plane").mkdir()
            for picture in rgb.iterdir():
                splat.Image(pixels).save(rgb.parent / "plane" / picture.name)
        planes = self.open(plane=True).read(0, [1])["planes"]
        self.assertEqual(planes.shape, (1, 5, 16, 16))
        np.testing.assert_allclose(planes[0, :, 0, 0], (1, 128 / 255, 128 / 255, 1, 1), 1e-6)
        np.testing.assert_allclose(planes[0, :, 4, 0], (0, 128 / 255, 128 / 255, 0.2, 0.5), 1e-6)
        self.assertEqual(planes[0, :, 12:].max(), 0)

    def test_tokens_of_masks(self) -> None:
        masks, names, out = self.folder / "masks", self.folder / "palette", self.folder / "out.npz"
        for split, count, views in (("train", 2, 4), ("val", 1, 3)):
            for i in range(count):
                place = masks / split / f"{i:06}_car"
                place.mkdir(parents=True)
                for view in range(views):
                    splat.Image(np.eye(16, dtype=np.uint8)).save(place / f"{view}.png")
        names.write_text("0 0 0 void\n1 1 1 diagonal\n")
        made = splat.write_tokens(self.path, masks, names, out, dimension=12, tokens=3)
        self.assertEqual(made, {"objects": 3, "views": 11, "classes": 1, "segments": 11, "dropped": 0})
        with np.load(out) as arrays:
            tokens = arrays["val/000000_car"]
        self.assertEqual(tokens.shape, (3, 12, 3))
        np.testing.assert_allclose(tokens[0, 6:, 0], [0.5, 0.5, 1, 1, 1 / 16, 1])
        self.assertEqual(np.abs(tokens[:, :, 1:]).max(), 0)
        names.write_text("0 0 0 void\n")
        self.refused(splat.FormatError, "the colour (1, 1, 1)", splat.write_tokens, self.path, masks,
                     names, out)
        self.refused(splat.InvalidArgument, "dimension is 13", splat.write_tokens, self.path, masks,
                     names, out, dimension=13)

    def test_export(self) -> None:
        calls: List[Tuple[int, int]] = []
        out = self.folder / "out"
        with splat.Dataset(self.path) as dataset:
            splat.export_dataset(dataset, out, layout="store", objects=[1],
                                 progress=lambda done, total: calls.append((done, total)))
            self.assertEqual(calls[-1], (20, 20))  # 4 views: poses, images and three maps
            self.refused(splat.InvalidArgument, "layout is 'x'", splat.export_dataset, dataset, out,
                         layout="x")
            self.refused(splat.InvalidArgument, "lists no object", splat.export_dataset, dataset,
                         out, objects=[])

            def stop(done: int, total: int) -> None:
                raise KeyError("enough")

            self.refused(KeyError, "enough", splat.export_dataset, dataset, self.folder / "b",
                         layout="store", progress=stop)
            splat.export_dataset(dataset, self.folder / "b", layout="store")
            for part in ((1, 2), (0, 2)):
                splat.export_dataset(dataset, self.folder / "c", layout="store", shard=part)
            self.assertEqual((self.folder / "b/train/rgb.npy").read_bytes(),
                             (self.folder / "c/train/rgb.npy").read_bytes())
            self.refused(splat.InvalidArgument, "shard is 2", splat.export_dataset, dataset,
                         self.folder / "d", layout="store", shard=(2, 2))
            expected = dataset.read(1)
        with splat.Dataset(out) as store:
            self.assertEqual((store.report["format"], len(store)), ("store", 1))
            for name, array in store.read(0).items():
                np.testing.assert_array_equal(array, expected[name])
        self.refused(splat.NotFound, "lacks tables", splat.import_tables, self.path, out)

    def test_bad_input(self) -> None:
        dataset = self.open()
        self.refused(splat.InvalidArgument, "", dataset.read, 9)
        self.refused(splat.InvalidArgument, "", dataset.read, 0, [7])
        self.refused(splat.InvalidArgument, "a view is -1", dataset.read, 0, [-1])
        self.refused(splat.NotFound, "", splat.Dataset, self.folder / "nothing")
        self.refused(splat.InvalidArgument, "format", splat.Dataset, self.path, format="other")
        self.refused(splat.InvalidArgument, "boats", splat.write_synthetic, self.folder / "b",
                     category="boats", train=1)

    def start(self, **options: Any) -> splat.Training:
        return splat.Training(self.folder / "run", CONFIG, values=[f"data.root='{self.path}'"],
                              device=self.device, **options)

    def test_events_until_an_interruption(self) -> None:
        kinds = []
        with self.start() as training:
            for event in training:
                kinds.append(event.kind)
                if event.kind == Kind.STEP:
                    self.assertGreater(event.numbers["loss"], 0)
                    self.assertEqual(event.numbers["loss"], training.last_step.loss)
                if event.kind == Kind.VALIDATED_PIECE:
                    self.assertGreater(event.numbers["val_psnr"], 0)
                    assert event.drawn is not None and event.truths is not None
                    self.assertEqual(event.drawn.shape, (3, 3, 16, 16))
                    self.assertEqual(event.drawn.shape, event.truths.shape)
                if event.step == 3 and event.kind == Kind.STEP:
                    thread = threading.Thread(target=training.interrupt)
                    thread.start()
                    thread.join()
            self.assertEqual((kinds[-1], event.ends), (Kind.INTERRUPTED, True))
            self.assertEqual(training.next().kind, Kind.INTERRUPTED)
            self.assertEqual(list(training), [])
            self.assertEqual(training.report["step"], 3)
            self.assertEqual(training.model().info.resolution, 16)
        self.refused(splat.InvalidState, "", self.start)
        with self.start(resume=True) as training:
            while (event := training.next()).kind != Kind.STEP:
                pass
            self.assertEqual(event.step, 4)
            self.refused(splat.InvalidState, "", self.start, resume=True)
        self.refused(splat.NotFound, "", splat.Training, self.folder / "other", CONFIG,
                     values=["data.root='gone'"], device=self.device)

    def test_trainer_and_batches(self) -> None:
        config = splat.config_merge(CONFIG, f"data.root='{self.path}'")
        trainer, batches = splat.Trainer(self.device, config), splat.Batches(self.open(), config, 1)
        trainer.model().init(1)
        first = batches.next(0)
        batches.next(1)
        trainer.step(first)  # a batch stays what it was
        state = trainer.to_bytes()
        trainer.save(self.folder / "state.safetensors")
        self.assertEqual((self.folder / "state.safetensors").read_bytes(), state)
        loss = trainer.step(batches.next(1)).loss
        sources: List[Any] = [state, self.folder / "state.safetensors"]
        for source in sources:
            trainer.resume(source)
            self.assertEqual((trainer.report["step"], trainer.step(batches.next(1)).loss), (1, loss))
        self.assertGreater(len(trainer.store()), 10)
        last = batches.next(2)
        batches.close()
        self.assertEqual(trainer.step(last).step, 3)
        self.refused(splat.FormatError, "", trainer.resume, b"nonsense")
        self.refused(splat.InvalidArgument, "background", splat.Batches,
                     splat.Dataset(self.path, resolution=16), config)

    def test_a_batch_of_arrays(self) -> None:
        found = self.open().read(0, [0, 1, 2])
        cameras = []
        for index in (1, 2):
            camera = splat.Camera.from_fov(16, 16, 0.9)
            camera.world_to_camera = np.linalg.inv(found["view_to_world"][index].T.astype(float))
            cameras.append(camera)
        batch = splat.Batch(found["images"][:1], found["images"][1:], cameras,
                            view_to_world=found["view_to_world"][:1],
                            quaternions=found["quaternions"][:1])
        trainer = splat.Trainer(self.device, CONFIG)
        trainer.model().init(1)
        self.assertEqual(trainer.step(batch).step, 1)
        self.refused(splat.ShapeMismatch, "", trainer.step,
                     splat.Batch(found["images"][:2], found["images"][1:], cameras,
                                 view_to_world=found["view_to_world"][:1],
                                 quaternions=found["quaternions"][:1]))
        self.refused(splat.InvalidArgument, "float64", splat.Batch, np.zeros((1, 3, 16, 16)),
                     found["images"], cameras, view_to_world=found["view_to_world"],
                     quaternions=found["quaternions"])
