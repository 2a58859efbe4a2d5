using System;
using System.Collections.Generic;
using System.IO;
using System.Runtime.InteropServices;
using System.Threading;
using System.Threading.Tasks;
using Splat.Interop;

namespace Splat
{
    /// <summary>Arrays of a new scene of n Gaussians, row-major; null, as ReadOnlyMemory.Empty: zeros.</summary>
    public sealed class SceneArrays
    {
        /// <summary>[n,3] scene units; x right, y down, z forward.</summary>
        public ReadOnlyMemory<float> Means { get; set; }
        /// <summary>[n,3] logarithms of the standard deviations.</summary>
        public ReadOnlyMemory<float> LogScales { get; set; }
        /// <summary>[n,4] quaternions w, x, y, z; null: no rotation.</summary>
        public ReadOnlyMemory<float> Rotations { get; set; }
        /// <summary>[n] logits of the opacities.</summary>
        public ReadOnlyMemory<float> OpacityLogits { get; set; }
        /// <summary>[n,(degree+1)^2,3] spherical harmonics, the constant term first.</summary>
        public ReadOnlyMemory<float> Sh { get; set; }
        /// <summary>What a file would say of drawing the scene.</summary>
        public DrawnFlags DrawnAs { get; set; }
    }

    /// <summary>How to read or write a file of a scene; the defaults fit most files.</summary>
    public sealed class SceneFileOptions
    {
        /// <summary>Default: by the first bytes, else by the extension of the path.</summary>
        public SceneFormat Format { get; set; }
        /// <summary>Axes of the file; Default: the format's usual ones.</summary>
        public Frame Frame { get; set; }
        /// <summary>Degree to change to, 0 to 3; null: keep all bands.</summary>
        public int? ShDegree { get; set; }
        /// <summary>To write: 3 or 4; 0: 3.</summary>
        public int SpzVersion { get; set; }
        /// <summary>Refuse files with more Gaussians; 0: 2^27.</summary>
        public long MaxCount { get; set; }
        /// <summary>To read: leave out bytes after the rows that a .ply header counts, with a warning.</summary>
        public bool Lenient { get; set; }
        /// <summary>Write scales that .spz does not hold as the nearest, instead of refusing
        /// scenes with more than 1 % of them.</summary>
        public bool Clamp { get; set; }

        internal unsafe splat_scene_file_desc ToNative()
        {
            return new splat_scene_file_desc
            {
                struct_size = (uint)sizeof(splat_scene_file_desc),
                flags = (Lenient ? SceneFlags.Lenient : 0) | (Clamp ? SceneFlags.Clamp : 0),
                format = Format,
                frame = Frame,
                sh_degree = ShDegree == 0 ? Native.SPLAT_SH_CONSTANT : ShDegree ?? 0,
                spz_version = Check.Unsigned(SpzVersion, nameof(SpzVersion)),
                max_count = Check.Unsigned(MaxCount, nameof(MaxCount)),
            };
        }
    }

    /// <summary>x -> Scale * Rotation x + Translation.</summary>
    public sealed class Similarity
    {
        /// <summary>Quaternion w, x, y, z of any length above 0.</summary>
        public double[] Rotation { get; set; } = { 1, 0, 0, 0 };
        /// <summary>Scene units.</summary>
        public double[] Translation { get; set; } = { 0, 0, 0 };
        /// <summary>Above 0.</summary>
        public double Scale { get; set; } = 1;
    }

    /// <summary>
    /// A set of 3D Gaussians in host memory; needs no device. Thread-safe.
    /// Attributes, float: "means" [n,3], "log_scales" or "scales" [n,3], "rotations" [n,4],
    /// "opacity_logits" or "opacities" [n], "sh" [n,(degree+1)^2,3].
    /// </summary>
    public sealed unsafe class Scene : NativeObject<SafeSceneHandle>
    {
        /// <summary>Create a scene of `count` Gaussians; null arrays are zeros.</summary>
        public Scene(long count, int shDegree = 0, SceneArrays? arrays = null)
            : base(Create(count, shDegree, arrays ?? new SceneArrays()))
        {
        }

        internal Scene(IntPtr handle) : base(new SafeSceneHandle(handle, true))
        {
        }

