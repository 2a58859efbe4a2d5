using System;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using System.Threading;
using System.Threading.Tasks;
using Splat.Interop;

namespace Splat
{
    /// <summary>A picture or a map: a file or pixels.</summary>
    public sealed class PictureSource
    {
        private readonly string? path;
        private readonly Image? image;

        private PictureSource(string? path, Image? image)
        {
            this.path = path;
            this.image = image;
        }

        /// <summary>A PNG, JPEG or WebP file.</summary>
        public static implicit operator PictureSource?(string? path) =>
            path == null ? null : new PictureSource(path, null);

        /// <summary>Pixels, reduced to 8 bits.</summary>
        public static implicit operator PictureSource?(Image? image) =>
            image == null ? null : new PictureSource(null, image);

        internal static unsafe splat_picture_source ToNative(PictureSource? source, Arena arena)
        {
            var native = new splat_picture_source();
            if (source == null) return native;
            native.path = arena.Optional(source.path, nameof(source.path));
            if (source.image != null) native.pixels = source.image.ToNative(arena);
            return native;
        }

        /// <summary>The path, or size and type of the pixels.</summary>
        public override string ToString() => path ?? "" + image;
    }

    /// <summary>One view of an object. Image takes a path or an Image.</summary>
    public sealed class Picture
    {
        /// <summary>The picture.</summary>
        public PictureSource? Image { get; set; }
        /// <summary>Object mask; null: found by alpha or by the colour of the border.</summary>
        public PictureSource? Mask { get; set; }
        /// <summary>Where the network takes it; larger is nearer, or as model.head.depth_maps says.</summary>
        public PictureSource? Depth { get; set; }
        /// <summary>Where the network takes it; (normal + 1) / 2.</summary>
        public PictureSource? Normal { get; set; }
        /// <summary>PictureFlags.Whole: use the largest centred square.</summary>
        public PictureFlags Flags { get; set; }
        /// <summary>The object's longer side, as a part of the square's; 0: 0.65.</summary>
        public float Foreground { get; set; }
        /// <summary>Pixels; 0: by its Exif data, else not known.</summary>
        public double Focal { get; set; }
        /// <summary>Along the camera's axis, where the network takes it.</summary>
        public double OriginDistance { get; set; }
        /// <summary>16 numbers, row-major; null: none.</summary>
        public IReadOnlyList<double>? WorldToCamera { get; set; }
        /// <summary>A custom embedding, or null.</summary>
        public ReadOnlyMemory<float> Embedding { get; set; }
        /// <summary>[token_dim,tokens] where the network takes them, or null.</summary>
        public ReadOnlyMemory<float> Tokens { get; set; }

        internal unsafe splat_picture ToNative(Arena arena)
        {
            var native = new splat_picture
            {
                image = PictureSource.ToNative(Image, arena),
                mask = PictureSource.ToNative(Mask, arena),
                depth = PictureSource.ToNative(Depth, arena),
                normal = PictureSource.ToNative(Normal, arena),
                flags = Flags,
                foreground = Foreground,
                focal = Focal,
                origin_distance = OriginDistance,
                embedding = (float*)arena.Pin(Embedding),
                embedding_count = (ulong)Embedding.Length,
                tokens = (float*)arena.Pin(Tokens),
                token_count = (ulong)Tokens.Length,
            };
            double[]? pose = WorldToCamera?.ToArray();
            if (pose != null) Check.Numbers<double>(pose, 16, nameof(WorldToCamera));
            for (int i = 0; pose != null && i < 16; ++i) native.world_to_camera[i] = pose[i];
            return native;
        }

        /// <summary>
        /// Cut a picture out as a predictor does, without a device: squares of `resolution` pixels,
        /// RGB and mask, of 8 bits.
        /// </summary>
        public unsafe PictureInfo Cut(int resolution, float[] background, out Image image,
                                      out Image mask)
        {
            if (background != null) Check.Numbers<float>(background, 3, nameof(background));
            var square = new Image(resolution, resolution, 3);
            var cover = new Image(resolution, resolution, 1);
            using (var arena = new Arena())
            {
                splat_picture picture = ToNative(arena);
                var info = new splat_picture_info();
                var desc = new splat_picture_cut_desc
                {
                    struct_size = (uint)sizeof(splat_picture_cut_desc),
                    resolution = Check.Unsigned(resolution, nameof(resolution)),
                    image = square.ToNative(arena),
                    mask = cover.ToNative(arena),
                };
                for (int i = 0; background != null && i < 3; ++i)
                    desc.background[i] = background[i];
                Check.Ok(Native.splat_picture_cut(&picture, &desc, &info));
                image = square;
                mask = cover;
                return new PictureInfo(&info);
            }
        }
    }

