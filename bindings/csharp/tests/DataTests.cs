using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Threading;

namespace Splat.Tests
{
    /// <summary>Two procedural cars of 16 x 16 pixels in each split.</summary>
    internal static class Cars
    {
        private static string folder;

        internal static string Folder
        {
            get
            {
                if (folder != null) return folder;
                folder = Shared.PathOf("cars");
                Dataset.WriteSynthetic(new SyntheticOptions
                {
                    Path = folder, Seed = 1, Resolution = 16, TrainViews = 6, TestViews = 6,
                    TrainObjects = 2, ValObjects = 1, TestObjects = 2,
                });
                return folder;
            }
        }

        internal static Dataset Open(string split = "train")
        {
            return new Dataset(Folder, new DatasetOptions
            {
                Split = split, Resolution = 16, Background = new float[] { 1, 1, 1 },
            });
        }

        internal static string Config(params string[] changes)
        {
            return Splat.Config.Merge(ModelTests.Tiny, changes);
        }
    }

    internal static class ConfigTests
    {
        [Test]
        private static void MergesAndChecks()
        {
            Expect.Contains("\"opt.base_lr\"", Config.KeysJson());
            string merged = Config.Merge("opt: {batch_size: 3}", "opt.base_lr=0.125",
                "general.random_seed=5");
            Expect.Contains("0.125", merged);
            Expect.Contains("\"batch_size\": 3", merged);
            Expect.Contains("\"warnings\"", Config.CheckJson(null, "opt.iterations=10"));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "opt.batch_size",
                           () => Config.Merge(null, "opt.batch_sise=3"));
            Expect.Throws<ArgumentNullException>(() => Config.Merge(null, new string[1]));
        }
    }

    internal static class DatasetTests
    {
        [Test]
        private static void ReadsViews()
        {
            Expect.Equal("%2E.%2Fa%2Fb", Dataset.PathName("../a/b"));
            using (Dataset data = Cars.Open())
            {
                Expect.Equal(2, data.Count);
                Expect.Equal(16, data.Resolution);
                DatasetViews views = data.Read(1, new[] { 2, 0, 2 },
                    ViewParts.Depths | ViewParts.Masks |
                                                                     ViewParts.Normals);
                Expect.Equal(3 * 3 * 256, views.Images.Length);
                Expect.Equal(3 * 3 * 256, views.Normals.Length);
                Expect.Same(views.Images.Take(768), views.Images.Skip(2 * 768));
                Expect.True(views.Masks.Any(v => v > 0), "a mask");
                Expect.Equal(1f, views.Quaternions[0]);
                Expect.Equal(null, data.Read(0, new[] { 0 }).Depths);
                Expect.Contains("\"problems\": []", data.CheckJson(0));
                Expect.Contains("\"srn\"", data.ReportJson());
            }
        }

        [Test]
        private static void ReadsPlanes()
        {
            string folder = Shared.PathOf("planes");
            Dataset.WriteSynthetic(new SyntheticOptions
            {
                Path = folder, Resolution = 16, TrainViews = 2, TestViews = 2, TrainObjects = 1,
            });
            var map = new Image(16, 16, 4);
            for (int i = 0; i < 64; ++i) new byte[] { 255, 128, 128, 255 }.CopyTo(map.Data, 4 * i);
            foreach (string rgb in Directory.GetDirectories(folder, "rgb", SearchOption.AllDirectories))
            {
                string planes = Path.Combine(Path.GetDirectoryName(rgb), "plane");
                Directory.CreateDirectory(planes);
                foreach (string picture in Directory.GetFiles(rgb))
                    map.Save(Path.Combine(planes, Path.GetFileName(picture)));
            }
            using (var data = new Dataset(folder, new DatasetOptions { Flags = DataFlags.Plane }))
            {
                float[] planes = data.Read(0, new[] { 1 }, ViewParts.Planes).Planes;
                Expect.Equal(5 * 256, planes.Length);
                Expect.Same(new float[] { 1, 1, 1 },
                            new[] { planes[0], planes[3 * 256], planes[4 * 256] });
                Expect.Equal(0f, planes[4 * 256 + 64]);
                Expect.Equal(null, data.Read(0, new[] { 1 }).Planes);
            }
        }

        [Test]
        private static void Exports()
        {
            string path = Shared.PathOf("store");
            var options = new ExportOptions { Layout = "store", Objects = new[] { 1 } };
            using (Dataset data = Cars.Open())
            {
                Expect.Throws<InvalidOperationException>(() => data.Export(path, options,
                    (done, total) => throw new InvalidOperationException("mine")));
                long last = 0;
                data.Export(path, options, (done, total) => last = done);
                Expect.Equal(30L, last); // 6 views: poses, images and three maps
                Expect.Throws<ArgumentException>(
                    () => data.Export(path, new ExportOptions { Objects = new int[0] }));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "layout is 'x'",
                               () => data.Export(path, new ExportOptions { Layout = "x" }));
                using (var store = new Dataset(path))
                {
                    Expect.Equal(1, store.Count);
                    Expect.Same(data.Read(1, new[] { 3 }).Images, store.Read(0, new[] { 3 }).Images);
                }
            }
            Expect.Refused(ResultCode.ErrorNotFound, "lacks tables", () => Dataset.ImportTables(Cars.Folder));
        }

        [Test]
        private static void RefusesBadInput()
        {
            Expect.Refused(ResultCode.ErrorNotFound, "nowhere", () => new Dataset(Shared.PathOf("nowhere")));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "format",
                           () => new Dataset(Cars.Folder, new DatasetOptions { Format = "xyz" }));
            Expect.Throws<ArgumentException>(
                () => new Dataset(Cars.Folder, new DatasetOptions { Background = new float[1] }));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "path",
                           () => Dataset.WriteSynthetic(new SyntheticOptions { TrainObjects = 1 },
                               0));
            using (Dataset data = Cars.Open())
            {
                Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => data.Read(2, new[] { 0 }));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => data.Read(0, new[] { 99 }));
                Expect.Throws<ArgumentOutOfRangeException>(() => data.Read(0, new[] { -1 }));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => data.CheckJson(7));
                data.Dispose();
                Expect.Throws<ObjectDisposedException>(() => data.Read(0, new[] { 0 }));
                Expect.Throws<ObjectDisposedException>(() => new Batches(data));
            }
        }
    }

    internal static class TrainerTests
    {
        [Test]
        private static void StepsWithAndWithoutCopiesAreTheSame()
        {
            string config = Cars.Config();
            using (Dataset data = Cars.Open())
            using (var batches = new Batches(data, config, 3))
            using (var first = new Trainer(Shared.Device, config))
            using (var second = new Trainer(Shared.Device, config))
            {
                foreach (Trainer trainer in new[] { first, second })
                    using (Model model = trainer.GetModel()) model.Init(4);
                for (int i = 0; i < 2; ++i)
                {
                    TrainerInfo a = first.Step(batches, i);
                    TrainerInfo b = second.Step(batches.Read(i));
                    Expect.Equal(i + 1L, a.Step);
                    Expect.Equal(a.Loss, b.Loss);
                }
                Expect.Same(first.ToBytes(), second.ToBytes());
                Expect.Contains("\"step\": 2", first.ReportJson());
                using (Weights weights = first.Store()) Expect.True(weights.Count > 10, "weights");
                byte[] state = first.ToBytes();
                string path = Shared.PathOf("state.safetensors");
                first.Save(path);
                double loss = first.Step(batches, 2).Loss;
                second.Resume(state);
                Expect.Equal(loss, second.Step(batches, 2).Loss);
                second.Resume(path);
                Expect.Equal(loss, second.Step(batches, 2).Loss);
            }
        }

        [Test]
        private static void RefusesBadInput()
        {
            string config = Cars.Config();
            using (Dataset data = Cars.Open())
            using (var batches = new Batches(data, config))
            using (var trainer = new Trainer(Shared.Device, config))
            {
                TrainerBatch batch = batches.Read(0);
                batch.Images = new float[5];
                Expect.Refused(ResultCode.ErrorShapeMismatch, "images", () => trainer.Step(batch));
                batch.Images = new float[0];
                Expect.Throws<ArgumentException>(() => trainer.Step(batch));
                batch.Images = null;
                Expect.Refused(ResultCode.ErrorInvalidArgument, "images", () => trainer.Step(batch));
                Expect.Refused(ResultCode.ErrorFormat, "", () => trainer.Resume(new byte[] { 1, 2, 3 }));
                Expect.Refused(ResultCode.ErrorNotFound, "", () => trainer.Resume(Shared.PathOf("none")));
                Expect.Throws<ArgumentOutOfRangeException>(() => batches.Read(-1));
                Expect.Throws<ArgumentNullException>(() => trainer.Step((Batches)null, 0));
                batches.Dispose();
                Expect.Throws<ObjectDisposedException>(() => trainer.Step(batches, 0));
                trainer.Dispose();
                Expect.Throws<ObjectDisposedException>(() => trainer.GetModel());
            }
            Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => new Trainer(Shared.Device, "a: b"));
        }
    }

    internal static class TrainingTests
    {
        private static TrainingOptions Options(params string[] changes)
        {
            return new TrainingOptions
            {
                Config = ModelTests.Tiny,
                Values = changes.Concat(new[] { "data.root='" + Cars.Folder + "'" }).ToArray(),
            };
        }

        [Test]
        private static void EnumeratesToTheEnd()
        {
            string folder = Shared.PathOf("run");
            using (var training = new Training(Shared.Device, folder,
                                               Options("opt.iterations=3", "logging.val_log=2",
                                                   "logging.ckpt_iterations=3")))
            {
                var kinds = new List<RunEventKind>();
                RunEvent stale = null;
                foreach (RunEvent now in training)
                {
                    kinds.Add(now.Kind);
                    if (now.Kind == RunEventKind.Step)
                        Expect.Equal(training.LastStep.Loss, now.Numbers["loss"]);
                    if (now.Kind != RunEventKind.ValidatedPiece) continue;
                    Expect.Equal(now.Views * 3 * now.Width * now.Height, now.ReadImages().Length);
                    Expect.True(now.ReadTruths().Any(v => v < 1), "true images");
                    Expect.True(now.Name.Length > 0, "a name");
                    stale = now;
                }
                Expect.Equal(3, kinds.Count(k => k == RunEventKind.Step));
                Expect.Equal(RunEventKind.Done, kinds.Last());
                Expect.Throws<InvalidOperationException>(() => stale.ReadImages());
                Expect.Contains("\"step\": 3", training.ReportJson());
                using (Model model = training.GetModel()) Expect.Equal(16, model.Info.Resolution);
                training.Dispose();
                Expect.Throws<ObjectDisposedException>(() => training.Next());
                Expect.Throws<ObjectDisposedException>(training.Interrupt);
                Expect.Throws<ObjectDisposedException>(() => stale.ReadImages());
            }
            Expect.True(File.Exists(Path.Combine(folder, "weights_last.safetensors")), "weights");
        }

        [Test]
        private static void ATokenInterruptsAndTheRunResumes()
        {
            string folder = Shared.PathOf("interrupted");
            long step = 0;
            using (var source = new CancellationTokenSource())
            using (var training = new Training(Shared.Device, folder,
                Options("opt.iterations=1000", "logging.val_log=0")))
            {
                RunEvent last = null;
                foreach (RunEvent now in training.Run(source.Token))
                {
                    last = now;
                    if (now.Kind == RunEventKind.Step && now.Step == 2)
                    {
                        var other = new Thread(source.Cancel);
                        other.Start();
                        other.Join();
                    }
                }
                Expect.Equal(RunEventKind.Interrupted, last.Kind);
                step = last.Step;
            }
            Expect.True(step >= 2 && step < 1000, "an interruption");
            using (var training = new Training(Shared.Device, folder,
                                               new TrainingOptions
                                                   { Flags = TrainingFlags.Resume }))
            {
                RunEvent next;
                do next = training.Next(); while (next.Kind != RunEventKind.Step);
                Expect.Equal(step + 1, next.Step);
                Expect.Refused(ResultCode.ErrorInvalidState, "", () => new Training(
                    Shared.Device, folder, new TrainingOptions { Flags = TrainingFlags.Resume }));
            }
        }

        [Test]
        private static void TakesOpenDataSets()
        {
            using (Dataset data = Cars.Open())
            {
                TrainingOptions options = Options("opt.iterations=1", "logging.val_log=0");
                options.Dataset = data;
                using (var training = new Training(Shared.Device, Shared.PathOf("given"), options))
                {
                    data.Dispose();
                    Expect.Equal(RunEventKind.Done, training.Last().Kind);
                }
            }
        }

        [Test]
        private static void RefusesBadInput()
        {
            Expect.Throws<ArgumentNullException>(() => new Training(Shared.Device, null));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "opt.iterationz", () => new Training(
                Shared.Device, Shared.PathOf("bad"), Options("opt.iterationz=3")));
            Expect.Refused(ResultCode.ErrorInvalidState, "", () => new Training(
                Shared.Device, Shared.PathOf("bad"),
                new TrainingOptions { Flags = TrainingFlags.Resume }));
            Expect.True(!Directory.Exists(Shared.PathOf("bad")), "the folder untouched");
        }
    }
}
