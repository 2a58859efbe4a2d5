using System;
using System.Linq;
using System.Threading;

namespace Splat.Tests
{
    internal static class DeviceTests
    {
        [Test]
        private static void ListsAndDescribes()
        {
            DeviceInfo first = Device.All[0];
            Expect.Equal(0, first.Index);
            Expect.Equal(16, first.Uuid.Count);
            Expect.True(first.Name.Length > 0 && first.HeapBytes > 0, "name and heap");
            DeviceInfo open = Shared.Device.Info;
            Expect.True(open.Usable && open.Reason == "", "a usable device without a reason");
            Expect.True(open.Kernels != Kernels.Auto, "the kernels that it runs");
        }

        [Test]
        private static void OpensByIndexUuidAndKind()
        {
            DeviceInfo info = Shared.Device.Info;
            var choices = new[]
            {
                new DeviceOptions { Select = DeviceSelect.ByIndex, Index = info.Index },
                new DeviceOptions { Select = DeviceSelect.ByUuid, Uuid = info.Uuid },
                new DeviceOptions { Select = DeviceSelect.ByKind, Kind = info.Kind },
            };
            foreach (DeviceOptions options in choices)
            {
                options.CacheFolder = "";
                options.Timeout = TimeSpan.FromSeconds(90);
                options.MaxSubmit = TimeSpan.FromMilliseconds(50);
                options.MaxDeviceBytes = 1 << 28;
                using (var device = new Device(options))
                {
                    Expect.Equal(info.Name, device.Info.Name);
                    Expect.Equal(1L << 28, device.Memory.BudgetBytes);
                }
            }
        }

        [Test]
        private static void RefusesBadOptions()
        {
            Expect.Refused(ResultCode.ErrorInvalidArgument, "9999", () => Device.Describe(9999));
            Expect.Throws<ArgumentOutOfRangeException>(() => Device.Describe(-1));
            Expect.Refused(ResultCode.ErrorNoDevice, "", () => new Device(
                new DeviceOptions { Select = DeviceSelect.ByIndex, Index = 77 }));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "kernels",
                           () => new Device(new DeviceOptions { Kernels = (Kernels)99 }));
            Expect.Throws<ArgumentException>(() => new Device(new DeviceOptions { Uuid = new byte[3] }));
            Expect.Throws<ArgumentOutOfRangeException>(
                () => new Device(new DeviceOptions { MaxDeviceBytes = -1 }));
            Expect.Throws<ArgumentOutOfRangeException>(
                () => new Device(new DeviceOptions { Timeout = TimeSpan.FromTicks(-1) }));
            Expect.Throws<ArgumentOutOfRangeException>(
                () => new Device(new DeviceOptions { MaxSubmit = TimeSpan.FromTicks(-1) }));
            Expect.Throws<ArgumentException>(() => new Device(new DeviceOptions { CacheFolder = "a\0b" }));
            Expect.Throws<ArgumentException>(() => new Device(new DeviceOptions { CacheFolder = "\ud800" }));
        }

        [Test]
        private static void BudgetIsAnErrorWithItsCode()
        {
            using (var device = new Device(new DeviceOptions { MaxDeviceBytes = 1 << 20 }))
                Expect.Refused(ResultCode.ErrorOutOfDeviceMemory, "budget",
                               () => new Tensor(device, new long[] { 1 << 22 }));
        }

        [Test]
        private static void ProfilesDispatches()
        {
            Expect.Refused(ResultCode.ErrorInvalidState, "DeviceFlags.Profile", () =>
                Shared.Device.ProfileJson());
            using (var device = new Device(new DeviceOptions { Flags = DeviceFlags.Profile }))
            using (Tensor tensor = Tensor.From(device, new float[] { 1, 2 }, 2))
            {
                tensor.Stats();
                Expect.Contains("tensor_stats", device.ProfileJson());
                Expect.Contains("tensor_stats", device.ProfileTable());
                device.ResetProfile();
                Expect.True(!device.ProfileJson().Contains("tensor_stats"), "times are forgotten");
            }
        }

        [Test]
        private static void DisposedDeviceIsRefused()
        {
            var device = new Device();
            device.Dispose();
            device.Dispose();
            Expect.True(device.IsDisposed, "disposed");
            Expect.Contains("Splat.Device", Expect.Throws<ObjectDisposedException>(
                () => GC.KeepAlive(device.Info)).ObjectName);
            Expect.Throws<ObjectDisposedException>(device.Cancel);
            Expect.Throws<ObjectDisposedException>(() => device.ProfileJson());
            Expect.Throws<ObjectDisposedException>(() => new Tensor(device, new long[] { 1 }));
            Expect.Throws<ObjectDisposedException>(() => new Predictor(device));
        }

        [Test]
        private static void ErrorsOfThreadsStayApart()
        {
            string[] texts = Enumerable.Range(1000, 8).AsParallel().WithDegreeOfParallelism(8)
                .Select(i => Expect.Throws<SplatException>(() =>
                    Device.Describe(i)).Message).ToArray();
            for (int i = 0; i < texts.Length; ++i)
                Expect.Contains("is " + (1000 + i), string.Join(";", texts));
        }

        [Test]
        private static void DestroyedHandleIsAnErrorOfTheLibrary()
        {
            var device = new Device();
            var stale = new Splat.Interop.SafeDeviceHandle(device.Handle.DangerousGetHandle(), false);
            device.Dispose();
            Expect.Equal(ResultCode.ErrorInvalidHandle, Splat.Interop.Native.splat_device_cancel(stale));
        }
    }
}