    /// <summary>Weights and configuration of a predictor; the defaults are the built-in ones.</summary>
    public sealed class PredictorOptions
    {
        /// <summary>A file of weights.</summary>
        public string? WeightsPath { get; set; }
        /// <summary>Used instead of reading the file.</summary>
        public Weights? Weights { get; set; }
        /// <summary>JSON or YAML; null: the file beside the weights.</summary>
        public string? Config { get; set; }
        /// <summary>A file of low-rank adapters, which are folded in.</summary>
        public string? AdaptersPath { get; set; }
        /// <summary>Low-rank adapters in memory, in place of the file.</summary>
        public Weights? Adapters { get; set; }
        /// <summary>0: of their metadata, else of the configuration.</summary>
        public double AdaptersAlpha { get; set; }
        /// <summary>0, or 2 to 64: predictions from so many drawn views are joined; F3D-Gaus has 8.</summary>
        public uint Aggregate { get; set; }
        /// <summary>How these views are drawn.</summary>
        public Convention Convention { get; set; }
    }

    /// <summary>A scene, and what became of the pictures.</summary>
    public sealed class Prediction : IDisposable
    {
        internal Prediction(Scene scene)
        {
            Scene = scene;
        }

        /// <summary>In the frame of the first picture's camera.</summary>
        public Scene Scene { get; }
        /// <summary>Cameras of the views, relative to the first.</summary>
        public IReadOnlyList<Camera> Cameras { get; internal set; } = Array.Empty<Camera>();
        /// <summary>How the object was found in each picture; empty for objects of data sets.</summary>
        public IReadOnlyList<PictureInfo> Pictures { get; internal set; } = Array.Empty<PictureInfo>();
        /// <summary>Gaussians of the scene.</summary>
        public long Gaussians { get; internal set; }
        /// <summary>Gaussians left out because numbers of theirs are not finite.</summary>
        public long NotFinite { get; internal set; }
        /// <summary>Gaussians left out because no image of 8 bits shows them.</summary>
        public long Faint { get; internal set; }
        /// <summary>Milliseconds to read and cut out the pictures.</summary>
        public double ReadMs { get; internal set; }
        /// <summary>Milliseconds to run the network and read its Gaussians.</summary>
        public double NetworkMs { get; internal set; }
        /// <summary>The same as JSON.</summary>
        public string ReportJson { get; internal set; } = "";

        /// <summary>Dispose the scene.</summary>
        public void Dispose() => Scene.Dispose();

        /// <summary>The scene, what was left out, and how long it took.</summary>
        public override string ToString() =>
            Scene + " of " + Cameras.Count + " views\nleft out: " + NotFinite + " not finite, " + Faint +
            " faint\n" + (ReadMs + NetworkMs).ToString("0.0", CultureInfo.InvariantCulture) + " ms";
    }

    /// <summary>A network with weights that turns pictures of an object into a scene. Thread-safe.</summary>
    public sealed unsafe class Predictor : NativeObject<SafePredictorHandle>
    {
        private readonly SafeDeviceHandle device;

        /// <summary>Create a predictor; null: the built-in weights.</summary>
        public Predictor(Device device, PredictorOptions? options = null)
            : base(Create(device, options ?? new PredictorOptions()))
        {
            this.device = device.Handle;
        }

        private static SafePredictorHandle Create(Device device, PredictorOptions options)
        {
            Check.NotNull(device, nameof(device));
            using (var arena = new Arena())
            {
                var desc = new splat_predictor_desc
                {
                    struct_size = (uint)sizeof(splat_predictor_desc),
                    weights_path = arena.Optional(options.Weights == null ? Weights.Beside(options.WeightsPath)
                                                                          : options.WeightsPath,
                                                  nameof(options.WeightsPath)),
                    weights = arena.Hold(options.Weights),
                    config = arena.Optional(options.Config, nameof(options.Config)),
                    adapters_path = arena.Optional(options.AdaptersPath, nameof(options.AdaptersPath)),
                    adapters = arena.Hold(options.Adapters),
                    adapters_alpha = options.AdaptersAlpha,
                    aggregate = options.Aggregate,
                    convention = options.Convention,
                };
                IntPtr handle;
                Check.Ok(Native.splat_predictor_create(device.Handle, &desc, &handle));
                return new SafePredictorHandle(handle, true);
            }
        }

        /// <summary>Create a predictor on another thread.</summary>
        public static Task<Predictor> OpenAsync(Device device, PredictorOptions? options = null) =>
            Task.Run(() => new Predictor(device, options));

        internal SafeDeviceHandle Device => device;

        /// <summary>What the predictor takes and gives.</summary>
        public PredictorInfo Info
        {
            get
            {
                using (var arena = new Arena())
                {
                    arena.Hold(this);  // the category lives as long as it
                    var info = new splat_predictor_info { struct_size = (uint)sizeof(splat_predictor_info) };
                    Check.Ok(Native.splat_predictor_get_info(Handle, &info));
                    return new PredictorInfo(&info);
                }
            }
        }

        internal override string About => Info.Resolution + " pixels, " + Info.Gaussians + " Gaussians";

