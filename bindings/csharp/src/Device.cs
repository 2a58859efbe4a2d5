using System;
using System.Collections.Generic;
using System.Linq;
using System.Threading.Tasks;
using Splat.Interop;

namespace Splat
{
    /// <summary>How to choose and open a device. The defaults open the best one.</summary>
    public sealed class DeviceOptions
    {
        /// <summary>Which device; BySomething takes the property of that name.</summary>
        public DeviceSelect Select { get; set; }
        /// <summary>Position in Device.All.</summary>
        public int Index { get; set; }
        /// <summary>CPU, integrated, discrete, ...</summary>
        public DeviceKind Kind { get; set; }
        /// <summary>16 bytes of DeviceInfo.Uuid.</summary>
        public IReadOnlyList<byte>? Uuid { get; set; }
        /// <summary>Which shaders to run.</summary>
        public Kernels Kernels { get; set; }
        /// <summary>Validation, times of dispatches.</summary>
        public DeviceFlags Flags { get; set; }
        /// <summary>Budget of device memory; 0: the device's heap.</summary>
        public long MaxDeviceBytes { get; set; }
        /// <summary>Longest wait for one piece of work; zero: 60 s.</summary>
        public TimeSpan Timeout { get; set; }
        /// <summary>Longest time of a piece of work, by the times of those before; zero: 0.1 s, on CPU devices
        /// 0.25 s.</summary>
        public TimeSpan MaxSubmit { get; set; }
        /// <summary>Folder of the pipeline cache; null: the user's, "": none.</summary>
        public string? CacheFolder { get; set; }
    }

    /// <summary>An open Vulkan device. Thread-safe: calls that use it run one after the other.</summary>
    public sealed unsafe class Device : NativeObject<SafeDeviceHandle>
    {
        /// <summary>Open a device; null: the best one.</summary>
        public Device(DeviceOptions? options = null) : base(Create(options ?? new DeviceOptions()))
        {
        }

        private static SafeDeviceHandle Create(DeviceOptions options)
        {
            using (var arena = new Arena())
            {
                byte[] uuid = options.Uuid?.ToArray() ?? new byte[16];
                Check.Numbers<byte>(uuid, 16, nameof(options.Uuid));
                var desc = new splat_device_desc
                {
                    struct_size = (uint)sizeof(splat_device_desc),
                    flags = options.Flags,
                    select = options.Select,
                    index = Check.Unsigned(options.Index, nameof(options.Index)),
                    kind = options.Kind,
                    kernels = options.Kernels,
                    max_device_bytes = Check.Unsigned(options.MaxDeviceBytes, nameof(options.MaxDeviceBytes)),
                    timeout_ns = Nanoseconds(options.Timeout, nameof(options.Timeout)),
                    max_submit_ns = Nanoseconds(options.MaxSubmit, nameof(options.MaxSubmit)),
                    cache_folder = arena.Optional(options.CacheFolder, nameof(options.CacheFolder)),
                };
                for (int i = 0; i < 16; ++i) desc.uuid[i] = uuid[i];
                IntPtr handle;
                Check.Ok(Native.splat_device_create(&desc, &handle));
                return new SafeDeviceHandle(handle, true);
            }
        }

        private static ulong Nanoseconds(TimeSpan time, string name) =>
            100 * Math.Min(Check.Unsigned(time.Ticks, name), ulong.MaxValue / 100);

        /// <summary>Open a device on another thread, which takes seconds at a program's first time.</summary>
        public static Task<Device> OpenAsync(DeviceOptions? options = null) => Task.Run(() => new Device(options));

        /// <summary>All Vulkan devices of this machine, usable or not.</summary>
        public static IReadOnlyList<DeviceInfo> All
        {
            get
            {
                Library.Ensure();
                uint count;
                Check.Ok(Native.splat_device_count(&count));
                var all = new DeviceInfo[count];
                for (int i = 0; i < all.Length; ++i) all[i] = Describe(i);
                return all;
            }
        }

        /// <summary>Describe a device by its number, without opening it.</summary>
        public static DeviceInfo Describe(int index)
        {
            Library.Ensure();
            var info = new splat_device_info { struct_size = (uint)sizeof(splat_device_info) };
            Check.Ok(Native.splat_device_describe(Check.Unsigned(index, nameof(index)), &info));
            return new DeviceInfo(&info);
        }

        /// <summary>What this device is, and which shaders it runs.</summary>
        public DeviceInfo Info
        {
            get
            {
                var info = new splat_device_info { struct_size = (uint)sizeof(splat_device_info) };
                Check.Ok(Native.splat_device_get_info(Handle, &info));
                return new DeviceInfo(&info);
            }
        }

        internal override string About => Info.Name;

        /// <summary>Device memory in use, and its highest value.</summary>
        public MemoryInfo Memory
        {
            get
            {
                var info = new splat_memory_info { struct_size = (uint)sizeof(splat_memory_info) };
                Check.Ok(Native.splat_device_get_memory(Handle, &info));
                return new MemoryInfo(&info);
            }
        }

        /// <summary>
        /// Cancel all calls that run on this device or wait for it now, on any thread: each throws
        /// OperationCanceledException. Later calls are not affected. A CancellationToken of one
        /// call does the same, so it ends calls of other threads on this device too.
        /// </summary>
        public void Cancel() => Check.Ok(Native.splat_device_cancel(Handle));

        /// <summary>Times of every kind of dispatch as JSON; needs DeviceFlags.Profile.</summary>
        public string ProfileJson() => Text.Get(Handle, Native.splat_device_profile_json);

        /// <summary>The same as a table for people.</summary>
        public string ProfileTable() => Text.Get(Handle, Native.splat_device_profile_table);

        /// <summary>Forget the times measured so far.</summary>
        public void ResetProfile() => Check.Ok(Native.splat_device_profile_reset(Handle));
    }
}
