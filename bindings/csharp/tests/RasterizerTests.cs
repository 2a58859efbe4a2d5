using System;
using System.Linq;

namespace Splat.Tests
{
    internal static class RasterizerTests
    {
        private static readonly float[] White = { 1, 1, 1 };

        [Test]
        private static void DrawsAScene()
        {
            using (Scene scene = Shared.ThreeGaussians())
            using (Rasterizer rasterizer = Shared.SmallRasterizer(
                       Shared.Device,
                       RasterizerFlags.Depth | RasterizerFlags.Normals | RasterizerFlags.Ids |
                       RasterizerFlags.MedianDepth))
            {
                Camera[] cameras = Shared.SmallCameras(scene, 2);
                rasterizer.Forward(scene, cameras, White);
                float[] rgb = rasterizer.Read(Output.Rgb);
                Expect.Equal(2 * 32 * 48 * 3, rgb.Length);
                Expect.Near(1, rgb[0], 0.05);
                Expect.True(rgb.Min() < 0.9, "something is drawn");
                Expect.Equal(2, rasterizer.Info.Views);
                Expect.Equal(3, rasterizer.Info.Gaussians);
                Expect.Same(new float[] { 1, 1, 1, 1, 1, 1 }, rasterizer.Read(Output.Visibility));
                foreach (Output output in Enum.GetValues(typeof(Output)))
                    if (output != Output.Default)
                        Expect.True(rasterizer.Read(output).Length > 0, "" + output);
                Image image = rasterizer.ReadImage(1);
                Expect.Equal(48 * 32 * 4, image.Data.Length);
                Image floats = rasterizer.ReadImage(1, 3, Pixel.F32);
                Expect.Same(rgb.Skip(32 * 48 * 3), floats.ToFloats());
                using (var tensor = new Tensor(Shared.Device, new long[] { 2, 32, 48, 3 }))
                {
                    rasterizer.CopyTo(Output.Rgb, tensor);
                    Expect.Same(rgb, tensor.ToArray());
                }
                Expect.Throws<ArgumentException>(() => rasterizer.ReadImages(
                    0, new[] { new Image(48, 32, 4, Pixel.U8, new byte[0]) }));
                // One view of three Gaussians at a rasterizer of two.
                rasterizer.Forward(scene, cameras.Take(1).ToArray(), White);
                Expect.Same(rgb.Take(32 * 48 * 3), rasterizer.Read(Output.Rgb));
            }
        }

        [Test]
        private static void DrawsASceneInOneCall()
        {
            using (Scene scene = Shared.ThreeGaussians())
            using (var rasterizer = new Rasterizer(Shared.Device, new RasterizerOptions
                       { Gaussians = 3, Width = 48, Height = 32, ShDegree = scene.ShDegree }))
            {
                Camera[] cameras = Shared.SmallCameras(scene, 3);
                var options = new RenderOptions { Background = White, Type = Pixel.F32 };
                Image[] images = scene.Render(cameras, options, Shared.Device);
                rasterizer.Forward(scene, cameras, White);  // made without a number of views
                for (int i = 0; i < 3; ++i)
                    Expect.Same(rasterizer.ReadImage(i, 3, Pixel.F32).ToFloats(), images[i].ToFloats());
                Expect.Same(images[1].ToFloats(), scene.Render(new[] { cameras[1] }, options)[0].ToFloats());
                options.DrawnAs = DrawnFlags.LinearColors;
                float sum = 0;
                foreach (float value in scene.Render(cameras, options)[0].ToFloats()) sum += value;
                foreach (float value in images[0].ToFloats()) sum -= value;
                Expect.True(sum > 1, "linear colours as sRGB are brighter");
                options.DrawnAs = 0;
                Expect.Same(images[1].ToFloats(), scene.Render(new[] { cameras[1] }, options)[0].ToFloats());
                options.DrawnAs = null;
                options.Channels = 2;
                Expect.Throws<SplatException>(() => scene.Render(cameras, options, Shared.Device));
                options.Background = new float[2];
                Expect.Throws<ArgumentException>(() => scene.Render(cameras, options));
                using (var source = new System.Threading.CancellationTokenSource())
                    Expect.Throws<ArgumentException>(() => scene.Render(cameras, null, null, source.Token));
            }
        }

