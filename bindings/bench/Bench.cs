// What a call costs in C#; README.md describes the three measurements. Argument: a scene.

using System;
using System.Diagnostics;
using System.Globalization;
using Splat;

internal static class Bench
{
    private const int Rounds = 40;
    private const int Calls = 10000;
    private const int Side = 1024;
    private const int Width = 144;
    private const int Height = 240;

    /// <summary>"NAME":[shortest, median] of the rounds in ms, times a factor, after two that do
    /// not count.</summary>
    private static string Measure(string name, Action<int> call, double factor)
    {
        var times = new double[Rounds];
        call(0);
        call(1);
        for (int i = 0; i < Rounds; ++i)
        {
            long start = Stopwatch.GetTimestamp();
            call(i);
            times[i] = (Stopwatch.GetTimestamp() - start) * 1e3 / Stopwatch.Frequency * factor;
        }
        Array.Sort(times);
        return string.Format(CultureInfo.InvariantCulture, ",\"{0}\":[{1:F3},{2:F3}]", name,
            times[0], times[Rounds / 2]);
    }

    private static void Main(string[] arguments)
    {
        using (var device = new Device())
        using (var tensor = new Tensor(device, new long[] { Side, Side }))
        using (Scene scene = Scene.Load(arguments[0]))
        using (var rasterizer = new Rasterizer(device, new RasterizerOptions
        {
            Gaussians = scene.Info.Count,
            Width = Width,
            Height = Height,
        }))
        {
            var numbers = new float[Side * Side];
            var pixels = new float[Width * Height * 3];
            Camera[] cameras = Camera.Orbit(scene, 2, new OrbitOptions { Width = Width,
                Height = Height });
            string line = "{\"language\":\"C#\"";
            line += Measure("getter_ns", round =>
            {
                for (int i = 0; i < Calls; ++i) GC.KeepAlive(tensor.Info);
            }, 1e6 / Calls);
            line += Measure("read_ms", round => tensor.Read(numbers), 1);
            line += Measure("render_ms", round =>
            {
                // The cameras take turns: an unchanged view is not drawn again.
                rasterizer.Forward(scene, new[] { cameras[round % 2] });
                rasterizer.Read(Output.Rgb, pixels);
            }, 1);
            Console.WriteLine(line + "}");
        }
    }
}
