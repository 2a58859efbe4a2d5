using System;
using System.Collections;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Runtime.InteropServices;
using Splat.Interop;

namespace Splat
{
    /// <summary>A tensor in memory, row-major.</summary>
    public sealed class NamedArray
    {
        /// <summary>Make one; the number of values is the product of dims.</summary>
        public NamedArray(string name, ReadOnlyMemory<float> values, params long[] dims)
        {
            Name = Check.NotNull(name, nameof(name));
            Dims = Check.Dims(dims, nameof(dims));
            Values = Dims.Contains(0) ? values : Check.NotNull(values, nameof(values));
        }

        /// <summary>Name of the tensor.</summary>
        public string Name { get; }
        /// <summary>Values, row-major.</summary>
        public ReadOnlyMemory<float> Values { get; }
        /// <summary>Shape, outermost first.</summary>
        public IReadOnlyList<long> Dims { get; }
        /// <summary>Name and shape.</summary>
        public override string ToString() => Name + " [" + string.Join(", ", Dims) + "]";
    }

    /// <summary>
    /// Named tensors of network weights in host memory, in the order of the file: a dictionary of what
    /// they are, and Read for their values. Never changes; thread-safe.
    /// </summary>
    public sealed unsafe class Weights : NativeObject<SafeWeightsHandle>, IReadOnlyDictionary<string, WeightsInfo>
    {
        internal Weights(IntPtr handle) : base(new SafeWeightsHandle(handle, true))
        {
        }

        /// <summary>
        /// Load a .safetensors, .pth or .npz file. Large .safetensors files stay open and mapped
        /// unless WeightsFlags.Copy is set: they must not be written in place meanwhile.
        /// </summary>
        public static Weights Load(string path, WeightsFlags flags = WeightsFlags.None)
        {
            using (var arena = new Arena())
            {
                IntPtr handle;
                byte* file = arena.Text(Beside(Check.NotNull(path, nameof(path))), nameof(path));
                Check.Ok(Native.splat_weights_load(file, flags, &handle));
                return new Weights(handle);
            }
        }

        /// <summary>Load the bytes of such a file.</summary>
        public static Weights FromBytes(ReadOnlySpan<byte> bytes)
        {
            Library.Ensure();
            IntPtr handle;
            fixed (byte* data = &MemoryMarshal.GetReference(bytes))
                Check.Ok(Native.splat_weights_load_memory(data, (UIntPtr)bytes.Length, &handle));
            return new Weights(handle);
        }

        /// <summary>Load the rest of a stream of such bytes.</summary>
        public static Weights FromStream(Stream stream) =>
            FromBytes(Splat.Values.ReadAll(stream, nameof(stream)));

        /// <summary>Make weights of copies of arrays, in their order.</summary>
        public static Weights FromArrays(IReadOnlyList<NamedArray> arrays)
        {
            Check.NotNull(arrays, nameof(arrays));
            using (var arena = new Arena())
            {
                var natives = new splat_named_array[arrays.Count];
                for (int i = 0; i < natives.Length; ++i)
                {
                    NamedArray array = Check.NotNull(arrays[i], "arrays[" + i + "]");
                    natives[i].name = arena.Text(array.Name, nameof(array.Name));
                    natives[i].values = (float*)arena.Pin(array.Values);
                    natives[i].value_count = (ulong)array.Values.Length;
                    natives[i].rank = (uint)array.Dims.Count;
                    fixed (long* dims = natives[i].dims)
                        for (int k = 0; k < array.Dims.Count; ++k) dims[k] = array.Dims[k];
                }
                IntPtr handle;
                Check.Ok(Native.splat_weights_from_arrays((splat_named_array*)arena.Pin(natives),
                                                          (ulong)natives.Length, &handle));
                return new Weights(handle);
            }
        }

        // Files that the package's targets copy beside the program (package/Libsplat.targets). The library looks near
        // itself only, and a program of a single file may unpack it somewhere else; the second folder is for that.
        internal static string? Beside(string? given)
        {
            string name = given ?? "cars64";
            bool isPath = name.Length == 0 || name.IndexOfAny(new[] { '/', '\\', ':', '.', '\0' }) >= 0;
            if (isPath || (given != null && (File.Exists(name) || Directory.Exists(name)))) return given;
            foreach (string? folder in new[]
            {
                AppContext.BaseDirectory,
#if NET8_0_OR_GREATER
                Path.GetDirectoryName(Environment.ProcessPath),
#endif
            })
            {
                string file = Path.Combine(folder ?? "", "libsplat", "weights", name, "weights.safetensors");
                if (File.Exists(file)) return file;
            }
            return given;
        }

        /// <summary>Path of weights that come with the library; null: those for cars.</summary>
        public static string BuiltinPath(string? name = null)
        {
            string? beside = Beside(name);
            if (beside != name && beside != null) return beside;
            using (var arena = new Arena())
            {
                byte* text = arena.Optional(name, nameof(name));
                return Text.Get((buffer, capacity, needed) =>
                    Native.splat_builtin_weights(text, buffer, capacity, needed));
            }
        }

