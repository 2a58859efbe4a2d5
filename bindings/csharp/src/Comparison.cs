using System;
using System.Collections.Generic;
using Splat.Interop;

namespace Splat
{
    /// <summary>Scores of one object; NaN: none in that metric.</summary>
    public sealed class Score : Facts<Score>
    {
        /// <summary>Make one.</summary>
        public Score(string name, double psnr, double ssim = double.NaN, double lpips = double.NaN)
        {
            Name = Check.NotNull(name, nameof(name));
            Psnr = psnr;
            Ssim = ssim;
            Lpips = lpips;
        }

        /// <summary>Name of the object.</summary>
        public string Name { get; }
        /// <summary>dB.</summary>
        public double Psnr { get; }
        /// <summary>Up to 1.</summary>
        public double Ssim { get; }
        /// <summary>Less is better.</summary>
        public double Lpips { get; }
    }

    /// <summary>Scores of a method: a path or an array, either of which converts to it.</summary>
    public sealed class ScoreSet
    {
        private readonly string? path;
        private readonly Score[]? scores;

        private ScoreSet(string? path, Score[]? scores)
        {
            this.path = path;
            this.scores = scores;
        }

        /// <summary>per_object.csv, scores.txt, results.json, or a folder of them.</summary>
        public static implicit operator ScoreSet?(string? path) =>
            path == null ? null : new ScoreSet(path, null);

        /// <summary>Scores in memory.</summary>
        public static implicit operator ScoreSet?(Score[]? scores) =>
            scores == null ? null : new ScoreSet(null, scores);

        internal unsafe splat_score_set ToNative(Arena arena)
        {
            splat_score[]? natives = scores == null ? null : new splat_score[scores.Length];
            for (int i = 0; scores != null && natives != null && i < natives.Length; ++i)
            {
                Score score = Check.NotNull(scores[i], "scores[" + i + "]");
                natives[i] = new splat_score
                {
                    @object = arena.Text(score.Name, nameof(score.Name)),
                    psnr = score.Psnr,
                    ssim = score.Ssim,
                    lpips = score.Lpips,
                };
            }
            return new splat_score_set
            {
                path = arena.Optional(path, nameof(path)),
                scores = (splat_score*)arena.Pin(natives),
                score_count = (ulong)(natives?.Length ?? 0),
            };
        }
    }

    /// <summary>Is B better than A, or is the difference chance? Needs no device; thread-safe.</summary>
    public sealed unsafe class Comparison : NativeObject<SafeComparisonHandle>
    {
        /// <summary>Compare B with A in every metric that both have.</summary>
        /// <param name="a">a path or an array of Score</param>
        /// <param name="b">a path or an array of Score</param>
        /// <param name="flags">whether objects are paired</param>
        /// <param name="seed">of all random choices</param>
        /// <param name="resamples">random permutations; 0: 300000</param>
        /// <param name="bootstraps">samples of the interval; 0: 10000</param>
        public Comparison(ScoreSet a, ScoreSet b, CompareFlags flags = CompareFlags.None,
                          long seed = 0, int resamples = 0, int bootstraps = 0)
            : base(Create(a, b, flags, seed, resamples, bootstraps))
        {
        }

        private static SafeComparisonHandle Create(ScoreSet a, ScoreSet b, CompareFlags flags,
                                                   long seed, int resamples, int bootstraps)
        {
            Check.NotNull(a, nameof(a));
            Check.NotNull(b, nameof(b));
            using (var arena = new Arena())
            {
                var desc = new splat_compare_desc
                {
                    struct_size = (uint)sizeof(splat_compare_desc),
                    flags = flags,
                    a = a.ToNative(arena),
                    b = b.ToNative(arena),
                    seed = unchecked((ulong)seed),
                    resamples = Check.Unsigned(resamples, nameof(resamples)),
                    bootstraps = Check.Unsigned(bootstraps, nameof(bootstraps)),
                };
                IntPtr handle;
                Check.Ok(Native.splat_compare_scores(&desc, &handle));
                return new SafeComparisonHandle(handle, true);
            }
        }

        /// <summary>Counts of objects and metrics.</summary>
        public ComparisonInfo Info
        {
            get
            {
                var info = new splat_comparison_info { struct_size = (uint)sizeof(splat_comparison_info) };
                Check.Ok(Native.splat_comparison_get_info(Handle, &info));
                return new ComparisonInfo(&info);
            }
        }

        internal override string About => Info.Metrics + " metrics";

        /// <summary>The comparison in each metric.</summary>
        public IReadOnlyList<MetricComparison> Metrics
        {
            get
            {
                var metrics = new MetricComparison[Info.Metrics];
                for (int i = 0; i < metrics.Length; ++i)
                {
                    var native = new splat_metric_comparison
                        { struct_size = (uint)sizeof(splat_metric_comparison) };
                    Check.Ok(Native.splat_comparison_metric(Handle, (uint)i, &native));
                    metrics[i] = new MetricComparison(&native);
                }
                return metrics;
            }
        }

        /// <summary>The scores that were compared in one of Metrics.</summary>
        public void Samples(int index, out double[] a, out double[] b)
        {
            var native = new splat_metric_comparison { struct_size = (uint)sizeof(splat_metric_comparison) };
            Check.Ok(Native.splat_comparison_metric(Handle, Check.Unsigned(index, nameof(index)), &native));
            double[] first = Values.New<double>("a", (long)native.n_a);
            double[] second = Values.New<double>("b", (long)native.n_b);
            fixed (double* toA = first)
            fixed (double* toB = second)
                Check.Ok(Native.splat_comparison_samples(Handle, (uint)index, toA, native.n_a, toB,
                                                         native.n_b));
            a = first;
            b = second;
        }

        /// <summary>JSON: the comparison in every metric.</summary>
        public string ReportJson() => Text.Get(Handle, Native.splat_comparison_report);
    }
}
