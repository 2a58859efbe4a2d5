using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Threading;

namespace Splat.Tests
{
    internal static class FactsTests
    {
        [Test]
        private static void AreEqualByTheirValues()
        {
            using (Scene scene = Shared.ThreeGaussians())
            {
                SceneInfo before = scene.Info;
                Expect.Equal(before, scene.Info);
                Expect.True(before == scene.Info && !(before == null) && !(null == before), "==");
                Expect.Equal(before.GetHashCode(), scene.Info.GetHashCode());
                scene.Transform(new Similarity { Scale = 2 });
                Expect.True(before != scene.Info && !before.Equals((object)"text"), "!=");
            }
            Expect.Equal(new Score("a", 1), new Score("a", 1));  // NaN for NaN
            Expect.True(new Score("a", 1) != new Score("a", 1, 2), "another score");
            Expect.Equal(new Port("x", 2, 3), new Port("x", 2, 3));
            Expect.Equal(1, new[] { new Port("x", 2), new Port("x", 2) }.Distinct().Count());
            Expect.True(new Port("x", 2, 3) != new Port("x", 3, 2) && new Port("x") != new Port("x", 1), "shapes");
            var camera = new Camera(4, 5, 1, 2, 3, 4);
            Camera moved = camera.LookAt(new double[] { 0, 0, -2 }, new double[3], new double[] { 0, -1, 0 });
            Camera[] cameras = { camera, camera.With(5), camera.With(height: 6), camera.With(fx: 7), camera.With(fy: 7),
                                 camera.With(cx: 7), camera.With(cy: 7), moved };
            Expect.Equal(8, cameras.Concat(cameras.Select(c => c.With())).Distinct().Count());
            var dims = new long[] { 2, 3 };
            var port = new Port("x", dims);
            dims[0] = 9;
            Expect.Equal(new Port("x", 2, 3), port);
        }

        [Test]
        private static void SayWhatTheyAreInEveryCulture()
        {
            CultureInfo before = Thread.CurrentThread.CurrentCulture;
            Thread.CurrentThread.CurrentCulture = new CultureInfo("de-DE");
            try
            {
                Expect.Equal("Port { Name = x, Flags = None, Dims = [2, 3], Elements = 6 }",
                             new Port("x", 2, 3).ToString());
                Expect.Equal("Score { Name = a, Psnr = 1.5, Ssim = NaN, Lpips = NaN }",
                             new Score("a", 1.5).ToString());
                Expect.Contains("Fx = 3.5, Fy = 4, Cx = 0, Cy = 0, WorldToCamera = [1, 0,",
                                new Camera(8, 8, 3.5, 4, 0, 0).ToString());
                Expect.Contains("Fx = 0.1,", new Camera(8, 8, 0.1, 4, 0, 0).ToString());
            }
            finally
            {
                Thread.CurrentThread.CurrentCulture = before;
            }
        }

        [Test]
        private static void ObjectsSayTheirSize()
        {
            Device device = Shared.Device;
            using (Scene scene = Shared.ThreeGaussians())
            using (var tensor = new Tensor(device, new long[] { 2, 3 }, DType.I32, "ids"))
            using (Rasterizer rasterizer = Shared.SmallRasterizer(device))
            using (RasterizerState state = rasterizer.CreateState())
            using (Module module = ModuleTests.Linear())
            using (Weights weights = Weights.FromArrays(new[] { new NamedArray("a", new float[6], 2, 3) }))
            using (var predictor = new Predictor(device))
            using (Prediction prediction = predictor.Predict(Shared.Disc()))
            using (Dataset data = Cars.Open())
            {
                Expect.Equal("Scene (3 Gaussians of degree 0)", scene.ToString());
                Expect.Equal("Tensor (I32 [2, 3] ids)", tensor.ToString());
                Expect.Equal("Rasterizer (48 x 32)", rasterizer.ToString());
                Expect.Equal("RasterizerState", state.ToString());
                Expect.Equal("Module (linear)", module.ToString());
                Expect.Equal("Weights (1 tensors)", weights.ToString());
                Expect.Equal("Predictor (64 pixels, 4096 Gaussians)", predictor.ToString());
                Expect.Equal("Dataset (2 objects, 16 x 16)", data.ToString());
                Expect.Contains("Device (" + device.Info.Name, device.ToString());
                Expect.Equal(3, prediction.ToString().Split('\n').Length);
                scene.Dispose();
                Expect.Equal("Scene (disposed)", scene.ToString());
            }
            Expect.Equal("Image (5 x 3, 4 channels of U8)", new Image(5, 3, 4).ToString());
            Expect.Equal("a [2, 3]", new NamedArray("a", new float[6], 2, 3).ToString());
            Expect.Equal("a.png", ((PictureSource)"a.png").ToString());
        }

        [Test]
        private static void ListsThatAreCopiesCannotBeWritten()
        {
            Camera camera = Camera.FromFov(8, 8, 1);
            Expect.Throws<NotSupportedException>(() => ((IList<double>)camera.WorldToCamera)[0] = 3);
            Expect.Throws<NotSupportedException>(() => ((IList<long>)new Port("x", 2).Dims)[0] = 3);
            Expect.Throws<NotSupportedException>(() => ((IList<byte>)Shared.Device.Info.Uuid)[0] = 3);
        }
    }

