using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using Splat.Interop;

namespace Splat
{
    /// <summary>Works on elements in place, see Tensor.Map.</summary>
    public delegate void SpanAction<T>(Span<T> values) where T : struct;

    /// <summary>Memory of a device, as one API or process gives it to another.</summary>
    public sealed unsafe class ExternalMemory
    {
        internal splat_external_memory Raw;

        /// <summary>Describe memory; see the properties.</summary>
        public ExternalMemory(long handle, ulong memoryBytes, ulong offset = 0, uint memoryType = 0)
        {
            Raw.struct_size = (uint)sizeof(splat_external_memory);
            Raw.handle = handle;
            Raw.memory_bytes = memoryBytes;
            Raw.offset = offset;
            Raw.memory_type = memoryType;
        }

        internal ExternalMemory(splat_external_memory raw)
        {
            Raw = raw;
        }

        /// <summary>A file descriptor; on Windows (never tried) an NT handle.</summary>
        public long Handle => Raw.handle;

        /// <summary>Bytes of the whole allocation.</summary>
        public ulong MemoryBytes => Raw.memory_bytes;

        /// <summary>Bytes from its start to the first element.</summary>
        public ulong Offset => Raw.offset;

        /// <summary>1 + Vulkan's index of its type of memory; 0: not known.</summary>
        public uint MemoryType => Raw.memory_type;
    }

    /// <summary>An array of numbers on a device, row-major. Thread-safe.</summary>
    public sealed unsafe class Tensor : NativeObject<SafeTensorHandle>
    {
        /// <summary>Create a tensor of zeros.</summary>
        /// <param name="device">where</param>
        /// <param name="dims">elements, outermost first; none for a scalar</param>
        /// <param name="type">DType.Default is DType.F32</param>
        /// <param name="name">for messages; may be null</param>
        /// <param name="exportable">in an allocation of its own, for Export</param>
        public Tensor(Device device, long[] dims, DType type = DType.Default, string? name = null,
                      bool exportable = false)
            : base(Create(device, dims, type, name, null, 0, exportable))
        {
        }

        internal Tensor(IntPtr handle) : base(new SafeTensorHandle(handle, true))
        {
        }

        private Tensor(SafeTensorHandle handle) : base(handle)
        {
        }

        /// <summary>
        /// Create a tensor of float, int or uint values, whose number is the product of dims.
        /// </summary>
        public static Tensor From<T>(Device device, ReadOnlySpan<T> values, params long[] dims)
            where T : struct
        {
            DType type = TypeOf<T>();
            ReadOnlySpan<byte> bytes = MemoryMarshal.AsBytes(values);
            fixed (byte* data = &MemoryMarshal.GetReference(bytes))
            {
                byte none;  // a pointer for no bytes, so that the library names the sizes
                return new Tensor(Create(device, dims, type, null, data == null ? &none : data,
                                         bytes.Length));
            }
        }

        /// <summary>Create a tensor of an array; see the other overload.</summary>
        public static Tensor From<T>(Device device, T[] values, params long[] dims) where T : struct
        {
            return From(device, new ReadOnlySpan<T>(Check.NotNull(values, nameof(values))), dims);
        }

        /// <summary>
        /// Create a tensor in memory that Export, another process or another API exported on the same
        /// device and driver. The handle stays the caller's. A wrong MemoryBytes may be undefined. What
        /// others do there must have ended before a call uses the tensor.
        /// </summary>
        public static Tensor Import(Device device, ExternalMemory memory, long[] dims,
                                    DType type = DType.Default, string? name = null)
        {
            Check.NotNull(memory, nameof(memory));
            splat_external_memory raw = memory.Raw;
            return new Tensor(Create(device, dims, type, name, null, 0, false, &raw));
        }

        /// <summary>
        /// A handle of the memory of an exportable tensor, which the caller closes. It and all who opened
        /// it keep the memory alive. Calls have ended on the device when they return.
        /// </summary>
        public ExternalMemory Export()
        {
            var raw = new splat_external_memory
            {
                struct_size = (uint)sizeof(splat_external_memory)
            };
            Check.Ok(Native.splat_tensor_export(Handle, &raw));
            return new ExternalMemory(raw);
        }

        private static SafeTensorHandle Create(Device device, long[] dims, DType type, string? name,
                                           void* data, int bytes, bool exportable = false,
                                           splat_external_memory* memory = null)
        {
            Check.NotNull(device, nameof(device));
            Check.Dims(dims, nameof(dims));
            using (var arena = new Arena())
            {
                var desc = new splat_tensor_desc
                {
                    struct_size = (uint)sizeof(splat_tensor_desc),
                    flags = exportable ? TensorFlags.Exportable : 0,
                    name = arena.Optional(name, nameof(name)),
                    dtype = type,
                    rank = (uint)dims.Length,
                };
                for (int i = 0; i < dims.Length; ++i) desc.dims[i] = dims[i];
                IntPtr handle;
                Check.Ok(memory != null
                    ? Native.splat_tensor_import(device.Handle, &desc, memory, &handle)
                    : data == null
                    ? Native.splat_tensor_create(device.Handle, &desc, &handle)
                    : Native.splat_tensor_from_host(device.Handle, &desc, data, (UIntPtr)bytes,
                                                    null, &handle));
                return new SafeTensorHandle(handle, true);
            }
        }