        /// <summary>JSON: weights, warnings, metadata, configuration.</summary>
        public string ReportJson() => Text.Get(Handle, Native.splat_predictor_report);

        /// <summary>Predict a scene from one picture.</summary>
        public Prediction Predict(Picture picture,
                                  CancellationToken token = default(CancellationToken))
        {
            return Predict(new[] { Check.NotNull(picture, nameof(picture)) }, token);
        }

        /// <summary>Predict a scene from as many pictures as the network has views.</summary>
        public Prediction Predict(IReadOnlyList<Picture> pictures,
                                  CancellationToken token = default(CancellationToken))
        {
            Check.NotNull(pictures, nameof(pictures));
            using (var arena = new Arena())
            {
                var natives = new splat_picture[pictures.Count];
                for (int i = 0; i < natives.Length; ++i)
                    natives[i] = Check.NotNull(pictures[i], "pictures[" + i + "]").ToNative(arena);
                var first = (splat_picture*)arena.Pin(natives);
                SafePredictorHandle handle = Handle;
                return Predict(natives.Length, token, (scene, facts) =>
                    Native.splat_predictor_predict(handle, first, (uint)natives.Length, scene,
                        facts));
            }
        }

        /// <summary>
        /// Predict an object of a data set that was opened with the predictor's resolution and
        /// background. The network sees the first of the views, as many as it takes.
        /// </summary>
        public Prediction Predict(Dataset dataset, int objectIndex, IReadOnlyList<int> views,
                                  CancellationToken token = default(CancellationToken))
        {
            Check.NotNull(dataset, nameof(dataset));
            uint number = Check.Unsigned(objectIndex, nameof(objectIndex));
            uint[] numbers = Dataset.ViewNumbers(views, nameof(views));
            using (var arena = new Arena())
            {
                var first = (uint*)arena.Pin(numbers);
                SafePredictorHandle handle = Handle;
                SafeDatasetHandle data = dataset.Handle;
                return Predict(numbers.Length, token, (scene, facts) =>
                    Native.splat_predictor_predict_object(handle, data, number, first,
                                                          (uint)numbers.Length, scene, facts));
            }
        }

        /// <summary>Predict on another thread. The pictures must stay as they are until the task ends.</summary>
        public Task<Prediction> PredictAsync(Picture picture, CancellationToken token = default(CancellationToken)) =>
            Task.Run(() => Predict(picture, token), token);

        /// <summary>The same from as many pictures as the network has views.</summary>
        public Task<Prediction> PredictAsync(IReadOnlyList<Picture> pictures,
                                             CancellationToken token = default(CancellationToken)) =>
            Task.Run(() => Predict(pictures, token), token);

        /// <summary>The same of an object of a data set.</summary>
        public Task<Prediction> PredictAsync(Dataset dataset, int objectIndex, IReadOnlyList<int> views,
                                             CancellationToken token = default(CancellationToken)) =>
            Task.Run(() => Predict(dataset, objectIndex, views, token), token);

        private delegate ResultCode PredictCall(IntPtr* scene, splat_prediction* facts);

        private Prediction Predict(int views, CancellationToken token, PredictCall call)
        {
            var cameras = new splat_camera[views];
            var pictures = new splat_picture_info[views];
            using (var arena = new Arena())
            {
                var facts = new splat_prediction
                {
                    struct_size = (uint)sizeof(splat_prediction),
                    camera_capacity = (uint)views,
                    cameras = (splat_camera*)arena.Pin(cameras),
                    pictures = (splat_picture_info*)arena.Pin(pictures),
                    picture_capacity = (uint)views,
                };
                IntPtr scene;
                using (Cancellation.Of(device, token)) Check.Ok(call(&scene, &facts), token);
                return Result(new Scene(scene), cameras, facts);
            }
        }

        // A scene that no Prediction holds is disposed.
        private static Prediction Result(Scene scene, splat_camera[] cameras, splat_prediction facts)
        {
            try
            {
                var result = new Prediction(scene)
                {
                    Gaussians = checked((long)facts.gaussians),
                    NotFinite = checked((long)facts.not_finite),
                    Faint = checked((long)facts.faint),
                    ReadMs = facts.read_ms,
                    NetworkMs = facts.network_ms,
                };
                var found = new PictureInfo[Math.Min(facts.picture_capacity, facts.picture_count)];
                Array.Resize(ref cameras, (int)Math.Min(facts.camera_capacity, facts.camera_count));
                for (int i = 0; i < found.Length; ++i)
                    found[i] = new PictureInfo(facts.pictures + i);
                result.Cameras = Camera.FromNative(cameras);
                result.Pictures = found;
                result.ReportJson = Text.Get((buffer, capacity, needed) =>
                {
                    splat_prediction copy = facts;
                    return Native.splat_prediction_report(&copy, buffer, capacity, needed);
                });
                return result;
            }
            catch
            {
                scene.Dispose();
                throw;
            }
        }
    }
}
