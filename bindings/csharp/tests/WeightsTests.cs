using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;

namespace Splat.Tests
{
    internal static class WeightsTests
    {
        private static Weights Two()
        {
            return Weights.FromArrays(new[]
            {
                new NamedArray("a", new float[] { 1, 2, 3, 4, 5, 6 }, 2, 3),
                new NamedArray("scalar", new float[] { 7 }),
            });
        }

        [Test]
        private static void HoldTheirArrays()
        {
            using (Weights weights = Two())
            {
                Expect.Equal(2, weights.Count);
                Expect.Equal("a", weights[0].Name);
                Expect.Same(new long[] { 2, 3 }, weights[0].Dims);
                Expect.Equal("float32", weights[1].Dtype);
                Expect.Same(new float[] { 1, 2, 3, 4, 5, 6 }, weights.Read("a"));
                Expect.Same(new float[] { 7 }, weights.Read(weights.IndexOf("scalar")));
            }
            using (Weights none = Weights.FromArrays(new NamedArray[0])) Expect.Equal(0, none.Count);
        }

        [Test]
        private static void AreADictionary()
        {
            using (Weights weights = Two())
            {
                IReadOnlyDictionary<string, WeightsInfo> all = weights;
                Expect.Same(new[] { "a", "scalar" }, all.Keys);
                Expect.Same(new long[] { 6, 1 }, all.Values.Select(info => info.Elements));
                Expect.Same(all.Keys, all.Select(pair => pair.Key));
                Expect.Equal(weights[0], all["a"]);
                Expect.True(all.TryGetValue("scalar", out WeightsInfo scalar) && scalar.Rank == 0, "a scalar");
                foreach (string name in new[] { "zz", "a\0b", "\ud800", "" })
                {
                    Expect.True(!all.ContainsKey(name), "nothing of that name");
                    Expect.Throws<KeyNotFoundException>(() => GC.KeepAlive(all[name]));
                }
                Expect.Contains("'zz' among 2", Expect.Throws<KeyNotFoundException>(
                    () => GC.KeepAlive(all["zz"])).Message);
                Expect.Throws<ArgumentNullException>(() => all.ContainsKey(null));
                weights.Dispose();
                Expect.Throws<ObjectDisposedException>(() => all.ContainsKey("a"));
                Expect.Throws<ObjectDisposedException>(() => all.Keys.ToArray());
            }
        }

        [Test]
        private static void FilesAndBytesKeepThem()
        {
            using (Weights weights = Two())
            {
                string path = Shared.PathOf("w.safetensors");
                weights.Save(path);
                Expect.Same(File.ReadAllBytes(path), weights.ToBytes());
                using (Weights loaded = Weights.Load(path, WeightsFlags.Copy))
                using (Weights parsed = Weights.FromBytes(weights.ToBytes(WeightsFormat.Npz)))
                using (Weights half = Weights.FromBytes(
                           weights.ToBytes(WeightsFormat.Safetensors, WeightsFlags.Half)))
                {
                    Expect.Same(weights.Read("a"), loaded.Read("a"));
                    Expect.Same(weights.Read("a"), parsed.Read("a"));
                    Expect.Equal("float16", half[0].Dtype);
                    Expect.Contains("safetensors", loaded.ReportJson());
                }
            }
        }

        [Test]
        private static void BuiltinOnesLoad()
        {
            using (Weights weights = Weights.Load(Weights.BuiltinPath()))
                Expect.True(weights.Count > 10, "tensors");
            Expect.Refused(ResultCode.ErrorNotFound, "cars64", () => Weights.BuiltinPath("planes"));
        }

        [Test]
        private static void FoldsAdapters()
        {
            using (Weights plain = Weights.FromArrays(new[]
                   {
                       new NamedArray("l.weight", new float[] { 1, 2, 3, 4 }, 2, 2),
                       new NamedArray("l.lora_A", new float[] { 1, 1 }, 1, 2),
                       new NamedArray("l.lora_B", new float[] { 1, 2 }, 2, 1),
                   }))
            using (Weights folded = plain.Fold(1))
            {
                Expect.Same(new float[] { 2, 3, 5, 6 }, folded.Read("l.weight"));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => folded.Fold(1));
                using (Weights back = folded.Fold(1, plain, FoldFlags.Out))
                    Expect.Same(new float[] { 1, 2, 3, 4 }, back.Read("l.weight"));
            }
        }

        [Test]
        private static void RefuseBadInput()
        {
            Expect.Throws<ArgumentNullException>(() => new NamedArray("a", null));
            Expect.Equal(0, new NamedArray("a", ReadOnlyMemory<float>.Empty, 0, 3).Values.Length);
            Expect.Throws<ArgumentException>(() => new NamedArray("a", new float[1], new long[9]));
            Expect.Refused(ResultCode.ErrorShapeMismatch, "a", () => Weights.FromArrays(
                new[] { new NamedArray("a", new float[5], 2, 3) }));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "a", () => Weights.FromArrays(
                new[] { new NamedArray("a", new float[1], 1),
                    new NamedArray("a", new float[1], 1) }));
            Expect.Throws<ArgumentNullException>(() => Weights.FromArrays(new NamedArray[1]));
            Expect.Refused(ResultCode.ErrorFormat, "", () => Weights.FromBytes(new byte[] { 1, 2, 3 }));
            using (Weights weights = Two())
            {
                Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => weights.Read(2));
                Expect.Refused(ResultCode.ErrorNotFound, "b", () => weights.Read("b"));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "bytes", () => weights.Read(0, new float[5]));
                Expect.Refused(ResultCode.ErrorUnsupported, ".pth", () =>
                    weights.Save(Shared.PathOf("w.bin")));
                weights.Dispose();
                Expect.Throws<ObjectDisposedException>(() => GC.KeepAlive(weights[0]));
                Expect.Throws<ObjectDisposedException>(() => weights.ToBytes());
            }
        }
    }
}