        private static SafeSceneHandle Create(long count, int shDegree, SceneArrays arrays)
        {
            using (var arena = new Arena())
            {
                var desc = new splat_scene_desc
                {
                    struct_size = (uint)sizeof(splat_scene_desc),
                    count = Check.Unsigned(count, nameof(count)),
                    sh_degree = Check.Unsigned(shDegree, nameof(shDegree)),
                    drawn_as = arrays.DrawnAs,
                    means = Take(arena, arrays.Means, count, 3, nameof(arrays.Means)),
                    log_scales = Take(arena, arrays.LogScales, count, 3, nameof(arrays.LogScales)),
                    rotations = Take(arena, arrays.Rotations, count, 4, nameof(arrays.Rotations)),
                    opacity_logits = Take(arena, arrays.OpacityLogits, count, 1, nameof(arrays.OpacityLogits)),
                    sh = Take(arena, arrays.Sh, count, Width("sh", shDegree), nameof(arrays.Sh)),
                };
                IntPtr handle;
                Check.Ok(Native.splat_scene_create(&desc, &handle));
                return new SafeSceneHandle(handle, true);
            }
        }

        // The library takes longer arrays; here that is a mistake of the caller.
        private static float* Take(Arena arena, ReadOnlyMemory<float> values, long count, int width, string name)
        {
            if (!values.Equals(default(ReadOnlyMemory<float>)) && values.Length != (decimal)count * width)
                throw Check.Bad(
                    name + " has " + values.Length + " numbers instead of " + (decimal)count * width, "arrays");
            return (float*)arena.Pin(values);
        }

        /// <summary>Read a file of any format of <c>SceneFormat</c>.</summary>
        public static Scene Load(string path, SceneFileOptions? options = null)
        {
            using (var arena = new Arena())
            {
                splat_scene_file_desc desc = (options ?? new SceneFileOptions()).ToNative();
                IntPtr handle;
                Check.Ok(Native.splat_scene_load(arena.Text(path, nameof(path)), &desc, &handle));
                return new Scene(handle);
            }
        }

        /// <summary>Number of Gaussians of a file and degree of their harmonics, from its head, to
        /// decide whether to load it.</summary>
        public static (long Count, int ShDegree) Peek(string path, SceneFileOptions? options = null)
        {
            using (var arena = new Arena())
            {
                splat_scene_file_desc desc = (options ?? new SceneFileOptions()).ToNative();
                ulong count;
                uint degree;
                Check.Ok(Native.splat_scene_peek(arena.Text(path, nameof(path)), &desc, &count, &degree));
                return (checked((long)count), (int)degree);
            }
        }

        /// <summary>Read the bytes of such a file.</summary>
        public static Scene FromBytes(ReadOnlySpan<byte> bytes, SceneFileOptions? options = null)
        {
            Library.Ensure();
            splat_scene_file_desc desc = (options ?? new SceneFileOptions()).ToNative();
            IntPtr handle;
            fixed (byte* data = &MemoryMarshal.GetReference(bytes))
                Check.Ok(Native.splat_scene_load_memory(data, (UIntPtr)bytes.Length, &desc, &handle));
            return new Scene(handle);
        }

        /// <summary>Read the rest of a stream of such bytes.</summary>
        public static Scene FromStream(Stream stream, SceneFileOptions? options = null) =>
            FromBytes(Values.ReadAll(stream, nameof(stream)), options);

        /// <summary>Concatenate scenes into a new one, with the highest of their degrees.</summary>
        public static Scene Merge(params Scene[] scenes)
        {
            Check.NotNull(scenes, nameof(scenes));
            using (var arena = new Arena())
            {
                IntPtr handle;
                Check.Ok(Native.splat_scene_merge(arena.HoldAll(scenes, nameof(scenes)), (uint)scenes.Length,
                                                  &handle));
                return new Scene(handle);
            }
        }

        /// <summary>The Gaussians from number `start` on, `count` of them, as a new scene. Reads all attributes
        /// whole, one after another: no other thread may change the scene meanwhile.</summary>
        public Scene Slice(long start, long count)
        {
            Size(out long all, out int degree);
            Check.Within(start, 0, all, nameof(start));
            Check.Within(count, 0, all - start, nameof(count));
            Func<string, ReadOnlyMemory<float>> part = name =>
            {
                int width = Width(name, degree);
                return Read(name).AsMemory((int)start * width, (int)count * width);
            };
            return new Scene(count, degree, new SceneArrays
            {
                Means = part("means"), LogScales = part("log_scales"), Rotations = part("rotations"),
                OpacityLogits = part("opacity_logits"), Sh = part("sh"),
            });
        }

        /// <summary>An equal scene, whose changes leave this one alone.</summary>
        public Scene Copy() => Slice(0, Count);