        /// <summary>Shape, type, name and size.</summary>
        public TensorInfo Info
        {
            get
            {
                var info = new splat_tensor_info { struct_size = (uint)sizeof(splat_tensor_info) };
                Check.Ok(Native.splat_tensor_get_info(Handle, &info));
                return new TensorInfo(&info);
            }
        }

        /// <summary>Elements, outermost first.</summary>
        public IReadOnlyList<long> Dims => Info.Dims;

        internal override string About
        {
            get
            {
                TensorInfo info = Info;
                return (info.Dtype + " [" + string.Join(", ", info.Dims) + "] " + info.Name).TrimEnd();
            }
        }

        /// <summary>Write all elements.</summary>
        /// <param name="values">float, int or uint, as the tensor's type</param>
        /// <param name="strides">
        /// elements of `values` between neighbours, one per dimension; 0 repeats; null: row-major
        /// </param>
        public void Write<T>(ReadOnlySpan<T> values, long[]? strides = null) where T : struct
        {
            CheckCall<T>(strides);
            ReadOnlySpan<byte> bytes = MemoryMarshal.AsBytes(values);
            fixed (byte* data = &MemoryMarshal.GetReference(bytes))
            fixed (long* steps = strides)
                Check.Ok(Native.splat_tensor_write(Handle, data, (UIntPtr)bytes.Length, steps));
        }

        /// <summary>Write all elements from an array.</summary>
        public void Write<T>(T[] values, long[]? strides = null) where T : struct
        {
            Write(new ReadOnlySpan<T>(Check.NotNull(values, nameof(values))), strides);
        }

        /// <summary>Read all elements into memory of the caller; see Write.</summary>
        public void Read<T>(Span<T> values, long[]? strides = null) where T : struct
        {
            CheckCall<T>(strides);
            Span<byte> bytes = MemoryMarshal.AsBytes(values);
            fixed (byte* data = &MemoryMarshal.GetReference(bytes))
            fixed (long* steps = strides)
                Check.Ok(Native.splat_tensor_read(Handle, data, (UIntPtr)bytes.Length, steps));
        }

        /// <summary>Read all elements into an array.</summary>
        public void Read<T>(T[] values, long[]? strides = null) where T : struct
        {
            Read(new Span<T>(Check.NotNull(values, nameof(values))), strides);
        }

        /// <summary>All elements, row-major, in a new array of float, int or uint.</summary>
        public T[] ToArray<T>() where T : struct
        {
            T[] values = Values.New<T>("the elements", Info.Elements);
            Read(values);
            return values;
        }

        /// <summary>All elements of a DType.F32 tensor.</summary>
        public float[] ToArray() => ToArray<float>();

        /// <summary>Least, greatest and mean value, and counts of values that are not finite.</summary>
        public TensorStats Stats()
        {
            var stats = new splat_tensor_stats { struct_size = (uint)sizeof(splat_tensor_stats) };
            Check.Ok(Native.splat_tensor_check(Handle, &stats));
            return new TensorStats(&stats);
        }

        /// <summary>
        /// Let `action` read or write all elements in place, without a copy on devices with
        /// FeatureFlags.UnifiedMemory. With Access.Write they are undefined until written. No other
        /// call may use the tensor meanwhile. An exception of `action` ends the mapping and passes.
        /// </summary>
        public void Map<T>(Access access, SpanAction<T> action) where T : struct
        {
            Check.NotNull(action, nameof(action));
            CheckCall<T>(null);
            SafeTensorHandle handle = Handle;
            using (var arena = new Arena())
            {
                arena.Hold(this);  // the memory lives until the mapping ends
                void* pointer;
                UIntPtr bytes;
                Check.Ok(Native.splat_tensor_map(handle, access, &pointer, &bytes));
                try
                {
                    if (bytes.ToUInt64() / 4 > int.MaxValue)
                        throw new NotSupportedException("a Span holds at most 2^31 - 1 elements");
                    action(new Span<T>(pointer, (int)(bytes.ToUInt64() / 4)));
                }
                finally
                {
                    Check.Ok(Native.splat_tensor_unmap(handle));
                }
            }
        }

        private void CheckCall<T>(long[]? strides)
        {
            DType given = TypeOf<T>();
            TensorInfo info = Info;
            if (given != info.Dtype)
                throw Check.Bad("values of type " + typeof(T).Name + " (" + given +
                                ") for a tensor of " + info.Dtype, "values");
            if (strides != null && strides.Length != info.Rank)
                throw Check.Bad(strides.Length + " strides for a tensor of rank " +
                                info.Rank, nameof(strides));
        }

        private static DType TypeOf<T>()
        {
            if (typeof(T) == typeof(float)) return DType.F32;
            if (typeof(T) == typeof(int)) return DType.I32;
            if (typeof(T) == typeof(uint)) return DType.U32;
            throw Check.Bad("tensors hold float, int or uint, not " + typeof(T).Name, "values");
        }
    }
}
