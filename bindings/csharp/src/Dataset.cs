using System;
using System.Collections.Generic;
using System.Globalization;
using System.Runtime.ExceptionServices;
using System.Threading;
using System.Threading.Tasks;
using Splat.Interop;

namespace Splat
{
    /// <summary>How to open a data set.</summary>
    public sealed class DatasetOptions
    {
        /// <summary>"store", "tables", "srn", "co3d", "nmr", "disn" (and its parts, "disn_easy",
        /// "disn_hard", "disn_albedo"), "objaverse", "gso", "images"; null: by the folder.</summary>
        public string? Format { get; set; }
        /// <summary>"train", "val", "test"; null: train.</summary>
        public string? Split { get; set; }
        /// <summary>"cars", "hydrants", where there are several; null: the only one.</summary>
        public string? Category { get; set; }
        /// <summary>The objects of "objaverse" in their order, a JSON array of names.</summary>
        public string? ObjectsFile { get; set; }
        /// <summary>Names of sequences of "co3d" to leave out.</summary>
        public string? ExcludedFile { get; set; }
        /// <summary>Test objects of "nmr" and their source views.</summary>
        public string? ViewsFile { get; set; }
        /// <summary>Pixels of the images, which are square; 0: as stored.</summary>
        public int Resolution { get; set; }
        /// <summary>Only the first objects; 0: all.</summary>
        public int Limit { get; set; }
        /// <summary>For decoded images; 0: 1 GiB.</summary>
        public long CacheBytes { get; set; }
        /// <summary>Behind transparent pixels, 3 numbers 0 to 1; null: black.</summary>
        public float[]? Background { get; set; }
        /// <summary>Maps that are required, leniency.</summary>
        public DataFlags Flags { get; set; }
    }

    /// <summary>Which arrays of views to read.</summary>
    [Flags]
    public enum ViewParts
    {
        /// <summary>Images and cameras.</summary>
        ImagesAndCameras = 0,
        /// <summary>Depth maps, too.</summary>
        Depths = 1,
        /// <summary>Normal maps, too.</summary>
        Normals = 2,
        /// <summary>Masks, too.</summary>
        Masks = 4,
        /// <summary>Channels of planes, too.</summary>
        Planes = 8,
    }

    /// <summary>n views of R x R pixels.</summary>
    public sealed class DatasetViews
    {
        /// <summary>[n,3,R,R] 0 to 1.</summary>
        public float[] Images { get; internal set; } = Array.Empty<float>();
        /// <summary>[n,1,R,R] 0 to 1, larger is nearer; null unless asked for; so are the next three.</summary>
        public float[]? Depths { get; internal set; }
        /// <summary>[n,3,R,R] (normal + 1) / 2, in the camera's axes.</summary>
        public float[]? Normals { get; internal set; }
        /// <summary>[n,1,R,R] 0 to 1.</summary>
        public float[]? Masks { get; internal set; }
        /// <summary>[n,5,R,R] (normal + 1) / 2, distance, id of the pixel's plane; 0 without one.</summary>
        public float[]? Planes { get; internal set; }
        /// <summary>[n,16] row vectors; the world is the frame of the first view.</summary>
        public float[] ViewToWorld { get; internal set; } = Array.Empty<float>();
        /// <summary>[n,4] w x y z of that rotation.</summary>
        public float[] Quaternions { get; internal set; } = Array.Empty<float>();
        /// <summary>[n,2] pixels.</summary>
        public float[] Focals { get; internal set; } = Array.Empty<float>();
        /// <summary>[n] of the origin along the camera's axis (CO3D), else 0.</summary>
        public float[] OriginDistances { get; internal set; } = Array.Empty<float>();
    }

    /// <summary>Numbers of a set of procedural objects, see Dataset.WriteSynthetic.</summary>
    public sealed class SyntheticOptions
    {
        /// <summary>Folder to write to.</summary>
        public string? Path { get; set; }
        /// <summary>"cars", "chairs", "mixed"; null: cars.</summary>
        public string? Category { get; set; }
        /// <summary>Seed of all random choices.</summary>
        public long Seed { get; set; }
        /// <summary>Pixels, 8 to 2048; 0: 128.</summary>
        public int Resolution { get; set; }
        /// <summary>Views of an object of the split train; 0: 50.</summary>
        public int TrainViews { get; set; }
        /// <summary>Views of an object of val and test; 0: 251.</summary>
        public int TestViews { get; set; }
        /// <summary>Objects of the split train.</summary>
        public int TrainObjects { get; set; }
        /// <summary>Objects of the split val.</summary>
        public int ValObjects { get; set; }
        /// <summary>Objects of the split test.</summary>
        public int TestObjects { get; set; }
    }

