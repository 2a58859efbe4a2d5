using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Threading;
using System.Threading.Tasks;
using Splat.Interop;

namespace Splat
{
    /// <summary>What to score on which data.</summary>
    public sealed class EvaluatorOptions
    {
        /// <summary>What is scored; null: images of the caller.</summary>
        public Predictor? Predictor { get; set; }
        /// <summary>Opened as the predictor's configuration says; null: DataPath.</summary>
        public Dataset? Dataset { get; set; }
        /// <summary>A folder; both null: the configuration's data.root.</summary>
        public string? DataPath { get; set; }
        /// <summary>Split of that folder; null: test.</summary>
        public string? Split { get; set; }
        /// <summary>A name for what draws the images; needed without a predictor.</summary>
        public string? Method { get; set; }
        /// <summary>Made for the images' resolution; null: LPIPS is NaN.</summary>
        public Lpips? Lpips { get; set; }
        /// <summary>Numbers of the conditioning views; null: by the protocol.</summary>
        public IReadOnlyList<int>? Conditioning { get; set; }
        /// <summary>Conditioning views without a predictor; 0: 1.</summary>
        public int Inputs { get; set; }
        /// <summary>Novel views per object, evenly spread; 0: all.</summary>
        public int NovelViews { get; set; }
        /// <summary>Only the first objects; 0: all.</summary>
        public int Objects { get; set; }
    }

    /// <summary>The views of an object that are scored, conditioning ones first.</summary>
    public sealed class EvaluatedViews
    {
        /// <summary>Conditioning views.</summary>
        public int Inputs { get; internal set; }
        /// <summary>Novel views.</summary>
        public int Novel { get; internal set; }
        /// <summary>Numbers in the data set.</summary>
        public uint[] Numbers { get; internal set; } = Array.Empty<uint>();
        /// <summary>In the frame of the first view.</summary>
        public IReadOnlyList<Camera> Cameras { get; internal set; } = Array.Empty<Camera>();
        /// <summary>[n,3,R,R] targets.</summary>
        public float[] Images { get; internal set; } = Array.Empty<float>();
        /// <summary>[n,3,R,R] by the latest Score of this object; null unless asked for.</summary>
        public float[]? Drawn { get; internal set; }
    }

    /// <summary>
    /// Scores of a predictor, or of images, on the objects of a data set by the published protocol.
    /// The caller synchronises calls on the evaluators of one predictor.
    /// </summary>
    public sealed unsafe class Evaluator : NativeObject<SafeEvaluatorHandle>
    {
        private readonly SafeDeviceHandle? device;

        /// <summary>Create an evaluator.</summary>
        public Evaluator(EvaluatorOptions options) : base(Create(options))
        {
            device = options.Predictor?.Device;
        }

        private static SafeEvaluatorHandle Create(EvaluatorOptions options)
        {
            Check.NotNull(options, nameof(options));
            using (var arena = new Arena())
            {
                uint[]? views = options.Conditioning == null
                    ? null : Dataset.ViewNumbers(options.Conditioning, nameof(options.Conditioning));
                var desc = new splat_evaluator_desc
                {
                    struct_size = (uint)sizeof(splat_evaluator_desc),
                    predictor = arena.Hold(options.Predictor),
                    dataset = arena.Hold(options.Dataset),
                    data_path = arena.Optional(options.DataPath, nameof(options.DataPath)),
                    split = arena.Optional(options.Split, nameof(options.Split)),
                    method = arena.Optional(options.Method, nameof(options.Method)),
                    lpips = arena.Hold(options.Lpips),
                    conditioning = (uint*)arena.Pin(views),
                    conditioning_count = (ulong)(views?.Length ?? 0),
                    inputs = Check.Unsigned(options.Inputs, nameof(options.Inputs)),
                    novel_views = Check.Unsigned(options.NovelViews, nameof(options.NovelViews)),
                    objects = Check.Unsigned(options.Objects, nameof(options.Objects)),
                };
                IntPtr handle;
                Check.Ok(Native.splat_evaluator_create(&desc, &handle));
                return new SafeEvaluatorHandle(handle, true);
            }
        }

        /// <summary>Objects to score, scored so far, resolution.</summary>
        public EvaluatorInfo Info
        {
            get
            {
                var info = new splat_evaluator_info { struct_size = (uint)sizeof(splat_evaluator_info) };
                Check.Ok(Native.splat_evaluator_get_info(Handle, &info));
                return new EvaluatorInfo(&info);
            }
        }

        internal override string About => Info.Scored + " of " + Info.Objects + " objects scored";

