using System;
using System.IO;
using System.Linq;

namespace Splat.Tests
{
    internal static class SceneTests
    {
        [Test]
        private static void HoldsItsArrays()
        {
            using (Scene scene = Shared.ThreeGaussians())
            {
                Expect.Equal(3L, scene.Count);
                Expect.Equal(0, scene.ShDegree);
                Expect.Same(new float[] { -1, 0, 0, 0, 0, 0.5f, 1, 0, 0 }, scene.Read("means"));
                Expect.Same(new float[] { 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0 }, scene.Read("rotations"));
                Expect.Near(1 / (1 + Math.Exp(-4)), scene.Read("opacities")[1], 1e-6);
                Expect.Same(new double[] { -1, 0, 0 }, scene.Info.Low);
                scene.Write("opacities", new[] { 0.25f, 0.5f, 0.75f });
                Expect.Near(0, scene.Read("opacity_logits")[1], 1e-6);
                var part = new float[5];
                scene.Read("opacities", part);
                Expect.Equal(0f, part[4]);
            }
        }

        [Test]
        private static void EmptyScenesWork()
        {
            using (var scene = new Scene(0, 2))
            {
                Expect.Equal(0L, scene.Count);
                Expect.Equal(0, scene.Read("means").Length);
                Expect.Refused(ResultCode.ErrorInvalidState, "",
                               () => scene.ToTensor("means", Shared.Device));
            }
        }

        [Test]
        private static void FilesAndBytesKeepIt()
        {
            using (Scene scene = Shared.ThreeGaussians())
            {
                string path = Shared.PathOf("szene ☃.ply");
                scene.Save(path);
                Expect.Same(File.ReadAllBytes(path), scene.ToBytes(SceneFormat.Ply));
                Expect.Equal((scene.Count, scene.ShDegree), Scene.Peek(path));
                using (Scene loaded = Scene.Load(path))
                using (Scene parsed = Scene.FromBytes(File.ReadAllBytes(path)))
                {
                    Expect.Same(scene.Read("log_scales"), loaded.Read("log_scales"));
                    Expect.Same(scene.Read("sh"), parsed.Read("sh"));
                    Expect.Contains("\"ply\"", loaded.LoadReportJson());
                }
                var options = new SceneFileOptions
                    { Frame = Frame.Rub, ShDegree = 2, SpzVersion = 4 };
                using (Scene parsed = Scene.FromBytes(scene.ToBytes(SceneFormat.Spz, options)))
                    Expect.Equal(2, parsed.ShDegree);
                Expect.Contains("\".spz\"", Scene.FormatsJson());
            }
        }

        [Test]
        private static void Changes()
        {
            using (Scene scene = Shared.ThreeGaussians())
            {
                scene.Transform(new Similarity { Translation = new double[] { 0, 1, 0 }, Scale = 2 });
                Expect.Same(new float[] { -2, 1, 0, 0, 1, 1, 2, 1, 0 }, scene.Read("means"));
                scene.Crop(new double[] { -3, 0, 0 }, new double[] { 1, 2, 2 });
                Expect.Equal(2L, scene.Count);
                scene.SetShDegree(1);
                Expect.Equal(1, scene.ShDegree);
                Expect.Throws<SplatException>(() => scene.SetShDegree(4));
                scene.Write("opacities", new[] { 0.1f, 0.9f });
                scene.Filter(0.5, FilterFlags.Finite | FilterFlags.Sort);
                Expect.Equal(1L, scene.Count);
                using (Scene other = Shared.ThreeGaussians())
                {
                    using (Scene both = Scene.Merge(scene, other, other))
                        Expect.Equal(7L, both.Count);
                    other.CropSphere(new double[] { 0, 0, 0 }, 1);
                    Expect.Equal(3L, other.Count);
                    other.CropSphere(new double[] { -1, 0, 0 }, 1);
                    Expect.Equal(1L, other.Count);
                }
            }
        }

        [Test]
        private static void HasPartsAndCopies()
        {
            using (Scene scene = Shared.ThreeGaussians())
            using (Scene part = scene.Slice(1, 2))
            using (Scene copy = scene.Copy())
            using (Scene none = scene.Slice(3, 0))
            {
                Expect.Equal(2L, part.Count);
                Expect.Equal(0L, none.Count);
                foreach (string name in new[] { "means", "log_scales", "rotations", "opacity_logits", "sh" })
                {
                    Expect.Same(scene.Read(name), copy.Read(name));
                    Expect.Same(scene.Read(name).Skip(scene.Read(name).Length / 3), part.Read(name));
                }
                copy.Write("means", new float[9]);
                Expect.Equal(-1f, scene.Read("means")[0]);
                Expect.Equal("count", Expect.Throws<ArgumentOutOfRangeException>(() => scene.Slice(1, 3)).ParamName);
                Expect.Throws<ArgumentOutOfRangeException>(() => scene.Slice(-1, 1));
                Expect.Throws<ArgumentOutOfRangeException>(() => scene.Slice(4, 0));
            }
        }

