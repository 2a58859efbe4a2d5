// The smoke program in C#; see README.md. Usage: Smoke.exe FOLDER

using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Runtime.InteropServices;
using System.Text;
using System.Threading;
using Splat;
using Splat.Interop;

internal static class Smoke
{
    private const int Count = 1000;

    private static int Main(string[] arguments)
    {
        Log.SetHandler((level, message) => Console.Error.WriteLine(level + ": " + message));
        try
        {
            Run(arguments[0]);
            return 0;
        }
        catch (Exception error)
        {
            Console.Error.WriteLine(error);
            return 1;
        }
    }

    private static void Run(string folder)
    {
        Library.Ensure();
        Print("version", "\"version\":\"" + Library.Version + "\",\"layout\":\"ok\"");
        byte[] names = Encoding.UTF8.GetBytes(PriorModel.Preset());
        Print("presets", "\"bytes\":" + names.Length + ",\"names\":" + Hash(names));
        var device = new Device();
        Print("device", "\"kind\":" + (int)device.Info.Kind);
        using (Scene scene = Formulas())
        {
            Render(device, scene);
            Gradient(device, scene);
            Prediction(device);
            Judge(scene);
            Maps();
            Data(folder);
            Errors();
            Cancel(device, folder);
            Busy(scene);
            Order(scene);
        }
        device.Dispose();
    }

    // ---- What all programs make alike ----

    private static Scene Formulas()
    {
        uint state = 1;
        Func<int> draw = () =>
        {
            state = unchecked(1664525 * state + 1013904223);
            return (int)(state >> 24);
        };
        float[] means = new float[3 * Count], logScales = new float[3 * Count], rotations = new float[4 * Count];
        float[] opacityLogits = new float[Count], sh = new float[12 * Count];
        for (int i = 0; i < Count; ++i)
        {
            for (int k = 0; k < 3; ++k) means[3 * i + k] = (draw() - 128) / 128f;
            for (int k = 0; k < 3; ++k) logScales[3 * i + k] = -3 - draw() / 128f;
            rotations[4 * i] = 1;
            for (int k = 1; k < 4; ++k) rotations[4 * i + k] = (draw() - 128) / 256f;
            opacityLogits[i] = (draw() - 128) / 32f;
            for (int k = 0; k < 12; ++k) sh[12 * i + k] = (draw() - 128) / 128f;
        }
        return new Scene(Count, 1, new SceneArrays
        {
            Means = means, LogScales = logScales, Rotations = rotations, OpacityLogits = opacityLogits, Sh = sh,
        });
    }

    private static readonly float[] White = { 1, 1, 1 };

    private static Camera[] Cameras(Scene scene)
    {
        return Camera.Orbit(scene, 2, new OrbitOptions { Width = 144, Height = 96,
            Elevation = 0.5 });
    }

    private static Rasterizer NewRasterizer(Device device)
    {
        return new Rasterizer(device, new RasterizerOptions
        {
            Gaussians = Count,
            Views = 2,
            Width = 144,
            Height = 96,
            ShDegree = 1,
            Flags = RasterizerFlags.Backward,
        });
    }

    private static Picture Disc()
    {
        return new Picture { Image = DiscImage() };
    }

