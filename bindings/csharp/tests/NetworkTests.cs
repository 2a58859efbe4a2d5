using System;
using System.Collections.Generic;
using System.Linq;

namespace Splat.Tests
{
    internal static class OperatorTests
    {
        [Test]
        private static void ComputesForwardAndBackward()
        {
            Device device = Shared.Device;
            using (Tensor x = Tensor.From(device, new float[] { -1, 2 }, 1, 2))
            using (var y = new Tensor(device, new long[] { 1, 2 }))
            using (Tensor gradY = Tensor.From(device, new float[] { 3, 5 }, 1, 2))
            using (var gradX = new Tensor(device, new long[] { 1, 2 }))
            using (var relu = new Operator(device, new OperatorOptions
                   {
                       Type = "relu",
                       Inputs = new[] { x },
                       Outputs = new[] { y },
                       GradOutputs = new[] { gradY },
                       GradInputs = new[] { gradX },
                   }))
            {
                relu.Forward();
                Expect.Same(new float[] { 0, 2 }, y.ToArray());
                relu.Backward();
                Expect.Same(new float[] { 0, 5 }, gradX.ToArray());
                x.Dispose();  // the operator keeps it
                relu.Forward();
                relu.Dispose();
                Expect.Throws<ObjectDisposedException>(() => relu.Forward());
            }
            Expect.Contains("\"relu\"", Operator.ListJson());
        }