        [Test]
        private static void TakesMemoryWithoutACopy()
        {
            var numbers = new float[] { 9, 9, 1, 2, 3, 9 };
            using (var scene = new Scene(1, 0, new SceneArrays { Means = numbers.AsMemory(2, 3) }))
            {
                Expect.Same(new float[] { 1, 2, 3 }, scene.Read("means"));
                var box = new double[] { 0, 0, 0, 4, 4, 4 };
                scene.Crop(box.AsSpan(0, 3), box.AsSpan(3, 3));
                Expect.Equal(1.0, scene.ComparePoints(numbers.AsSpan(2, 3), 1e-6).FScore);
                byte[] file = scene.ToBytes(SceneFormat.Ply);
                using (Scene same = Scene.FromBytes(file.AsSpan())) Expect.Equal(1L, same.Count);
            }
        }

        [Test]
        private static void GoesToTensors()
        {
            using (Scene scene = Shared.ThreeGaussians())
            using (Tensor tensor = scene.ToTensor("scales", Shared.Device))
            {
                Expect.Same(new long[] { 3, 3 }, tensor.Dims);
                Expect.Near(Math.Exp(-1), tensor.ToArray()[4], 1e-6);
            }
        }

        [Test]
        private static void RefusesBadInput()
        {
            Expect.Throws<ArgumentOutOfRangeException>(() => new Scene(-1));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "ShDegree", () => new Scene(1, 4));
            Expect.Contains("Means has 2 numbers instead of 3", Expect.Throws<ArgumentException>(
                () => new Scene(1, 0, new SceneArrays { Means = new float[2] })).Message);
            Expect.Throws<ArgumentException>(() => new Scene(1, 0, new SceneArrays { Sh = new float[0] }));
            using (Scene scene = Shared.ThreeGaussians())
            {
                Expect.Refused(ResultCode.ErrorInvalidArgument, "bytes",
                               () => scene.Read("means", new float[8]));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "colour", () => scene.Read("colour"));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "scales",
                               () => scene.Write("scales", new float[9]));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "bytes",
                               () => scene.Write("means", new float[0]));
                Expect.Throws<ArgumentNullException>(() => scene.Read(null));
                Expect.Throws<ArgumentException>(() => scene.Crop(new double[2], new double[3]));
                Expect.Throws<ArgumentNullException>(() => scene.Transform(null));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "",
                               () => scene.Transform(new Similarity { Scale = 0 }));
                Expect.Refused(ResultCode.ErrorUnsupported, ".obj",
                               () => scene.Save(Shared.PathOf("scene.obj")));
                Expect.Refused(ResultCode.ErrorNotFound, "nowhere",
                               () => scene.Save(Shared.PathOf("nowhere/scene.ply")));
                scene.Dispose();
                Expect.Throws<ObjectDisposedException>(() => scene.Read("means"));
                Expect.Throws<ObjectDisposedException>(() => scene.ToBytes(SceneFormat.Ply));
                Expect.Throws<ObjectDisposedException>(() => Scene.Merge(scene));
            }
            using (Scene none = Scene.Merge()) Expect.Equal(0L, none.Count);
            Expect.Throws<ArgumentNullException>(() => Scene.Load(null));
            Expect.Refused(ResultCode.ErrorNotFound, "none.ply", () => Scene.Load(Shared.PathOf("none.ply")));
            Expect.Refused(ResultCode.ErrorFormat, "", () => Scene.FromBytes(new byte[] { 1, 2, 3 }));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => Scene.FromBytes(null));
        }
    }

    internal static class CameraTests
    {
        [Test]
        private static void PosesAreWhatTheySay()
        {
            Camera camera = Camera.FromFov(64, 48, Math.PI / 2);
            Expect.Near(32, camera.Fx, 1e-9);
            Expect.Near(24, camera.Cy, 1e-9);
            Camera moved = camera.LookAt(new double[] { 0, 0, -3 }, new double[3], new double[] { 0, -1, 0 });
            Expect.Near(3, moved.WorldToCamera[11], 1e-9);
            Expect.Equal(0.0, camera.WorldToCamera[11]);
            Camera same = camera.WithOpenGl(moved.ToOpenGl());
            for (int i = 0; i < 16; ++i) Expect.Near(moved.WorldToCamera[i], same.WorldToCamera[i], 1e-9);
            var made = new Camera(64, 48, 32, 32, 32, 24, moved.WorldToCamera);
            Expect.Same(moved.WorldToCamera, made.WorldToCamera);
        }

        [Test]
        private static void WithChangesOneNumber()
        {
            Camera camera = Camera.FromFov(64, 48, Math.PI / 2).WithOpenGl(
                new double[] { 1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1 });
            Camera wider = camera.With(fx: 16);
            Expect.Equal(16.0, wider.Fx);
            Expect.True(camera != wider, "another camera");
            Expect.Equal(camera, wider.With(fx: camera.Fx));
            Expect.Equal(camera, new Camera(64, 48, camera.Fx, camera.Fy, 32, 24, camera.WorldToCamera));
        }

        [Test]
        private static void WhatRenderWouldRefuseIsRefusedWhenMade()
        {
            Camera camera = Camera.FromFov(8, 8, 1);
            Expect.Refused(ResultCode.ErrorInvalidArgument, "focal", () => camera.With(fx: -1));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "focal", () => camera.With(fy: double.NaN));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "camera refused: 0 x 8", () => camera.With(width: 0));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "40000", () => camera.With(height: 40000));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => camera.With(cx: double.PositiveInfinity));
            foreach (int at in new[] { 0, 5, 10, 12, 15 })
            {
                double[] pose = camera.WorldToCamera.ToArray();
                pose[at] = -pose[at] + (at == 12 ? 1 : 0);
                Expect.Equal("worldToCamera",
                             Expect.Throws<ArgumentException>(() => camera.With(worldToCamera: pose)).ParamName);
            }
        }

        [Test]
        private static void FilesAndBytesKeepThem()
        {
            using (Scene scene = Shared.ThreeGaussians())
            {
                Camera[] cameras = Shared.SmallCameras(scene, 5);
                string path = Shared.PathOf("transforms.json");
                var names = new[] { "a.png", "b.png", "c.png", "d.png", "ä.png" };
                Camera.Save(path, cameras, names);
                Camera[] loaded = Camera.Load(path);
                Expect.Equal(5, loaded.Length);
                for (int i = 0; i < 16; ++i)
                    Expect.Near(cameras[3].WorldToCamera[i], loaded[3].WorldToCamera[i], 1e-9);
                Expect.Contains("ä.png", Camera.LoadReportJson(path));
                byte[] bytes = Camera.ToBytes(cameras, names);
                Expect.Same(File.ReadAllBytes(path), bytes);
                Expect.Equal(5, Camera.FromBytes(bytes).Length);
                Expect.Contains("b.png", Camera.BytesReportJson(bytes));
                Expect.Equal(0, Camera.FromBytes(Camera.ToBytes(new Camera[0])).Length);
            }
        }

        [Test]
        private static void RefusesBadInput()
        {
            Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => Camera.FromFov(0, 48, 1));
            Expect.Throws<ArgumentOutOfRangeException>(() => Camera.FromFov(-1, 48, 1));
            Expect.Throws<ArgumentException>(() => new Camera(1, 1, 1, 1, 0, 0, new double[15]));
            Camera camera = Camera.FromFov(8, 8, 1);
            Expect.Throws<ArgumentException>(
                () => camera.LookAt(new double[2], new double[3], new double[3]));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "",
                           () => camera.LookAt(new double[3], new double[3],
                               new double[] { 0, 1, 0 }));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => camera.WithOpenGl(new double[16]));
            using (Scene scene = Shared.ThreeGaussians())
            {
                Expect.Equal(0, Camera.Orbit(scene, 0).Length);
                Expect.Throws<ArgumentOutOfRangeException>(() => Camera.Orbit(scene, -1));
                Camera[] keys = Camera.Orbit(scene, 6);
                Camera[] path = Camera.Path(keys, 12, true);
                Expect.Equal(12, path.Length);
                Expect.Equal(keys[0].Fx, path[3].Fx);
                Expect.Refused(ResultCode.ErrorInvalidArgument, "different poses",
                               () => Camera.Path(new[] { keys[0] }, 3));
                Expect.Throws<ArgumentException>(
                    () => Camera.Orbit(scene, 1, new OrbitOptions { Up = new double[1] }));
            }
            Expect.Throws<ArgumentException>(
                () => Camera.Save(Shared.PathOf("x.json"), new[] { camera }, new string[0]));
            Expect.Throws<ArgumentNullException>(
                () => Camera.Save(Shared.PathOf("x.json"), new Camera[] { null }));
            Expect.Refused(ResultCode.ErrorNotFound, "", () => Camera.Load(Shared.PathOf("none.json")));
            Expect.Refused(ResultCode.ErrorFormat, "", () => Camera.FromBytes(new byte[] { 65 }));
        }
    }
}