        internal override string About => Count + " Gaussians of degree " + ShDegree;

        /// <summary>JSON array of all formats of scene files.</summary>
        public static string FormatsJson() => Text.Get(Native.splat_scene_formats);

        /// <summary>JSON: what was found in the scene's file.</summary>
        public string LoadReportJson() => Text.Get(Handle, Native.splat_scene_load_report);

        /// <summary>Read a file on another thread, see Load.</summary>
        public static Task<Scene> LoadAsync(string path, SceneFileOptions? options = null) =>
            Task.Run(() => Load(path, options));

        /// <summary>Write a file on another thread, see Save.</summary>
        public Task SaveAsync(string path, SceneFileOptions? options = null) => Task.Run(() => Save(path, options));

        /// <summary>Write a file, whole or not at all, by the extension of its path.</summary>
        public void Save(string path, SceneFileOptions? options = null)
        {
            using (var arena = new Arena())
            {
                splat_scene_file_desc desc = (options ?? new SceneFileOptions()).ToNative();
                Check.Ok(Native.splat_scene_save(Handle, arena.Text(path, nameof(path)), &desc));
            }
        }

        /// <summary>The bytes of such a file.</summary>
        public byte[] ToBytes(SceneFormat format, SceneFileOptions? options = null)
        {
            splat_scene_file_desc desc = (options ?? new SceneFileOptions()).ToNative();
            desc.format = format;
            SafeSceneHandle handle = Handle;
            return Text.GetBytes((buffer, capacity, needed) =>
            {
                splat_scene_file_desc copy = desc;
                return Native.splat_scene_save_memory(handle, &copy, buffer, capacity, needed);
            });
        }

        /// <summary>Measures of the scene.</summary>
        public SceneInfo Info
        {
            get
            {
                var info = new splat_scene_info { struct_size = (uint)sizeof(splat_scene_info) };
                Check.Ok(Native.splat_scene_get_info(Handle, &info));
                return new SceneInfo(&info);
            }
        }

        /// <summary>Number of Gaussians.</summary>
        public long Count { get { Size(out long count, out _); return count; } }

        /// <summary>Degree of the spherical harmonics.</summary>
        public int ShDegree { get { Size(out _, out int degree); return degree; } }

        private void Size(out long count, out int degree)
        {
            ulong gaussians;
            uint bands;
            Check.Ok(Native.splat_scene_get_size(Handle, &gaussians, &bands));
            count = checked((long)gaussians);
            degree = checked((int)bands);
        }

        /// <summary>An attribute in a new array, row-major.</summary>
        public float[] Read(string name)
        {
            Check.NotNull(name, nameof(name));
            Size(out long count, out int degree);
            float[] values = Values.New<float>(name, count, Width(name, degree));
            Read(name, values);
            return values;
        }

        /// <summary>Copy an attribute into memory of the caller.</summary>
        public void Read(string name, Span<float> values) =>
            Values.Move(Handle, name, values, Native.splat_scene_read);

        /// <summary>Replace the values of an attribute.</summary>
        public void Write(string name, ReadOnlySpan<float> values) =>
            Values.Move(Handle, name, values, Native.splat_scene_write);

        // Numbers of one Gaussian; 0 for a name that the library will refuse.
        private static int Width(string name, int degree)
        {
            switch (name)
            {
                case "means": case "scales": case "log_scales": return 3;
                case "rotations": return 4;
                case "opacities": case "opacity_logits": return 1;
                case "sh": return 3 * (Math.Min(degree, 3) + 1) * (Math.Min(degree, 3) + 1);
                default: return 0;
            }
        }

        /// <summary>Copy an attribute to a new tensor of its shape.</summary>
        public Tensor ToTensor(string name, Device device)
        {
            Check.NotNull(device, nameof(device));
            using (var arena = new Arena())
            {
                IntPtr tensor;
                Check.Ok(Native.splat_scene_to_tensor(
                    Handle, arena.Text(name, nameof(name)), device.Handle, &tensor));
                return new Tensor(tensor);
            }
        }

