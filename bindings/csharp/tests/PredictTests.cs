using System;
using System.IO;
using System.Linq;

namespace Splat.Tests
{
    internal static class PredictorTests
    {
        [Test]
        private static void PredictsFromPixelsAndFiles()
        {
            Picture disc = Shared.Disc();
            string path = Shared.PathOf("disc.png");
            PictureInfo cut = disc.Cut(64, new float[] { 1, 1, 1 }, out Image square, out Image mask);
            Expect.Equal(Found.ByAlpha, cut.Found);
            Expect.Equal(255, (int)mask.Data[32 * 64 + 32]);
            Expect.Equal(255, (int)square.Data[0]);
            using (var predictor = new Predictor(Shared.Device))
            {
                PredictorInfo info = predictor.Info;
                Expect.Equal(64, info.Resolution);
                Expect.Equal(4096L, info.Gaussians);
                Expect.True(!info.Depth && info.Category.Length > 0, "one picture of a category");
                using (Prediction first = predictor.Predict(disc))
                {
                    Expect.Equal(first.Gaussians, first.Scene.Count);
                    Expect.Equal(Found.ByAlpha, first.Pictures[0].Found);
                    Expect.Equal(1.0, first.Cameras[0].WorldToCamera[0]);
                    Expect.Contains("\"alpha\"", first.ReportJson);
                    Shared.DiscImage().Save(path);
                    using (Prediction second = predictor.Predict(new Picture { Image = path }))
                        Expect.Same(first.Scene.Read("means"), second.Scene.Read("means"));
                }
                Expect.Contains("\"config\"", predictor.ReportJson());
            }
        }

        [Test]
        private static void TakesWeightsInMemory()
        {
            string path = Weights.BuiltinPath();
            using (Weights weights = Weights.Load("cars64"))
            using (var predictor = new Predictor(Shared.Device, new PredictorOptions
                   {
                       Weights = weights,
                       Config = File.ReadAllText(Path.Combine(Path.GetDirectoryName(path),
                           "config.json")),
                   }))
            {
                weights.Dispose();
                using (Prediction result = predictor.Predict(Shared.Disc()))
                    Expect.True(result.Gaussians > 100, "Gaussians");
            }
        }