    /// <summary>Where tables are imported to, see Dataset.ImportTables.</summary>
    public sealed class TableOptions
    {
        /// <summary>Folder of the store; null: where a Dataset of the tables looks.</summary>
        public string? Out { get; set; }
        /// <summary>"train", "val", "test"; null: train.</summary>
        public string? Split { get; set; }
        /// <summary>DuckDB's library; null: SPLAT_DUCKDB_LIBRARY, or found.</summary>
        public string? DuckDb { get; set; }
        /// <summary>Remove an import of other tables in the folder.</summary>
        public bool Replace { get; set; }
        /// <summary>
        /// Parts of the work, which as many processes do; the last to end completes the store.
        /// 0: 1.
        /// </summary>
        public int Shards { get; set; }
        /// <summary>The part that this call does, from 0.</summary>
        public int Shard { get; set; }
    }

    /// <summary>What of a data set to write, and how, see Dataset.Export.</summary>
    public sealed class ExportOptions
    {
        /// <summary>"tables", "srn", "images", "store"; null: tables.</summary>
        public string? Layout { get; set; }
        /// <summary>Split to write; null: that of the data set.</summary>
        public string? Split { get; set; }
        /// <summary>In names of folders and configurations; null: cars.</summary>
        public string? Category { get; set; }
        /// <summary>DuckDB's library; null: SPLAT_DUCKDB_LIBRARY, or found.</summary>
        public string? DuckDb { get; set; }
        /// <summary>Numbers of objects; null: all.</summary>
        public IReadOnlyList<int>? Objects { get; set; }
        /// <summary>Parts of a store, see TableOptions.</summary>
        public int Shards { get; set; }
        /// <summary>The part to write, see TableOptions.</summary>
        public int Shard { get; set; }
    }

    /// <summary>Objects seen by several cameras, stored in a folder. Thread-safe.</summary>
    public sealed unsafe class Dataset : NativeObject<SafeDatasetHandle>
    {
        /// <summary>
        /// The name of an object as one part of a path, for files that are named after it: %XX for
        /// whatever leads elsewhere or is forbidden on some system, at most 200 bytes.
        /// </summary>
        public static string PathName(string name)
        {
            using (var arena = new Arena())
            {
                byte* text = arena.Text(name, nameof(name));
                return Text.Get((buffer, capacity, needed) => Native.splat_path_name(
                    text, buffer, capacity, needed));
            }
        }

        /// <summary>Open the data set in a folder.</summary>
        public Dataset(string path, DatasetOptions? options = null)
            : base(Create(path, options ?? new DatasetOptions()))
        {
            Resolution = Number("resolution");
            Count = Number("objects");
        }

        private static SafeDatasetHandle Create(string path, DatasetOptions options)
        {
            if (options.Background != null)
                Check.Numbers<float>(options.Background, 3, nameof(options.Background));
            using (var arena = new Arena())
            {
                var desc = new splat_dataset_desc
                {
                    struct_size = (uint)sizeof(splat_dataset_desc),
                    flags = options.Flags,
                    path = arena.Text(path, nameof(path)),
                    format = arena.Optional(options.Format, nameof(options.Format)),
                    split = arena.Optional(options.Split, nameof(options.Split)),
                    category = arena.Optional(options.Category, nameof(options.Category)),
                    objects_file = arena.Optional(options.ObjectsFile, nameof(options.ObjectsFile)),
                    excluded_file = arena.Optional(options.ExcludedFile, nameof(options.ExcludedFile)),
                    views_file = arena.Optional(options.ViewsFile, nameof(options.ViewsFile)),
                    resolution = Check.Unsigned(options.Resolution, nameof(options.Resolution)),
                    limit = Check.Unsigned(options.Limit, nameof(options.Limit)),
                    cache_bytes = Check.Unsigned(options.CacheBytes, nameof(options.CacheBytes)),
                };
                for (int i = 0; options.Background != null && i < 3; ++i)
                    desc.background[i] = options.Background[i];
                IntPtr handle;
                Check.Ok(Native.splat_dataset_open(&desc, &handle));
                return new SafeDatasetHandle(handle, true);
            }
        }