        [Test]
        private static void RefusesBadInput()
        {
            Device device = Shared.Device;
            using (var two = new Tensor(device, new long[] { 2 }))
            using (var three = new Tensor(device, new long[] { 3 }))
            {
                Expect.Refused(ResultCode.ErrorInvalidArgument, "rely", () => new Operator(
                    device, new OperatorOptions { Type = "rely" }));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "type",
                               () => new Operator(device, new OperatorOptions()));
                Expect.Refused(ResultCode.ErrorShapeMismatch, "", () => new Operator(
                    device, new OperatorOptions { Type = "relu", Inputs = new[] { two },
                        Outputs = new[] { three } }));
                Expect.Throws<ArgumentException>(() => new Operator(device, new OperatorOptions
                    { Type = "relu", Inputs = new[] { two }, Outputs = new[] { two },
                        GradInputs = new Tensor[0] }));
                using (var other = new Device())
                using (var foreign = new Tensor(other, new long[] { 2 }))
                    Expect.Refused(ResultCode.ErrorInvalidArgument, "device", () => new Operator(
                        device, new OperatorOptions { Type = "relu", Inputs = new[] { two },
                            Outputs = new[] { foreign } }));
            }
        }
    }

    internal static class ModuleTests
    {
        internal static Module Linear()
        {
            return new Module(Shared.Device, new ModuleOptions
            {
                Type = "linear",
                Flags = ModuleFlags.Gradients | ModuleFlags.InputGradients,
                Ports = new[] { new Port("x", 2, 3), new Port("weight", 1, 3),
                    new Port("bias", 1) },
            });
        }

        [Test]
        private static void ComputesForwardAndBackward()
        {
            using (Module module = Linear())
            {
                module.Init(1);
                Expect.True(module.Read("weight").Any(v => v != 0), "random weights");
                module.Write("weight", new float[] { 1, 2, 3 });
                module.Write("bias", new float[] { 10 });
                module.Write("x", new float[] { 1, 1, 1, 0, 0, 2 });
                module.Forward();
                Expect.Same(new float[] { 16, 16 }, module.Read("y"));
                module.Write("grad:y", new float[] { 1, 2 });
                module.Backward();
                Expect.Same(new float[] { 1, 1, 5 }, module.Read("grad:weight"));
                Expect.Same(new float[] { 1, 2, 3, 2, 4, 6 }, module.Read("grad:x"));
                module.ZeroGradients();
                Expect.Same(new float[3], module.Read("grad:weight"));
                Expect.Same(new[] { "weight", "bias" }, module.Ports(PortKind.Parameter).Select(p => p.Name));
                Expect.Contains("\"linear\"", module.ReportJson());
            }
        }

        [Test]
        private static void RefusesBadInput()
        {
            Expect.Refused(ResultCode.ErrorShapeMismatch, "weight", () => new Module(
                Shared.Device, new ModuleOptions { Type = "linear",
                    Ports = new[] { new Port("x", 2, 3) } }));
            Expect.Throws<ArgumentException>(() => new Port("x", new long[9]));
            using (Module module = Linear())
            {
                Expect.Refused(ResultCode.ErrorShapeMismatch, "", () => module.Write("x", new float[5]));
                Expect.Refused(ResultCode.ErrorNotFound, "z", () => module.Write("z", new float[5]));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "",
                               () => module.Write("weight", new[] { 1, float.NaN, 0 }));
                Expect.Refused(ResultCode.ErrorInvalidState, "", () => module.Read("y"));
                Expect.Refused(ResultCode.ErrorInvalidState, "", () => module.Backward());
                Expect.Refused(ResultCode.ErrorInvalidArgument, "kind", () => module.Ports((PortKind)9));
                module.Dispose();
                Expect.Throws<ObjectDisposedException>(() => module.Ports(PortKind.Input));
            }
        }
    }

    internal static class ModelTests
    {
        internal const string Tiny =
            "{\"model\": {\"base_dim\": 8, \"num_blocks\": 1, \"channel_mult\": [1, 2], " +
            "\"attention_resolutions\": [8]}, \"data\": {\"training_resolution\": 16}, " +
            "\"opt\": {\"batch_size\": 1, \"imgs_per_obj\": 2}}";

        private static Model New(ModelFlags flags = ModelFlags.None)
        {
            var model = new Model(Shared.Device, new ModelOptions { Config = Tiny, Flags = flags });
            model.Init(7);
            return model;
        }

        private static float[] Pixels()
        {
            return Enumerable.Range(0, 3 * 16 * 16).Select(i => i % 17 / 17f).ToArray();
        }

        [Test]
        private static void PredictsAndReads()
        {
            using (Model model = New())
            {
                ModelInfo info = model.Info;
                Expect.Equal(16, info.Resolution);
                Expect.Equal(256, info.Gaussians);
                model.Forward(new ModelInput { Images = Pixels() });
                float[] means = model.Read("means");
                Expect.Equal(256 * 3, means.Length);
                using (Tensor tensor = model.Tensor("means")) Expect.Same(means, tensor.ToArray());
                using (Scene scene = model.ToScene())
                    Expect.True(scene.Count <= 256, "Gaussians of the object");
                var planes = Image.FromFloats(16, 16, 3, Pixels());
                planes.RowStride = 4 * 16;
                planes.PixelStride = 4;
                planes.ChannelStride = 4 * 256;
                model.Forward(new ModelInput { Pictures = new[] { planes } });
                Expect.Same(means, model.Read("means"));
                Expect.True(model.Ports(PortKind.Parameter).Count > 10, "parameters");
                Expect.Contains("\"parameters\"", model.ReportJson());
            }
        }

        [Test]
        private static void KeepsItsWeights()
        {
            using (Model first = New())
            using (Model second = New())
            using (Weights weights = first.Store())
            {
                Port port = first.Ports(PortKind.Parameter)[0];
                second.Write(port.Name, new float[port.Elements]);
                Expect.Same(new float[port.Elements], second.Read(port.Name));
                second.Load(weights);
                Expect.Same(first.Read(port.Name), second.Read(port.Name));
                Expect.Refused(ResultCode.ErrorInvalidState, "", () => first.Export(ModelExport.Adapters));
            }
        }

        [Test]
        private static void RowsMoveWithTheirMoments()
        {
            using (Tensor means = Tensor.From(Shared.Device, new[] { 0f, 1, 2, 3, 4, 5 }, 3, 2))
            using (Tensor grads = Tensor.From(Shared.Device, new float[6], 3, 2))
            using (var optimizer = new Optimizer(
                       Shared.Device, new[] { new OptimizerItem("set.means", means, grads) }))
            {
                optimizer.GatherRows("set.*", new long[] { 2, 0 });
                Expect.Same(new[] { 4f, 5, 0, 1 }, means.ToArray().Take(4).ToArray());
                Expect.Equal(4L, optimizer.Info.Elements);
                Expect.Refused(ResultCode.ErrorInvalidArgument, "rows[0] is 2", () =>
                    optimizer.GatherRows("*", new long[] { 2 }));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "", () =>
                    optimizer.GatherRows("*", new long[0]));
            }
        }

        [Test]
        private static void GradientsTrainIt()
        {
            using (Model model = New(ModelFlags.Gradients))
            using (var optimizer = new Optimizer(
                       Shared.Device, new[] { new OptimizerItem(model) },
                       new OptimizerOptions
                       {
                           Rate = 1e-3, EmaDecay = 0.9,
                           Groups = new[] { new OptimizerGroup 
                               { Pattern = "*.bias", RateFactor = 0.5 } },
                       }))
            {
                var ones = Enumerable.Repeat(1f, 256 * 3).ToArray();
                Func<double> sum = () =>
                {
                    model.Forward(new ModelInput { Images = Pixels() });
                    return model.Read("means").Sum(v => (double)v);
                };
                double before = sum();
                for (int i = 0; i < 3; ++i)
                {
                    optimizer.ZeroGradients();
                    sum();
                    model.Backward(new ModelGradients { Means = ones });
                    OptimizerInfo info = optimizer.Step();
                    Expect.Equal(i + 1L, info.Step);
                    Expect.True(!info.WasSkipped, "an update");
                }
                Expect.True(sum() < before, "a smaller sum");
                using (Weights averages = optimizer.Store())
                using (Weights state = optimizer.Save())
                {
                    Expect.True(averages.Count > 10 && state.Count > 10, "averages and moments");
                    optimizer.SetRate(0.5);
                    optimizer.Load(state);
                    Expect.Near(1e-3, optimizer.Info.Rate, 1e-12);
                    Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => optimizer.Load(averages));
                }
            }
        }

        [Test]
        private static void RefusesBadInput()
        {
            Expect.Refused(ResultCode.ErrorInvalidArgument, "base_dim", () => new Model(
                Shared.Device, new ModelOptions { Config = "model: {base_dimm: 8}" }));
            using (Model model = New())
            {
                Expect.Refused(ResultCode.ErrorShapeMismatch, "images",
                               () => model.Forward(new ModelInput { Images = new float[10] }));
                Expect.Throws<ArgumentException>(() =>
                    model.Forward(new ModelInput { Images = new float[0] }));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => model.Forward(new ModelInput()));
                Expect.Refused(ResultCode.ErrorInvalidState, "", () => model.Backward(new ModelGradients()));
                Expect.Refused(ResultCode.ErrorNotFound, "meens", () => model.Read("meens"));
                Expect.Refused(ResultCode.ErrorInvalidState, "", () => model.Read("means"));
                Expect.Refused(ResultCode.ErrorNotFound, "none", () => model.Write("none", new float[1]));
                Expect.Throws<ArgumentNullException>(() => model.Load(null));
                Expect.Refused(ResultCode.ErrorInvalidState, "gradient", () => new Optimizer(
                    Shared.Device, new[] { new OptimizerItem(model) }));
                model.Dispose();
                Expect.Throws<ObjectDisposedException>(() =>
                    model.Forward(new ModelInput { Images = Pixels() }));
                Expect.Throws<ObjectDisposedException>(
                    () => new Optimizer(Shared.Device, new[] { new OptimizerItem(model) }));
            }
        }
    }

    internal static class OptimizerTests
    {
        [Test]
        private static void MovesATensorAgainstItsGradient()
        {
            Device device = Shared.Device;
            using (Tensor value = Tensor.From(device, new float[] { 1, -1 }, 2))
            using (Tensor gradient = Tensor.From(device, new float[] { 2, -3 }, 2))
            using (var optimizer = new Optimizer(device,
                new[] { new OptimizerItem("v", value, gradient) },
                                                 new OptimizerOptions { Rate = 0.1 }))
            {
                Expect.Equal(2L, optimizer.Step().Elements);
                float[] moved = value.ToArray();
                Expect.Near(0.9, moved[0], 1e-5);
                Expect.Near(-0.9, moved[1], 1e-5);
                gradient.Write(new[] { float.NaN, 0 });
                Expect.True(optimizer.Step().WasSkipped, "no update by NaN");
                Expect.Same(moved, value.ToArray());
            }
        }

        [Test]
        private static void RefusesBadInput()
        {
            Device device = Shared.Device;
            using (var two = new Tensor(device, new long[] { 2 }))
            using (var three = new Tensor(device, new long[] { 3 }))
            using (var other = new Tensor(device, new long[] { 3 }))
            {
                Expect.Throws<ArgumentNullException>(() => new OptimizerItem("v", two, null));
                Expect.Refused(ResultCode.ErrorShapeMismatch, "gradient", () => new Optimizer(
                    device, new[] { new OptimizerItem("v", two, three) }));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "",
                               () => new Optimizer(device, new OptimizerItem[0]));
                Expect.Throws<ArgumentNullException>(() => new Optimizer(device, new OptimizerItem[1]));
                Expect.Throws<ArgumentOutOfRangeException>(() => new Optimizer(
                    device, new[] { new OptimizerItem("v", two, two) },
                        new OptimizerOptions { EmaEvery = -1 }));
                using (var optimizer = new Optimizer(device,
                    new[] { new OptimizerItem("v", three, other) }))
                {
                    Expect.Refused(ResultCode.ErrorInvalidArgument, "rate", () => optimizer.SetRate(-1));
                    optimizer.Dispose();
                    Expect.Throws<ObjectDisposedException>(() => optimizer.Step());
                }
            }
        }
    }

    internal static class LpipsTests
    {
        /// <summary>VGG16 with constant weights that keep activations in range.</summary>
        private static Weights Network()
        {
            var arrays = new List<NamedArray>();
            int[] layers = { 0, 2, 5, 7, 10, 12, 14, 17, 19, 21, 24, 26, 28 };
            int[] outputs = { 64, 64, 128, 128, 256, 256, 256, 512, 512, 512, 512, 512, 512 };
            int from = 3;
            for (int i = 0; i < layers.Length; ++i)
            {
                var weight = new float[outputs[i] * from * 9];
                for (int k = 0; k < weight.Length; ++k)
                    weight[k] = (k * 7 % 13 - 6) * 0.3f / (float)Math.Sqrt(from * 9);
                string name = "features." + layers[i];
                int to = outputs[i];
                arrays.Add(new NamedArray(name + ".weight", weight, to, from, 3, 3));
                arrays.Add(new NamedArray(name + ".bias", new float[to], to));
                from = outputs[i];
            }
            int[] channels = { 64, 128, 256, 512, 512 };
            for (int i = 0; i < 5; ++i)
                arrays.Add(new NamedArray("lin" + i + ".model.1.weight",
                                          Enumerable.Repeat(0.5f, channels[i]).ToArray(),
                                          1, channels[i], 1, 1));
            return Weights.FromArrays(arrays);
        }

        private static Image Pattern(int period)
        {
            return Image.FromFloats(16, 16, 3, Enumerable.Range(0, 3 * 16 * 16)
                .Select(i => i % period / (float)period).ToArray());
        }

        [Test]
        private static void MeasuresADistance()
        {
            Image a = Pattern(11), b = Pattern(7);
            using (Weights weights = Network())
            using (var lpips = new Lpips(Shared.Device, new[] { weights }, 16))
            {
                Expect.Equal(0.0, lpips.Compare(a, a));
                Expect.True(lpips.Compare(a, b) > 0, "a distance of different images");
                Expect.Refused(ResultCode.ErrorShapeMismatch, "16 x 15",
                               () => lpips.Compare(a, new Image(16, 15, 3, Pixel.F32)));
                lpips.Dispose();
                Expect.Throws<ObjectDisposedException>(() => lpips.Compare(a, b));
            }
        }

        [Test]
        private static void RefusesOtherWeights()
        {
            var array = new NamedArray("a", new float[1], 1);
            using (Weights weights = Weights.FromArrays(new[] { array }))
                Expect.Refused(ResultCode.ErrorInvalidArgument, "",
                               () => new Lpips(Shared.Device, new[] { weights }, 16));
            Expect.Throws<ArgumentNullException>(() => new Lpips(Shared.Device, null, 16));
        }
    }
}