        [Test]
        private static void StatesStayAlive()
        {
            using (Scene scene = Shared.ThreeGaussians())
            using (Rasterizer rasterizer = Shared.SmallRasterizer(Shared.Device))
            using (RasterizerState first = rasterizer.CreateState())
            using (RasterizerState second = rasterizer.CreateState())
            {
                Camera[] cameras = Shared.SmallCameras(scene, 2);
                rasterizer.Forward(scene, new[] { cameras[0] }, White, first);
                rasterizer.Forward(scene, new[] { cameras[1] }, null, second);
                Expect.Near(1, rasterizer.Read(Output.Rgb, first)[0], 0.05);
                Expect.Near(0, rasterizer.Read(Output.Rgb, second)[0], 0.05);
                Expect.Equal(1, rasterizer.GetInfo(second).Views);
                Expect.Equal(0, rasterizer.Info.Views);
                rasterizer.Dispose();
                Expect.Throws<ObjectDisposedException>(() => rasterizer.Read(Output.Rgb, first));
            }
        }

        [Test]
        private static void GradientsAreThoseOfFiniteDifferences()
        {
            Device device = Shared.Device;
            using (Scene scene = Shared.ThreeGaussians())
            using (Rasterizer rasterizer = Shared.SmallRasterizer(device, RasterizerFlags.Backward))
            using (Tensor means = scene.ToTensor("means", device))
            using (Tensor scales = scene.ToTensor("scales", device))
            using (Tensor rotations = scene.ToTensor("rotations", device))
            using (Tensor opacities = Tensor.From(device, new[] { 0.5f, 0.6f, 0.7f }, 3))
            using (Tensor sh = scene.ToTensor("sh", device))
            using (var gradRgb = new Tensor(device, new long[] { 1, 32, 48, 3 }))
            using (var gradOpacities = new Tensor(device, new long[] { 3 }))
            {
                gradRgb.Write(Enumerable.Repeat(1f, 32 * 48 * 3).ToArray());
                var gaussians = new Gaussians
                {
                    Means = means, Scales = scales, Rotations = rotations,
                    Opacities = opacities, Sh = sh,
                };
                Camera[] cameras = Shared.SmallCameras(scene);
                Func<float, double> sum = value =>
                {
                    opacities.Write(new[] { 0.5f, value, 0.7f });
                    rasterizer.Forward(gaussians, cameras, White);
                    return rasterizer.Read(Output.Rgb).Sum(v => (double)v);
                };
                double slope = (sum(0.61f) - sum(0.59f)) / 0.02;
                sum(0.6f);
                rasterizer.Backward(new RasterGradients { Rgb = gradRgb, Opacities = gradOpacities });
                float[] gradients = gradOpacities.ToArray();
                Expect.Near(slope, gradients[1], Math.Abs(slope) * 0.02);
                rasterizer.Backward(new RasterGradients
                {
                    Rgb = gradRgb, Opacities = gradOpacities, Flags = GradientFlags.Accumulate,
                });
                Expect.Near(2 * gradients[1], gradOpacities.ToArray()[1], Math.Abs(gradients[1]) * 1e-4);
            }
        }

        [Test]
        private static void SmallerViewsTilesAndWhatGaussiansAdd()
        {
            Device device = Shared.Device;
            const RasterizerFlags Flags = RasterizerFlags.GradIntrinsics | RasterizerFlags.Contributions |
                                          RasterizerFlags.Ids;
            using (Scene scene = Shared.ThreeGaussians())
            using (var rasterizer = new Rasterizer(device, new RasterizerOptions
            {
                Gaussians = 3, Width = 48, Height = 32, Flags = Flags, Convention = Convention.Gsplat,
            }))
            using (Tensor means = scene.ToTensor("means", device))
            using (Tensor scales = scene.ToTensor("scales", device))
            using (Tensor rotations = scene.ToTensor("rotations", device))
            using (Tensor opacities = Tensor.From(device, new[] { 0.5f, 0.6f, 0.7f }, 3))
            using (Tensor sh = scene.ToTensor("sh", device))
            using (var intrinsics = new Tensor(device, new long[] { 1, 4 }))
            using (var contributions = new Tensor(device, new long[] { 3, 2 }))
            {
                Camera[] cameras = { Shared.SmallCameras(scene)[0] };
                rasterizer.Forward(new Gaussians
                {
                    Means = means, Scales = scales, Rotations = rotations, Opacities = opacities, Sh = sh,
                    ActiveTiles = new byte[] { 1, 1, 0, 1, 1, 1 },
                }, cameras);
                float[] alpha = rasterizer.Read(Output.Alpha), ids = rasterizer.Read(Output.Ids);
                Expect.Equal(0f, alpha[47]);
                Expect.Equal(-1f, ids[47]);
                Expect.True(ids.Max() >= 0 && ids.Max() < 3, "numbers of Gaussians");
                rasterizer.Backward(new RasterGradients { Intrinsics = intrinsics, Contributions = contributions });
                Expect.Near(alpha.Sum(), contributions.ToArray().Where((v, i) => i % 2 == 0).Sum(), 0.01);
                rasterizer.Forward(scene, new[] { Camera.FromFov(20, 20, 1) }, White);
                Expect.Equal(0f, rasterizer.Read(Output.Rgb)[3 * 20]);
            }
        }