        // A number of the report.
        private int Number(string key)
        {
            var match = System.Text.RegularExpressions.Regex.Match(
                ReportJson(), "\"" + key + "\"\\s*:\\s*(\\d+)");
            return match.Success ? int.Parse(match.Groups[1].Value, CultureInfo.InvariantCulture) : 0;
        }

        /// <summary>Number of objects.</summary>
        public int Count { get; }

        /// <summary>Pixels of the images, both ways.</summary>
        public int Resolution { get; }

        internal override string About => Count + " objects, " + Resolution + " x " + Resolution;

        /// <summary>JSON: format, objects, names, views of each.</summary>
        public string ReportJson() => Text.Get(Handle, Native.splat_dataset_report);

        /// <summary>Read views of one object, in the given order.</summary>
        public DatasetViews Read(int objectIndex, IReadOnlyList<int> views,
                                 ViewParts parts = ViewParts.ImagesAndCameras)
        {
            uint[] numbers = ViewNumbers(views, nameof(views));
            int n = numbers.Length;
            Func<long, float[]> numbersOf = each => Values.New<float>("the views", n, each);
            long area = (long)Resolution * Resolution;
            var result = new DatasetViews
            {
                Images = numbersOf(3 * area),
                Depths = (parts & ViewParts.Depths) != 0 ? numbersOf(area) : null,
                Normals = (parts & ViewParts.Normals) != 0 ? numbersOf(3 * area) : null,
                Masks = (parts & ViewParts.Masks) != 0 ? numbersOf(area) : null,
                Planes = (parts & ViewParts.Planes) != 0 ? numbersOf(5 * area) : null,
                ViewToWorld = numbersOf(16),
                Quaternions = numbersOf(4),
                Focals = numbersOf(2),
                OriginDistances = numbersOf(1),
            };
            using (var arena = new Arena())
            {
                var native = new splat_dataset_views
                {
                    struct_size = (uint)sizeof(splat_dataset_views),
                    images = (float*)arena.Pin(result.Images),
                    depths = (float*)arena.Pin(result.Depths),
                    normals = (float*)arena.Pin(result.Normals),
                    masks = (float*)arena.Pin(result.Masks),
                    planes = (float*)arena.Pin(result.Planes),
                    view_to_world = (float*)arena.Pin(result.ViewToWorld),
                    quaternions = (float*)arena.Pin(result.Quaternions),
                    focals = (float*)arena.Pin(result.Focals),
                    origin_distances = (float*)arena.Pin(result.OriginDistances),
                    image_count = (ulong)result.Images.Length,
                    depth_count = (ulong)(result.Depths?.Length ?? 0),
                    normal_count = (ulong)(result.Normals?.Length ?? 0),
                    mask_count = (ulong)(result.Masks?.Length ?? 0),
                    plane_count = (ulong)(result.Planes?.Length ?? 0),
                    view_to_world_count = (ulong)result.ViewToWorld.Length,
                    quaternion_count = (ulong)result.Quaternions.Length,
                    focal_count = (ulong)result.Focals.Length,
                    origin_distance_count = (ulong)result.OriginDistances.Length,
                };
                Check.Ok(Native.splat_dataset_read(
                    Handle, Check.Unsigned(objectIndex, nameof(objectIndex)),
                    (uint*)arena.Pin(numbers), (uint)n, &native));
            }
            return result;
        }

        internal static uint[] ViewNumbers(IReadOnlyList<int> views, string name)
        {
            var numbers = new uint[Check.NotNull(views, name).Count];
            for (int i = 0; i < numbers.Length; ++i)
                numbers[i] = Check.Unsigned(views[i], name + "[" + i + "]");
            return numbers;
        }

        /// <summary>JSON: problems and warnings of all files of one object.</summary>
        public string CheckJson(int objectIndex)
        {
            uint number = Check.Unsigned(objectIndex, nameof(objectIndex));
            return Text.Get((buffer, capacity, needed) =>
                Native.splat_dataset_check(Handle, number, buffer, capacity, needed));
        }

