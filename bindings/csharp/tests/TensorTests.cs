using System;
using System.Linq;

namespace Splat.Tests
{
    internal static class TensorTests
    {
        [Test]
        private static void HoldsFloatsIntsAndUints()
        {
            using (Tensor f = Tensor.From(Shared.Device, new float[] { 1, 2, 3, 4, 5, 6 }, 2, 3))
            using (Tensor i = Tensor.From(Shared.Device, new[] { -1, 2 }, 2))
            using (Tensor u = Tensor.From(Shared.Device, new[] { 4000000000u }))
            {
                Expect.Same(new float[] { 1, 2, 3, 4, 5, 6 }, f.ToArray());
                Expect.Same(new long[] { 2, 3 }, f.Dims);
                Expect.Same(new[] { -1, 2 }, i.ToArray<int>());
                Expect.Same(new[] { 4000000000u }, u.ToArray<uint>());
                Expect.Equal(0, u.Dims.Count);
                Expect.Equal(DType.I32, i.Info.Dtype);
                Expect.Equal(24L, f.Info.Bytes);
            }
        }

        [Test]
        private static void IsZeroAtFirstAndHasItsName()
        {
            using (var tensor = new Tensor(Shared.Device, new long[] { 3 }, DType.F32, "größe"))
            {
                Expect.Same(new float[3], tensor.ToArray());
                Expect.Equal("größe", tensor.Info.Name);
            }
        }

        [Test]
        private static void ExportedMemoryOutlivesItsTensor()
        {
            var dims = new long[] { 3 };
            if ((Shared.Device.Info.Features & FeatureFlags.ExternalMemory) == 0)
            {
                Expect.Refused(ResultCode.ErrorUnsupported, "copy the elements",
                               () => new Tensor(Shared.Device, dims, exportable: true));
                return;
            }
            ExternalMemory memory;
            using (var tensor = new Tensor(Shared.Device, dims, exportable: true))
            {
                tensor.Write(new float[] { 1, 2, 3 });
                memory = tensor.Export();
            }
            using (Tensor imported = Tensor.Import(Shared.Device, memory, dims))
            {
                using (new Microsoft.Win32.SafeHandles.SafeFileHandle((IntPtr)memory.Handle, true))
                {
                }
                Expect.Same(new float[] { 1, 2, 3 }, imported.ToArray());
                Expect.Refused(ResultCode.ErrorInvalidState, "imported", () => imported.Export());
            }
            Expect.Refused(ResultCode.ErrorInvalidArgument, "no open file descriptor",
                           () => Tensor.Import(Shared.Device, new ExternalMemory(-1, 64), dims));
        }

        [Test]
        private static void ReadsAndWritesWithStridesAndSpans()
        {
            using (Tensor tensor = Tensor.From(Shared.Device, new float[] { 1, 2, 3, 4, 5, 6 }, 2,
                3))
            {
                var turned = new float[6];
                tensor.Read(turned, new long[] { 1, 2 });
                Expect.Same(new float[] { 1, 4, 2, 5, 3, 6 }, turned);
                tensor.Write(new float[] { 7, 8, 9 }, new long[] { 0, 1 });
                Expect.Same(new float[] { 7, 8, 9, 7, 8, 9 }, tensor.ToArray());
                var longer = new float[8];
                tensor.Read(longer.AsSpan(1, 6));
                Expect.Same(new float[] { 0, 7, 8, 9, 7, 8, 9, 0 }, longer);
                tensor.Write(new ReadOnlySpan<float>(longer, 2, 6));
                Expect.Same(new float[] { 8, 9, 7, 8, 9, 0 }, tensor.ToArray());
            }
        }

        [Test]
        private static void MeasuresItself()
        {
            using (Tensor tensor = Tensor.From(Shared.Device,
                new[] { 1, float.NaN, 3, float.PositiveInfinity }, 4))
            {
                TensorStats stats = tensor.Stats();
                Expect.Equal(1L, stats.NanCount);
                Expect.Equal(1L, stats.InfCount);
                Expect.Equal(1.0, stats.Min);
                Expect.Equal(3.0, stats.Max);
                Expect.Equal(2.0, stats.Mean);
            }
        }

        [Test]
        private static void MapsItsElements()
        {
            using (Tensor tensor = Tensor.From(Shared.Device, new float[] { 1, 2, 3 }, 3))
            {
                tensor.Map<float>(Access.ReadWrite, values =>
                {
                    Expect.Equal(2f, values[1]);
                    values[1] = 5;
                    Expect.Refused(ResultCode.ErrorInvalidState, "mapped", () => tensor.ToArray());
                });
                Expect.Same(new float[] { 1, 5, 3 }, tensor.ToArray());
                Expect.Throws<FormatException>(() => tensor.Map<float>(
                    Access.Read, values => { throw new FormatException(); }));
                Expect.Same(new float[] { 1, 5, 3 }, tensor.ToArray());
                Expect.Throws<ArgumentException>(() => tensor.Map<int>(Access.Read, values => { }));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "access",
                               () => tensor.Map<float>((Access)9, values => { }));
                tensor.Map<float>(Access.Read, values =>
                {
                    tensor.Dispose();  // the memory stays until the mapping ends
                    Expect.Throws<ObjectDisposedException>(() => GC.KeepAlive(tensor.Info));
                    Expect.Equal(5f, values[1]);
                });
                Expect.Throws<ObjectDisposedException>(() => tensor.Map<float>(Access.Read, values => { }));
            }
        }

        [Test]
        private static void RefusesBadInput()
        {
            Device device = Shared.Device;
            Expect.Throws<ArgumentNullException>(() => new Tensor(null, new long[] { 1 }));
            Expect.Throws<ArgumentNullException>(() => new Tensor(device, null));
            Expect.Throws<ArgumentNullException>(() => Tensor.From(device, (float[])null, 1));
            Expect.Throws<ArgumentException>(() => new Tensor(device, new long[9]));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => new Tensor(device, new long[] { 0 }));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => new Tensor(device, new long[] { -4 }));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "",
                           () => new Tensor(device, new long[] { 1L << 40 }));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "dtype",
                           () => new Tensor(device, new long[] { 1 }, (DType)44));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "bytes",
                           () => Tensor.From(device, new float[3], 4));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "bytes",
                           () => Tensor.From(device, new float[0], 4));
            Expect.Contains("Double", Expect.Throws<ArgumentException>(
                () => Tensor.From(device, new double[] { 1 }, 1)).Message);
        }

        [Test]
        private static void RefusesShortArraysAndWrongTypes()
        {
            using (var tensor = new Tensor(Shared.Device, new long[] { 2, 2 }))
            {
                var two = new float[2];
                Expect.Refused(ResultCode.ErrorInvalidArgument, "bytes", () => tensor.Read(two));
                Expect.Same(new float[2], two);
                Expect.Refused(ResultCode.ErrorInvalidArgument, "bytes", () => tensor.Write(two));
                Expect.Throws<ArgumentException>(() => tensor.Write(new int[4]));
                Expect.Throws<ArgumentException>(() => tensor.ToArray<uint>());
                Expect.Throws<ArgumentException>(() => tensor.Write(new float[4], new long[1]));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "stride",
                               () => tensor.Write(new float[4], new long[] { -2, 1 }));
                Expect.Throws<ArgumentNullException>(() => tensor.Read((float[])null));
                tensor.Dispose();
                Expect.Throws<ObjectDisposedException>(() => tensor.ToArray());
                Expect.Throws<ObjectDisposedException>(() => tensor.Write(new float[4]));
            }
        }
    }
}