        [Test]
        private static void ViewsSeeRanges()
        {
            using (Scene scene = Shared.ThreeGaussians())
            using (var rasterizer = new Rasterizer(Shared.Device, new RasterizerOptions
            {
                Gaussians = 3, Width = 48, Height = 32, Views = 2, Items = 3, ShDegree = scene.ShDegree,
                Flags = RasterizerFlags.Ids,
            }))
            {
                Camera[] cameras = Shared.SmallCameras(scene, 2);
                rasterizer.Forward(new Gaussians { Scene = scene, ViewRanges = new uint[] { 1, 2, 0, 1 } },
                                   cameras, White);
                Expect.True(rasterizer.Info.Items == 3, "the sum of the ranges");
                Expect.True(rasterizer.Read(Output.Means2d).Length == 6, "the views' ranges");
                float[] ids = rasterizer.Read(Output.Ids);
                for (int i = 0; i < ids.Length; ++i)
                    Expect.True(i < 48 * 32 ? ids[i] != 0 : ids[i] < 1, "ids count from the first of the set");
                Expect.Refused(ResultCode.ErrorInvalidArgument, "view 0 sees Gaussians 2 to 4, but there are 3",
                               () => rasterizer.Forward(
                                   new Gaussians { Scene = scene, ViewRanges = new uint[] { 2, 2, 0, 1 } }, cameras));
            }
        }

        [Test]
        private static void RefusesBadInput()
        {
            Device device = Shared.Device;
            Expect.Throws<ArgumentNullException>(() => new Rasterizer(device, null));
            Expect.Throws<ArgumentNullException>(() => new Rasterizer(null, new RasterizerOptions()));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "0 x 4 pixels",
                           () => new Rasterizer(device, new RasterizerOptions { Height = 4 }));
            Expect.Throws<ArgumentOutOfRangeException>(
                () => new Rasterizer(device, new RasterizerOptions { Gaussians = -1, Width = 4,
                    Height = 4 }));
            using (Scene scene = Shared.ThreeGaussians())
            using (Rasterizer rasterizer = Shared.SmallRasterizer(device))
            using (var wrong = new Tensor(device, new long[] { 5 }))
            {
                Camera[] cameras = Shared.SmallCameras(scene);
                Expect.Refused(ResultCode.ErrorInvalidState, "drawn nothing: call Rasterizer.Forward first",
                               () => rasterizer.Read(Output.Rgb, new float[2 * 32 * 48 * 3]));
                Expect.Throws<ArgumentException>(() => rasterizer.Forward(scene, cameras, new float[2]));
                Expect.Throws<ArgumentNullException>(() => rasterizer.Forward((Scene)null, cameras));
                Expect.Throws<ArgumentNullException>(() => rasterizer.Forward(scene, new Camera[] { null }));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => rasterizer.Forward(
                    scene, new[] { Camera.FromFov(49, 9, 1) }));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "",
                               () => rasterizer.Forward(scene,
                                   new[] { cameras[0], cameras[0], cameras[0] }));
                Expect.Refused(ResultCode.ErrorShapeMismatch, "", () =>
                    rasterizer.Forward(new Gaussians
                {
                    Means = wrong, Scales = wrong, Rotations = wrong, Opacities = wrong, Sh = wrong,
                }, cameras));
                rasterizer.Forward(scene, cameras);
                Expect.Refused(ResultCode.ErrorInvalidArgument, "bytes",
                               () => rasterizer.Read(Output.Rgb, new float[7]));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => rasterizer.Read((Output)99));
                Expect.Refused(ResultCode.ErrorInvalidState, "'depth'", () => rasterizer.Read(Output.Depth));
                Expect.Refused(ResultCode.ErrorShapeMismatch, "", () => rasterizer.CopyTo(Output.Rgb, wrong));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => rasterizer.ReadImage(7));
                Expect.Refused(ResultCode.ErrorInvalidState, "", () => rasterizer.Backward(
                    new RasterGradients { Means = wrong }));
                using (Rasterizer other = Shared.SmallRasterizer(device))
                using (RasterizerState state = other.CreateState())
                    Expect.Refused(ResultCode.ErrorInvalidArgument, "",
                                   () => rasterizer.Forward(scene, cameras, null, state));
                wrong.Dispose();
                Expect.Throws<ObjectDisposedException>(() => rasterizer.CopyTo(Output.Rgb, wrong));
                Expect.Throws<ObjectDisposedException>(() => rasterizer.Forward(
                    new Gaussians { Means = wrong }, cameras));
            }
        }
    }
}