        [Test]
        private static void RefusesBadInput()
        {
            Expect.Refused(ResultCode.ErrorNotFound, "none.safetensors", () => new Predictor(
                Shared.Device,
                new PredictorOptions { WeightsPath = Shared.PathOf("none.safetensors") }));
            using (var predictor = new Predictor(Shared.Device))
            {
                Expect.Refused(ResultCode.ErrorNotFound, "none.png",
                               () => predictor.Predict(
                                   new Picture { Image = Shared.PathOf("none.png") }));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => predictor.Predict(new Picture()));
                Expect.Refused(ResultCode.ErrorInvalidArgument, "",
                               () => predictor.Predict(new[] { Shared.Disc(), Shared.Disc() }));
                Expect.Throws<ArgumentNullException>(() => predictor.Predict((Picture)null));
                Expect.Throws<ArgumentException>(() => predictor.Predict(
                    new Picture { Image = new Image(8, 8, 3), WorldToCamera = new double[3] }));
                predictor.Dispose();
                Expect.Throws<ObjectDisposedException>(() => predictor.Predict(Shared.Disc()));
            }
        }
    }

    internal static class EvaluatorTests
    {
        [Test]
        private static void ScoresAPredictor()
        {
            // A small network of the data's size with random weights.
            using (var model = new Model(Shared.Device,
                new ModelOptions { Config = ModelTests.Tiny }))
            {
                model.Init(1);
                using (Weights weights = model.Store())
                using (var predictor = new Predictor(Shared.Device, new PredictorOptions
                       { Weights = weights, Config = ModelTests.Tiny }))
                using (Dataset data = Cars.Open("test"))
                using (var evaluator = new Evaluator(new EvaluatorOptions { Predictor = predictor,
                    Dataset = data }))
                {
                    using (Prediction result = predictor.Predict(data, 0, new[] { 0, 1, 2 }))
                        Expect.Equal(3, result.Cameras.Count);
                    Expect.Equal(2, evaluator.Info.Objects);
                    for (int i = 0; i < 2; ++i)
                    {
                        ObjectScores scores = evaluator.Score(i);
                        Expect.True(scores.Novel.Psnr > 0 && scores.Name.Length > 0, "scores");
                    }
                    EvaluatedViews views = evaluator.Read(1, true);
                    Expect.Equal(views.Images.Length, views.Drawn.Length);
                    Expect.Equal(6, views.Inputs + views.Novel);
                    Expect.Refused(ResultCode.ErrorInvalidState, "latest", () => evaluator.Read(0, true));
                    Expect.Equal(2, evaluator.Summary.Objects);
                    Expect.Contains("\"novel\"", evaluator.ReportJson());
                    evaluator.Save(Shared.PathOf("eval"));
                    evaluator.Load(Shared.PathOf("eval"));
                    Expect.Equal(2, evaluator.Summary.Objects);
                    Expect.Refused(ResultCode.ErrorNotFound, "objects.json", () =>
                        evaluator.Load(Shared.PathOf("nowhere")));
                    Expect.True(File.Exists(Shared.PathOf("eval/results.json")), "files");
                    Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => evaluator.Score(2));
                    evaluator.Dispose();
                    Expect.Throws<ObjectDisposedException>(() => evaluator.Score(0));
                }
            }
        }

        [Test]
        private static void ScoresImagesOfTheCaller()
        {
            using (Dataset data = Cars.Open("test"))
            using (var evaluator = new Evaluator(new EvaluatorOptions { Dataset = data,
                Method = "copy" }))
            {
                EvaluatedViews views = evaluator.Read(0);
                float[] gray = views.Images.Select(v => v * 0.9f).ToArray();
                ObjectScores scores = evaluator.ScoreImages(0, gray);
                Expect.True(scores.Novel.Psnr > 15, "close images");
                Expect.Equal(5, evaluator.ScoreImages(0, views.Images).Novel.PerfectViews);
                Expect.Refused(ResultCode.ErrorShapeMismatch, "", () =>
                    evaluator.ScoreImages(0, new float[4]));
                Expect.Refused(ResultCode.ErrorInvalidState, "", () => evaluator.Score(0));
            }
            Expect.Refused(ResultCode.ErrorInvalidArgument, "", () => new Evaluator(new EvaluatorOptions()));
        }
    }

    internal static class ComparisonTests
    {
        private static Score[] Scores(double offset)
        {
            return Enumerable.Range(0, 20).Select(i =>
                new Score("car" + i, 20 + offset + i % 3 * 0.1)).ToArray();
        }

        [Test]
        private static void FindsTheBetterOne()
        {
            using (var comparison = new Comparison(Scores(0), Scores(1), CompareFlags.None, 1,
                                                   2000, 500))
            {
                MetricComparison psnr = comparison.Metrics.Single();
                Expect.Equal(Metric.Psnr, psnr.Metric);
                Expect.Equal(Verdict.Better, psnr.Verdict);
                Expect.Near(1, psnr.Difference, 1e-9);
                comparison.Samples(0, out double[] a, out double[] b);
                Expect.Equal(20, a.Length);
                Expect.Near(1, b[7] - a[7], 1e-9);
                Expect.True(comparison.Info.Comparable && !comparison.Info.Unpaired, "pairs");
                Expect.Contains("\"psnr\"", comparison.ReportJson());
            }
        }

        [Test]
        private static void RefusesBadInput()
        {
            Expect.Refused(ResultCode.ErrorNotFound, "none.csv",
                           () => new Comparison(Shared.PathOf("none.csv"), Scores(0)));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "", () =>
                new Comparison(new Score[0], Scores(0)));
            Expect.Throws<ArgumentNullException>(() => new Comparison((Score[])null, Scores(0)));
            using (var comparison = new Comparison(Scores(0), Scores(1), CompareFlags.Unpaired, 1,
                100, 100))
                Expect.Refused(ResultCode.ErrorInvalidArgument, "",
                               () => comparison.Samples(5, out double[] a, out double[] b));
        }
    }

    /// <summary>Models of depth, normals and masks; tests/interop runs one in C and Python.</summary>
    internal static class PriorModelTests
    {
        [Test]
        private static void SaysWhatIsMissing()
        {
            Expect.Contains("\"u2net\"", PriorModel.Preset());
            Expect.Contains("\"sha256\"", PriorModel.Preset("u2net"));
            Expect.Refused(ResultCode.ErrorNotFound, "did you mean 'u2net'", () => PriorModel.Preset("u3net"));
            Expect.Refused(ResultCode.ErrorNotFound, "runtime.so", () =>
                new PriorModel("u2net", "/nowhere/u2net.onnx", "/nowhere/runtime.so"));
            Expect.Refused(ResultCode.ErrorInvalidArgument, "neither a preset", () => new PriorModel(null));
        }
    }
}