        /// <summary>
        /// Draw one picture for each camera, of its size. A program that draws again and again keeps
        /// a Rasterizer.
        /// </summary>
        /// <param name="cameras">at least one</param>
        /// <param name="options">null: RGB of 8 bits over black</param>
        /// <param name="device">null: the best one, opened for the call</param>
        /// <param name="token">cancels all calls of the device, without which there is none</param>
        public Image[] Render(IReadOnlyList<Camera> cameras, RenderOptions? options = null,
                              Device? device = null,
                              CancellationToken token = default(CancellationToken))
        {
            splat_camera[] natives = Camera.ToNative(Check.NotNull(cameras, nameof(cameras)));
            options = options ?? new RenderOptions();
            var images = new Image[natives.Length];
            for (int i = 0; i < images.Length; ++i)
                images[i] = new Image(cameras[i].Width, cameras[i].Height, options.PlaneCount, options.Type);
            if (device == null && token.CanBeCanceled)
                throw new ArgumentException("a call that opens its own device cannot be cancelled: " +
                                            "give a device", nameof(token));
            using (var arena = new Arena())
            using (device == null ? null : Cancellation.Of(device.Handle, token))
            {
                splat_scene_render_desc desc = options.ToNative();
                Check.Ok(Native.splat_scene_render(
                    Handle, device == null ? SafeDeviceHandle.Null : device.Handle,
                    (splat_camera*)arena.Pin(natives), (uint)natives.Length, &desc,
                    (splat_image*)arena.Pin(Image.ToNative(images, nameof(images), arena))), token);
            }
            return images;
        }

        /// <summary>Draw on another thread, see Render.</summary>
        public Task<Image[]> RenderAsync(IReadOnlyList<Camera> cameras, RenderOptions? options = null,
                                         Device? device = null,
                                         CancellationToken token = default(CancellationToken)) =>
            Task.Run(() => Render(cameras, options, device, token), token);

        /// <summary>Move, turn and scale the scene, with its spherical harmonics.</summary>
        public void Transform(Similarity similarity)
        {
            Check.NotNull(similarity, nameof(similarity));
            var native = new splat_similarity { scale = similarity.Scale };
            Check.Numbers<double>(similarity.Rotation, 4, nameof(similarity.Rotation));
            Check.Numbers<double>(similarity.Translation, 3, nameof(similarity.Translation));
            for (int i = 0; i < 4; ++i) native.rotation[i] = similarity.Rotation[i];
            for (int i = 0; i < 3; ++i) native.translation[i] = similarity.Translation[i];
            Check.Ok(Native.splat_scene_transform(Handle, &native));
        }

        /// <summary>Keep the Gaussians whose mean lies in a box, faces included.</summary>
        public void Crop(ReadOnlySpan<double> low, ReadOnlySpan<double> high)
        {
            fixed (double* from = &MemoryMarshal.GetReference(Check.Numbers(low, 3, nameof(low))))
            fixed (double* to = &MemoryMarshal.GetReference(Check.Numbers(high, 3, nameof(high))))
                Check.Ok(Native.splat_scene_crop(Handle, from, to));
        }

        /// <summary>Keep the Gaussians whose mean lies in a sphere, surface included.</summary>
        public void CropSphere(ReadOnlySpan<double> center, double radius)
        {
            fixed (double* middle = &MemoryMarshal.GetReference(Check.Numbers(center, 3, nameof(center))))
                Check.Ok(Native.splat_scene_crop_sphere(Handle, middle, radius));
        }

        /// <summary>
        /// Drop the bands of the harmonics above a degree, 0 to 3; bands that are missing become zeros.
        /// </summary>
        public void SetShDegree(int degree) =>
            Check.Ok(Native.splat_scene_set_sh_degree(Handle, Check.Unsigned(degree, nameof(degree))));

        /// <summary>Keep the Gaussians of at least that opacity, 0 to 1.</summary>
        public void Filter(double minOpacity, FilterFlags flags = FilterFlags.None) =>
            Check.Ok(Native.splat_scene_filter(Handle, flags, minOpacity));

        /// <summary>
        /// Chamfer distance and F-score of the means of the Gaussians against true points, x, y, z
        /// of each.
        /// </summary>
        /// <param name="points">in the scene's units and axes</param>
        /// <param name="threshold">distance of precision, recall and F-score</param>
        /// <param name="minOpacity">of the Gaussians that count</param>
        public PointScores ComparePoints(ReadOnlySpan<float> points, double threshold,
                                         double minOpacity = 1.0 / 255)
        {
            fixed (float* from = &MemoryMarshal.GetReference(points))
            {
                var scores = new splat_point_scores { struct_size = (uint)sizeof(splat_point_scores) };
                Check.Ok(Native.splat_scene_compare_points(
                    Handle, minOpacity, from, (ulong)points.Length, threshold, &scores));
                return new PointScores(&scores);
            }
        }
    }
}