    internal static class ArgumentTests
    {
        private static void Named(string name, Action action)
        {
            Exception error = null;
            try { action(); } catch (ArgumentException thrown) { error = thrown; }
            Expect.Equal(name, (error as ArgumentException)?.ParamName);
        }

        [Test]
        private static void WrongOnesAreNamed()
        {
            Device device = Shared.Device;
            string path = Shared.PathOf("x");
            var image = new Image(4, 4, 3);
            Camera camera = Camera.FromFov(8, 8, 1);
            Named("scene", () => Camera.Orbit(null, 1));
            Named("scenes[1]", () => Scene.Merge(Shared.ThreeGaussians(), null));
            Named("weights[0]", () => new Lpips(device, new Weights[1], 16));
            Named("frames", () => Image.SaveAnimation(path, null));
            Named("frames[1]", () => Image.SaveAnimation(path, new[] { image, null }));
            Named("names[0]", () => Camera.Save(path, new[] { camera }, new string[1]));
            Named("path", () => Camera.Save(null, new[] { camera }));
            Named("path", () => Scene.Load("a\0b"));
            Named("path", () => Weights.Load("\ud800"));
            Named("path", () => Camera.Load("a\0b"));
            Named("Type", () => new Operator(device, new OperatorOptions { Type = "a\0b" }));
            Named("name", () => new Tensor(device, new long[] { 1 }, DType.F32, "a\0b"));
            Named("values[0]", () => Config.Merge(null, new string[1]));
            Named("picture", () => new Predictor(device).Predict((Picture)null));
            Named("pictures[0]", () => new Predictor(device).Predict(new Picture[1]));
            Named("views", () => Cars.Open().Read(0, null));
            Named("Conditioning[0]", () => new Evaluator(new EvaluatorOptions { Conditioning = new[] { -1 } }));
            Named("Background", () => new Dataset(path, new DatasetOptions { Background = new float[1] }));
            Named("Uuid", () => new Device(new DeviceOptions { Uuid = new byte[3] }));
            Named("Timeout", () => new Device(new DeviceOptions { Timeout = TimeSpan.FromSeconds(-1) }));
            Named("MaxDeviceBytes", () => new Device(new DeviceOptions { MaxDeviceBytes = -1 }));
            Named("Images", () => new Model(device, new ModelOptions { Config = ModelTests.Tiny }).Forward(
                new ModelInput { Images = new float[0] }));
            Named("cameraFile", () => Camera.FromBytes(null));
            Named("values", () => new NamedArray("a", null));
            Named("TrainObjects", () => Dataset.WriteSynthetic(new SyntheticOptions { Path = path, TrainObjects = -1,
                                                                                      TestObjects = 1 }));
        }

        [Test]
        private static void SentencesKeepNamesOfAttributes()
        {
            Expect.Equal("gaussian_head: sh_degree is 2", Programs.Told("gaussian_head: sh_degree is 2"));
            Expect.Equal("ShDegree is 2", Programs.Told("sh_degree is 2"));
            Expect.Equal("linear: the number of inputs is 0", Programs.Told("linear: input_count is 0"));
            Expect.Equal("raise DeviceOptions.Timeout or SPLAT_TIMEOUT_SCALE",
                         Programs.Told("raise timeout_ns or SPLAT_TIMEOUT_SCALE"));
        }

        [Test]
        private static void StreamsAreReadFromWhereTheyStand()
        {
            byte[] png = new Image(5, 3, 4).ToBytes();
            var stream = new MemoryStream(new byte[] { 1 }.Concat(png).ToArray()) { Position = 1 };
            Expect.Equal(5, Image.FromStream(stream).Width);
            using (Scene scene = Shared.ThreeGaussians())
            using (Scene read = Scene.FromStream(new MemoryStream(scene.ToBytes(SceneFormat.Ply))))
                Expect.Equal(3L, read.Count);
            using (Weights weights = Weights.Load("cars64"))
            using (Weights read = Weights.FromStream(new MemoryStream(weights.ToBytes())))
                Expect.Same(weights.Keys, read.Keys);
            Named("stream", () => Scene.FromStream(null));
        }

        [Test]
        private static void SizesAreCheckedBeforeMemoryIsTaken()
        {
            const int Most = int.MaxValue;
            using (Scene scene = Shared.ThreeGaussians())
            {
                Expect.Refused(ResultCode.ErrorOutOfHostMemory, "cameras, an array of " + Most,
                               () => Camera.Orbit(scene, Most));
                var options = new RenderOptions { Channels = Most };
                Named("Channels", () => scene.Render(Shared.SmallCameras(scene), options));
            }
            Expect.Refused(ResultCode.ErrorOutOfHostMemory, "samples",
                           () => new Image(Most, Most, Most, Pixel.F32));
            Expect.Refused(ResultCode.ErrorOutOfHostMemory, "3 x " + Most, () => Priors.MeshPoints("none.obj", Most));
            Expect.Refused(ResultCode.ErrorOutOfHostMemory, "samples",
                           () => Shared.Disc().Cut(Most, null, out _, out _));
            Expect.Refused(ResultCode.ErrorUnsupported, "at most", () => new Scene(long.MaxValue));
            Named("arrays", () => new Scene(long.MaxValue, Most, new SceneArrays { Sh = new float[4] }));
            Named("Gaussians", () => new Rasterizer(Shared.Device,
                                                    new RasterizerOptions { Gaussians = long.MaxValue }));
            new Device(new DeviceOptions { Timeout = TimeSpan.MaxValue }).Dispose();
        }
    }
}