        /// <summary>Number of tensors.</summary>
        public int Count
        {
            get
            {
                uint count;
                Check.Ok(Native.splat_weights_count(Handle, &count));
                return checked((int)count);
            }
        }

        /// <summary>Name, shape and type of a tensor, in the order of the file.</summary>
        public WeightsInfo this[int index]
        {
            get
            {
                SafeWeightsHandle handle = Handle;
                using (var arena = new Arena())
                {
                    arena.Hold(this);  // the name lives as long as the weights
                    var info = new splat_weights_info { struct_size = (uint)sizeof(splat_weights_info) };
                    Check.Ok(Native.splat_weights_get_info(
                        handle, Check.Unsigned(index, nameof(index)), &info));
                    return new WeightsInfo(&info);
                }
            }
        }

        /// <summary>The same by the name; throws KeyNotFoundException.</summary>
        public WeightsInfo this[string key] =>
            TryGetValue(key, out WeightsInfo? value) ? value
                : throw new KeyNotFoundException("there is no tensor '" + key + "' among " + Count);

        /// <summary>What the tensor of that name is, if it is there.</summary>
        public bool TryGetValue(string key,
#if NET8_0_OR_GREATER
            [System.Diagnostics.CodeAnalysis.MaybeNullWhen(false)]
#endif
            out WeightsInfo value)
        {
            Check.NotNull(key, nameof(key));
            value = null;
            try
            {
                using (var arena = new Arena())
                {
                    uint index;
                    ResultCode code = Native.splat_weights_find(Handle, arena.Text(key, nameof(key)), &index);
                    if (code == ResultCode.ErrorNotFound) return false;
                    Check.Ok(code);
                    value = this[(int)index];
                    return true;
                }
            }
            catch (ArgumentException)  // a NUL or half of a surrogate pair: no name has them
            {
                return false;
            }
        }

        /// <summary>Whether there is a tensor of that name.</summary>
        public bool ContainsKey(string key) => TryGetValue(key, out _);

        /// <summary>Names of the tensors.</summary>
        public IEnumerable<string> Keys => Values.Select(info => info.Name);

        /// <summary>What the tensors are.</summary>
        public IEnumerable<WeightsInfo> Values => Enumerable.Range(0, Count).Select(i => this[i]);

        /// <summary>Names with what the tensors are.</summary>
        public IEnumerator<KeyValuePair<string, WeightsInfo>> GetEnumerator() =>
            Values.Select(info => new KeyValuePair<string, WeightsInfo>(info.Name, info)).GetEnumerator();

        IEnumerator IEnumerable.GetEnumerator() => GetEnumerator();

        internal override string About => Count + " tensors";

        /// <summary>Number of a tensor by its name; throws ResultCode.ErrorNotFound.</summary>
        public int IndexOf(string name)
        {
            using (var arena = new Arena())
            {
                uint index;
                Check.Ok(Native.splat_weights_find(Handle, arena.Text(name, nameof(name)), &index));
                return (int)index;
            }
        }

        /// <summary>The values of a tensor in a new array.</summary>
        public float[] Read(int index)
        {
            float[] values = Splat.Values.New<float>("the values", this[index].Elements);
            Read(index, values);
            return values;
        }

        /// <summary>The values of the tensor of that name in a new array.</summary>
        public float[] Read(string name) => Read(IndexOf(name));

        /// <summary>Copy the values of a tensor into memory of the caller.</summary>
        public void Read(int index, Span<float> values)
        {
            fixed (float* to = &MemoryMarshal.GetReference(values))
            {
                float none;
                Check.Ok(Native.splat_weights_read(
                    Handle, Check.Unsigned(index, nameof(index)), to == null ? &none : to,
                    (UIntPtr)((long)values.Length * sizeof(float))));
            }
        }

        /// <summary>Write .safetensors or .npz, whole or not at all.</summary>
        public void Save(string path, WeightsFlags flags = WeightsFlags.None)
        {
            using (var arena = new Arena())
                Check.Ok(Native.splat_weights_save(Handle, arena.Text(path, nameof(path)), flags));
        }

        /// <summary>The bytes of such a file.</summary>
        public byte[] ToBytes(WeightsFormat format = WeightsFormat.Safetensors,
                              WeightsFlags flags = WeightsFlags.None) =>
            Text.GetBytes((buffer, capacity, needed) =>
                Native.splat_weights_save_memory(Handle, format, flags, buffer, capacity, needed));

        /// <summary>JSON: format, metadata, warnings, published configurations that fit.</summary>
        public string ReportJson() => Text.Get(Handle, Native.splat_weights_report);

        /// <summary>
        /// Fold low-rank adapters into new weights; null: those among these weights.
        /// FoldFlags.Out takes folded ones out again.
        /// </summary>
        public Weights Fold(double alpha, Weights? adapters = null, FoldFlags flags = FoldFlags.None)
        {
            IntPtr folded;
            Check.Ok(Native.splat_weights_fold(
                Handle, adapters == null ? SafeWeightsHandle.Null : adapters.Handle, alpha, flags,
                &folded));
            return new Weights(folded);
        }
    }
}