        /// <summary>
        /// Make the data set of the published code from a split of CO3D's raw release. Sequences
        /// that are there are kept.
        /// </summary>
        public static void PrepareCo3d(string raw, string output, string category,
                                       string? split = null, int size = 0, int limit = 0,
                                       Co3dFlags flags = 0)
        {
            using (var arena = new Arena())
            {
                var desc = new splat_co3d_desc
                {
                    struct_size = (uint)sizeof(splat_co3d_desc),
                    flags = flags,
                    raw = arena.Text(raw, nameof(raw)),
                    @out = arena.Text(output, nameof(output)),
                    category = arena.Text(category, nameof(category)),
                    split = arena.Optional(split, nameof(split)),
                    size = Check.Unsigned(size, nameof(size)),
                    limit = Check.Unsigned(limit, nameof(limit)),
                };
                Check.Ok(Native.splat_co3d_prepare(&desc, null));
            }
        }

        /// <summary>
        /// Turn masks of classes and instances into tokens of each view, for data.tokens_file, or with
        /// TokensFlags.Pooled into vectors, for data.embedding_file. `masks` has SPLIT/OBJECT/ with a .png
        /// for each view; `names` is a .json of COCO's panoptic annotations, or a palette. 0: the
        /// library's defaults.
        /// </summary>
        public static void WriteTokens(string data, string masks, string names, string output,
                                       int dimension = 0, int tokens = 0, TokensFlags flags = 0,
                                       string? format = null, string? category = null)
        {
            using (var arena = new Arena())
            {
                var desc = new splat_tokens_desc
                {
                    struct_size = (uint)sizeof(splat_tokens_desc),
                    flags = flags,
                    data = arena.Text(data, nameof(data)),
                    format = arena.Optional(format, nameof(format)),
                    category = arena.Optional(category, nameof(category)),
                    masks = arena.Text(masks, nameof(masks)),
                    names = arena.Text(names, nameof(names)),
                    @out = arena.Text(output, nameof(output)),
                    dimension = Check.Unsigned(dimension, nameof(dimension)),
                    tokens = Check.Unsigned(tokens, nameof(tokens)),
                };
                Check.Ok(Native.splat_tokens_write(&desc, null));
            }
        }

        /// <summary>
        /// Copy a split of tables in Parquet files to a store, which a Dataset reads fast. What
        /// `progress` throws ends the import, which goes on when it is called again.
        /// </summary>
        public static void ImportTables(string path, TableOptions? options = null,
                                        Action<long, long>? progress = null)
        {
            options = options ?? new TableOptions();
            using (var arena = new Arena())
            {
                var desc = new splat_dataset_import_desc
                {
                    struct_size = (uint)sizeof(splat_dataset_import_desc),
                    flags = options.Replace ? ImportFlags.Replace : ImportFlags.None,
                    path = arena.Text(path, nameof(path)),
                    @out = arena.Optional(options.Out, nameof(options.Out)),
                    split = arena.Optional(options.Split, nameof(options.Split)),
                    duckdb = arena.Optional(options.DuckDb, nameof(options.DuckDb)),
                    shards = Check.Unsigned(options.Shards, nameof(options.Shards)),
                    shard = Check.Unsigned(options.Shard, nameof(options.Shard)),
                };
                splat_dataset_import_desc* given = &desc;
                Run(progress, callback => Native.splat_dataset_import(given, callback, null));
            }
        }

        /// <summary>The same on another thread; `progress` has the objects that are done, and all.</summary>
        public static Task ImportTablesAsync(string path, TableOptions? options = null,
            IProgress<(long Done, long Total)>? progress = null,
            CancellationToken token = default(CancellationToken)) =>
            Task.Run(() => ImportTables(path, options, Reported(progress, token)), token);

        // What cancels is thrown by the callback, which ends the call.
        private static Action<long, long> Reported(IProgress<(long Done, long Total)>? progress,
                                                   CancellationToken token) => (done, total) =>
        {
            token.ThrowIfCancellationRequested();
            progress?.Report((done, total));
        };