    private static Image DiscImage()
    {
        var image = new Image(80, 64, 4);
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 80; ++x)
            {
                int at = 4 * (80 * y + x);
                int dx = 2 * x - 79;
                int dy = 2 * y - 63;
                image.Data[at] = unchecked((byte)(5 * x));
                image.Data[at + 1] = unchecked((byte)(7 * y));
                image.Data[at + 2] = unchecked((byte)(x * y));
                image.Data[at + 3] = (byte)(dx * dx + dy * dy < 2304 ? 255 : 0);
            }
        return image;
    }

    private static string Hash(ReadOnlySpan<byte> bytes)
    {
        ulong hash = 14695981039346656037;
        foreach (byte value in bytes) hash = unchecked((hash ^ value) * 1099511628211);
        return "\"" + hash.ToString("x16") + "\"";
    }

    private static string Hash(float[] values)
    {
        return Hash(MemoryMarshal.AsBytes(new ReadOnlySpan<float>(values)));
    }

    // ---- The cases ----

    private static void Render(Device device, Scene scene)
    {
        using (Rasterizer rasterizer = NewRasterizer(device))
        {
            rasterizer.Forward(scene, Cameras(scene), White);
            string rgb = Hash(rasterizer.Read(Output.Rgb));
            string rgba = Hash(rasterizer.ReadImage(1).Data);
            Print("render", "\"rgb\":" + rgb + ",\"rgba\":" + rgba);
        }
    }

    private static void Gradient(Device device, Scene scene)
    {
        var ones = new float[2 * 96 * 144 * 3];
        for (int i = 0; i < ones.Length; ++i) ones[i] = 1;
        using (Rasterizer rasterizer = NewRasterizer(device))
        using (Tensor means = scene.ToTensor("means", device))
        using (Tensor scales = scene.ToTensor("scales", device))
        using (Tensor rotations = scene.ToTensor("rotations", device))
        using (Tensor opacities = scene.ToTensor("opacities", device))
        using (Tensor sh = scene.ToTensor("sh", device))
        using (Tensor gradRgb = Tensor.From(device, ones, 2, 96, 144, 3))
        using (var gradMeans = new Tensor(device, new long[] { Count, 3 }))
        using (var gradOpacities = new Tensor(device, new long[] { Count }))
        {
            var gaussians = new Gaussians
            {
                Means = means,
                Scales = scales,
                Rotations = rotations,
                Opacities = opacities,
                Sh = sh,
            };
            rasterizer.Forward(gaussians, Cameras(scene), White);
            rasterizer.Backward(new RasterGradients
            {
                Rgb = gradRgb,
                Means = gradMeans,
                Opacities = gradOpacities,
            });
            Print("gradient", "\"means\":" + Hash(gradMeans.ToArray()) + ",\"opacities\":" +
                              Hash(gradOpacities.ToArray()));
        }
    }

    private static void Prediction(Device device)
    {
        using (var predictor = new Predictor(device))
        using (Prediction result = predictor.Predict(Disc()))
            Print("predict", "\"gaussians\":" + result.Gaussians + ",\"ply\":" +
                             Hash(result.Scene.ToBytes(SceneFormat.Ply)) + ",\"found\":" +
                             (int)result.Pictures[0].Found);
    }

    private static string Hash(params double[][] values)
    {
        var all = new List<double>();
        foreach (double[] some in values) all.AddRange(some);
        return Hash(MemoryMarshal.AsBytes(new ReadOnlySpan<double>(all.ToArray())));
    }

    /// <summary>48 x 48 pixels: the numbers of each, channels interleaved.</summary>
    private static float[] Map(Func<float, float, float[]> numbers)
    {
        var map = new List<float>();
        for (int y = 0; y < 48; ++y)
            for (int x = 0; x < 48; ++x)
                map.AddRange(numbers(((3 * x * y + x + 2 * y) % 64 + 1) / 64f,
                                     ((x * y + 3 * x + 5 * y) % 64 + 1) / 64f));
        return map.ToArray();
    }

    private static void Judge(Scene scene)
    {
        Image p = Image.FromFloats(48, 48, 1, Map((a, b) => new[] { a }));
        Image g = Image.FromFloats(48, 48, 1, Map((a, b) => new[] { b }));
        DepthScores d = Priors.CompareDepth(p, g);
        NormalScores n = Priors.CompareNormals(
            Image.FromFloats(48, 48, 3, Map((a, b) => new[] { a, b, 1 })),
            Image.FromFloats(48, 48, 3, Map((a, b) => new[] { b, a, 1 })));
        MaskScores m = Priors.CompareMasks(p, g);
        PointScores s = scene.ComparePoints(Map((a, b) => new[] { a, b, a - b }), 0.25, 0);
        Print("judge",
              "\"depth\":" + Hash(new[] { d.AbsRel, d.Rmse, d.SiRmse }, d.Within.ToArray(),
                                   new[] { d.Scale, d.Shift }) +
              ",\"normal\":" + Hash(new[] { n.Mean, n.Median, n.Rmse }, n.Within.ToArray()) +
              ",\"mask\":" + Hash(new[] { m.Mae, m.Iou, m.Precision, m.Recall, m.FBeta }) +
              ",\"fidelity\":" + Hash(new[] { Priors.CompareFidelity(p, g).Vif }) +
              ",\"edges\":" + Hash(Priors.FilterMap(g, MapFilter.Canny).ToFloats()) +
              ",\"points\":" + Hash(new[] { s.Accuracy, s.Completeness, s.Chamfer, s.ChamferSquared,
                                            s.Precision, s.Recall, s.FScore }));
    }

    private static void Maps()
    {
        Found found;
        Image mask = Priors.PictureMask(DiscImage(), out found);
        Image p = Image.FromFloats(48, 48, 1, Map((a, b) => new[] { a }));
        Print("maps", "\"found\":" + (int)found + ",\"mask\":" + Hash(mask.Data) + ",\"normal\":" +
                      Hash(Priors.NormalsFromDepth(p, 48, 1, 2).ToFloats()));
    }

    private static void Data(string folder)
    {
        string store = Path.Combine(folder, "store_csharp");
        using (var dataset = new Dataset(folder))
            for (int shard = 1; shard >= 0; --shard)
                dataset.Export(store, new ExportOptions
                {
                    Layout = "store",
                    Shards = 2,
                    Shard = shard,
                });
        using (var dataset = new Dataset(store))
            Print("data", "\"objects\":" + dataset.Count + ",\"rgb\":" +
                          Hash(dataset.Read(1, new[] { 0, 1, 2, 3 }).Images));
    }

    private static unsafe void Errors()
    {
        try
        {
            Device.Describe(9999);
        }
        catch (SplatException error)
        {
            Print("error", Of(error.Code) + ",\"message\":" + Quoted(error.Message));
        }
        // The classes refuse a disposed object themselves, so the library is asked below them.
        var scene = new Scene(1);
        var stale = new SafeSceneHandle(scene.Handle.DangerousGetHandle(), false);
        scene.Dispose();
        var info = new splat_scene_info { struct_size = (uint)sizeof(splat_scene_info) };
        Print("handle", Of(Native.splat_scene_get_info(stale, &info)));
    }

    private static void Cancel(Device device, string folder)
    {
        var options = new TrainingOptions
        {
            Config = File.ReadAllText(Path.Combine(folder, "config.json")),
            Values = new[] { "data.root='" + folder + "'" },
            Flags = TrainingFlags.Overwrite,
        };
        RunEvent last = null;
        using (var training = new Training(device, Path.Combine(folder, "run_csharp"), options))
        {
            bool asked = false;
            foreach (RunEvent next in training)
            {
                last = next;
                if (asked || next.Kind != RunEventKind.Step) continue;
                asked = true;
                var other = new Thread(training.Interrupt);
                other.Start();
                other.Join();
            }
        }
        ResultCode code = CancelPrediction(device);
        Print("cancel", "\"event\":" + (int)last.Kind + "," + Of(code));
    }

    private static ResultCode CancelPrediction(Device device)
    {
        bool done = false;
        var other = new Thread(() =>
        {
            while (!Volatile.Read(ref done))
            {
                device.Cancel();
                Thread.Sleep(1);
            }
        });
        using (var predictor = new Predictor(device))
        {
            other.Start();
            try
            {
                while (true) predictor.Predict(Disc()).Dispose();
            }
            catch (OperationCanceledException error)
            {
                return ((SplatException)error.InnerException).Code;
            }
            finally
            {
                Volatile.Write(ref done, true);
                other.Join();
            }
        }
    }

    private static void Busy(Scene source)
    {
        var device = new Device();
        var tensors = new List<Tensor>();
        for (int i = 0; i < 8; ++i) tensors.Add(new Tensor(device, new long[] { 64, 64 }));
        Scene scene = Formulas();
        Rasterizer rasterizer = NewRasterizer(device);
        rasterizer.Forward(scene, Cameras(source), White);
        var predictor = new Predictor(device);
        string ply = null;
        Exception failure = null;
        var started = new ManualResetEventSlim();
        var worker = new Thread(() =>
        {
            try
            {
                for (int i = 0; i < 4; ++i)
                {
                    started.Set();
                    using (Prediction result = predictor.Predict(Disc()))
                        ply = Hash(result.Scene.ToBytes(SceneFormat.Ply));
                }
            }
            catch (Exception error)
            {
                failure = error;
            }
        });
        worker.Start();
        started.Wait();
        device.Dispose();
        foreach (Tensor tensor in tensors) tensor.Dispose();
        scene.Dispose();
        rasterizer.Dispose();
        worker.Join();
        predictor.Dispose();
        if (failure != null) throw new InvalidOperationException("busy: a prediction failed",
            failure);
        Print("busy", "\"ply\":" + ply + ",\"result\":\"ok\"");
    }

    private static void Order(Scene source)
    {
        var third = new Device();
        DestroyChildren(third, source, false);
        long live = third.Memory.LiveBytes;
        third.Dispose();
        DestroyChildren(new Device(), source, true);
        Print("order", "\"live_bytes\":" + live + ",\"result\":\"ok\"");
    }

    private static void DestroyChildren(Device device, Scene source, bool deviceFirst)
    {
        var tensor = new Tensor(device, new long[] { 64, 64 });
        Rasterizer rasterizer = NewRasterizer(device);
        RasterizerState state = rasterizer.CreateState();
        Scene scene = Formulas();
        rasterizer.Forward(scene, Cameras(source), White, state);
        var predictor = new Predictor(device);
        predictor.Predict(Disc()).Dispose();
        if (deviceFirst)
        {
            device.Dispose();
            tensor.Write(new float[64 * 64]);
        }
        rasterizer.Dispose();
        predictor.Dispose();
        tensor.Dispose();
        scene.Dispose();
        state.Dispose();
    }

    // ---- Lines ----

    private static string Of(ResultCode code)
    {
        return "\"code\":" + (int)code + ",\"name\":\"" + Library.NameOf(code) + "\"";
    }

    private static string Quoted(string text)
    {
        var quoted = new StringBuilder("\"");
        foreach (char letter in text)
        {
            if (letter == '"' || letter == '\\') quoted.Append('\\');
            quoted.Append(letter);
        }
        return quoted.Append('"').ToString();
    }

    private static void Print(string name, string members)
    {
        Console.Out.Write("{\"case\":\"" + name + "\"," + members + "}\n");
    }
}