        /// <summary>Predict an object, draw its views and score them.</summary>
        public ObjectScores Score(int objectIndex,
            CancellationToken token = default(CancellationToken))
        {
            uint number = Check.Unsigned(objectIndex, nameof(objectIndex));
            SafeEvaluatorHandle handle = Handle;
            using (var arena = new Arena())
            {
                arena.Hold(this);  // the object's name lives as long as it
                var scores = new splat_object_scores { struct_size = (uint)sizeof(splat_object_scores) };
                using (device == null ? null : Cancellation.Of(device, token))
                    Check.Ok(Native.splat_evaluator_score(handle, number, &scores), token);
                return new ObjectScores(&scores);
            }
        }

        /// <summary>
        /// Score all objects on another thread. Those that are scored when the token is cancelled count in the
        /// Summary; `progress` has the scores of each.
        /// </summary>
        public Task<EvaluationSummary> ScoreAllAsync(IProgress<ObjectScores>? progress = null,
            CancellationToken token = default(CancellationToken)) =>
            Task.Run(() =>
            {
                int objects = Info.Objects;
                for (int i = 0; i < objects; ++i)
                {
                    ObjectScores scores = Score(i, token);
                    progress?.Report(scores);
                }
                return Summary;
            }, token);

        /// <summary>Score images [n,3,R,R] of the views that Read gives, in their order.</summary>
        public ObjectScores ScoreImages(int objectIndex, ReadOnlySpan<float> images)
        {
            uint number = Check.Unsigned(objectIndex, nameof(objectIndex));
            SafeEvaluatorHandle handle = Handle;
            using (var arena = new Arena())
            {
                arena.Hold(this);
                var scores = new splat_object_scores { struct_size = (uint)sizeof(splat_object_scores) };
                fixed (float* from = &MemoryMarshal.GetReference(images))
                {
                    float none;
                    Check.Ok(Native.splat_evaluator_score_images(
                        handle, number, from == null ? &none : from, (ulong)images.Length,
                            &scores));
                }
                return new ObjectScores(&scores);
            }
        }

        /// <summary>Read the views of an object that are scored.</summary>
        /// <param name="objectIndex">below Info.Objects</param>
        /// <param name="drawn">also the images of the latest Score, which was of this
        /// object</param>
        public EvaluatedViews Read(int objectIndex, bool drawn = false)
        {
            uint number = Check.Unsigned(objectIndex, nameof(objectIndex));
            int side = Info.Resolution;
            var counts = new splat_evaluated_views { struct_size = (uint)sizeof(splat_evaluated_views) };
            Check.Ok(Native.splat_evaluator_read(Handle, number, &counts));
            int n = (int)(counts.inputs + counts.novel);
            Func<float[]> images = () => Values.New<float>("images", n, 3, side, side);
            var cameras = new splat_camera[n];
            var views = new EvaluatedViews
            {
                Inputs = (int)counts.inputs,
                Novel = (int)counts.novel,
                Numbers = new uint[n],
                Images = images(),
                Drawn = drawn ? images() : null,
            };
            using (var arena = new Arena())
            {
                var native = new splat_evaluated_views
                {
                    struct_size = (uint)sizeof(splat_evaluated_views),
                    numbers = (uint*)arena.Pin(views.Numbers),
                    number_count = (ulong)n,
                    cameras = (splat_camera*)arena.Pin(cameras),
                    camera_count = (ulong)n,
                    images = (float*)arena.Pin(views.Images),
                    image_count = (ulong)views.Images.Length,
                    drawn = (float*)arena.Pin(views.Drawn),
                    drawn_count = (ulong)(views.Drawn?.Length ?? 0),
                };
                Check.Ok(Native.splat_evaluator_read(Handle, number, &native));
            }
            views.Cameras = Camera.FromNative(cameras);
            return views;
        }

        /// <summary>Means and sums over the objects scored so far.</summary>
        public EvaluationSummary Summary
        {
            get
            {
                var summary = new splat_evaluation_summary
                    { struct_size = (uint)sizeof(splat_evaluation_summary) };
                Check.Ok(Native.splat_evaluator_summary(Handle, &summary));
                return new EvaluationSummary(&summary);
            }
        }

        /// <summary>The summary as JSON, the content of results.json.</summary>
        public string ReportJson() => Text.Get(Handle, Native.splat_evaluator_report);

        /// <summary>Write results.json, per_object.csv, per_image.csv, scores.txt and objects.json to a
        /// folder.</summary>
        public void Save(string folder)
        {
            using (var arena = new Arena())
                Check.Ok(Native.splat_evaluator_save(Handle, arena.Text(folder, nameof(folder))));
        }

        /// <summary>Take over the scores in a folder of Save, by the objects' names.</summary>
        public void Load(string folder)
        {
            using (var arena = new Arena())
                Check.Ok(Native.splat_evaluator_load(Handle, arena.Text(folder, nameof(folder))));
        }
    }
}