        /// <summary>
        /// Write objects with their cameras, images and maps, as 8 bits at the data set's
        /// resolution.
        /// </summary>
        public void Export(string path, ExportOptions? options = null,
                           Action<long, long>? progress = null)
        {
            options = options ?? new ExportOptions();
            using (var arena = new Arena())
            {
                uint[]? numbers = options.Objects == null
                    ? null : ViewNumbers(options.Objects, nameof(options.Objects));
                if (numbers != null && numbers.Length == 0)
                    throw new ArgumentException("Objects is empty; null exports all", nameof(options));
                var desc = new splat_dataset_export_desc
                {
                    struct_size = (uint)sizeof(splat_dataset_export_desc),
                    path = arena.Text(path, nameof(path)),
                    layout = arena.Optional(options.Layout, nameof(options.Layout)),
                    split = arena.Optional(options.Split, nameof(options.Split)),
                    category = arena.Optional(options.Category, nameof(options.Category)),
                    duckdb = arena.Optional(options.DuckDb, nameof(options.DuckDb)),
                    objects = (uint*)arena.Pin(numbers),
                    object_count = (ulong)(numbers?.Length ?? 0),
                    shards = Check.Unsigned(options.Shards, nameof(options.Shards)),
                    shard = Check.Unsigned(options.Shard, nameof(options.Shard)),
                };
                splat_dataset_export_desc* given = &desc;
                Run(progress, callback => Native.splat_dataset_export(Handle, given, callback, null));
            }
        }

        /// <summary>The same on another thread; `progress` has the objects that are done, and all.</summary>
        public Task ExportAsync(string path, ExportOptions? options = null,
            IProgress<(long Done, long Total)>? progress = null,
            CancellationToken token = default(CancellationToken)) =>
            Task.Run(() => Export(path, options, Reported(progress, token)), token);

        /// <summary>Call the library; an exception of `progress` is thrown at the end.</summary>
        private static void Run(Action<long, long>? progress,
                                Func<splat_progress_callback, ResultCode> call)
        {
            Exception? thrown = null;
            splat_progress_callback callback = (user, done, total) =>
            {
                try
                {
                    progress?.Invoke((long)done, (long)total);
                    return 0;
                }
                catch (Exception error)
                {
                    thrown = error;
                    return 1;
                }
            };
            ResultCode code = call(callback);
            GC.KeepAlive(callback);
            if (thrown != null) ExceptionDispatchInfo.Capture(thrown).Throw();
            Check.Ok(code);
        }

        /// <summary>
        /// Write one procedural object, counted over all splits, train first. Several threads may
        /// write different objects at once.
        /// </summary>
        public static void WriteSynthetic(SyntheticOptions options, int index)
        {
            Check.NotNull(options, nameof(options));
            using (var arena = new Arena())
            {
                var desc = new splat_synthetic_desc
                {
                    struct_size = (uint)sizeof(splat_synthetic_desc),
                    path = arena.Optional(options.Path, nameof(options.Path)),
                    category = arena.Optional(options.Category, nameof(options.Category)),
                    seed = unchecked((ulong)options.Seed),
                    resolution = Check.Unsigned(options.Resolution, nameof(options.Resolution)),
                    train_views = Check.Unsigned(options.TrainViews, nameof(options.TrainViews)),
                    test_views = Check.Unsigned(options.TestViews, nameof(options.TestViews)),
                    train_objects = Check.Unsigned(options.TrainObjects,
                        nameof(options.TrainObjects)),
                    val_objects = Check.Unsigned(options.ValObjects, nameof(options.ValObjects)),
                    test_objects = Check.Unsigned(options.TestObjects, nameof(options.TestObjects)),
                };
                Check.Ok(Native.splat_synthetic_write(&desc, Check.Unsigned(index, nameof(index))));
            }
        }

        /// <summary>Write all objects, one after the other.</summary>
        public static void WriteSynthetic(SyntheticOptions options)
        {
            Check.NotNull(options, nameof(options));
            long count = (long)Check.Unsigned(options.TrainObjects, nameof(options.TrainObjects)) +
                         Check.Unsigned(options.ValObjects, nameof(options.ValObjects)) +
                         Check.Unsigned(options.TestObjects, nameof(options.TestObjects));
            for (int i = 0; i < count; ++i) WriteSynthetic(options, i);
        }
    }
}
